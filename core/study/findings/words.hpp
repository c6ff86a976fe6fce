// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/study/findings/consequence.hpp"
#include "core/study/findings/study.hpp"

/// What a study says, in an engineer's words.
namespace backwash::study {

/// What to change for a cause that was found: file, key, value, or what to do with the craft.
Remedy remedy_of(const NamedCause& cause, const Vehicle& vehicle);

/// What to do, in the first line of all that a study says: each cause's remedy with how sure it is (surely: odds of
/// 1,000; probably: 20; perhaps) and the 95 % interval of its first number; the flight to fly where causes cannot be
/// told apart; or that there is nothing to change.
std::string advice(const StudyResult& result, const Observations& seen, const Vehicle& vehicle);
/// What `study --after` is told for the remedies that are keys of the vehicle file: "body.mass=1.02"; empty: none is.
std::string to_try(const StudyResult& result, const Vehicle& vehicle);

/// Parameters and the ends of their intervals as their words say them (Form::meanings): once, and last.
Accepted in_words(Accepted cause);

/// A share in whole percent: "15 %".
std::string percent(double share);

/// Nats as odds: "20 to 1", "1 to 5", "more than a million to 1".
std::string odds(double nats);

/// Why the size of a cause is an extrapolation, and the most of it that was flown: its reference lies outside of what
/// the flights flew. Empty where it was flown, or where the size has no reference.
std::string extrapolated(const Accepted& cause, const Observations& seen);

/// Largest |Σ θ x| over the flown windows of the cause's first channel, in that channel's unit (m/s² or ln).
double largest_flown(const Accepted& cause, const Observations& seen);

/// "rotor drag would have to be -0.2 (k, 1/s), its law has 0 to inf: drag brakes".
std::string refusal(const Refused& refused);
/// "level: 0.02 [-0.1, 0.1] of a steady push's shift is left; the loop holds it off at 0.3 1/s"; empty where the pushes
/// move nothing. `axes`: 0 level, 1 up.
std::string steady_words(const SteadyAnswer& answer, std::size_t axes);
/// "40 times what is typical: 1 to 1600 beforehand", however small. The parameter that is farthest from its typical
/// size is told.
std::string beforehand(const Accepted& cause);

/// Clearance that the causes take from the same plan, m: before less after. Nothing unless both plans are ok.
std::optional<double> clearance_cost(const Consequence& consequence);
/// In a sentence, hover sets too; empty without a consequence of either kind.
std::string cost_sentence(const Consequence& consequence);
/// The same of the corrected vehicle file alone; empty where no remedy is a key of it.
std::string correction_sentence(const Consequence& consequence);

}  // namespace backwash::study
