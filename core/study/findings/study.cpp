// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/study.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/study/findings/extend.hpp"
#include "core/study/findings/page_sections.hpp"
#include "core/study/findings/when_it_acts.hpp"
#include "core/study/findings/words.hpp"
#include "core/study/inference/estimate.hpp"
#include "core/study/inference/rivals.hpp"

namespace backwash::study {
namespace {

/// Flights with windows.
std::size_t flown(const Observations& seen) {
  std::size_t count = 0;
  for (std::size_t f = 0; f < seen.units.size(); ++f) count += seen.units.first[f + 1] > seen.units.first[f] ? 1u : 0u;
  return count;
}

/// Effects and why they are not tested. `unjudged`: by how much the rotors differ without being judged, ln; 0: they
/// are.
std::vector<std::pair<std::string, std::string>> untested(const Observations& seen, double unjudged) {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Effect& effect : effects()) {
    std::string why;
    bool tested = false;
    for (const Form& form : effect.forms) {
      const auto reason = why_not_tested(form, seen);
      if (!reason) tested = true;
      if (reason && why.empty()) why = *reason;
    }
    if (!tested) all.emplace_back(effect.name, why);
  }
  for (const Effect& effect : effects())
    if (unjudged > 0 && (effect.at_rotors == AtRotors::propeller || effect.at_rotors == AtRotors::sensor))
      all.emplace_back(effect.name,
                       "the same in all flights and no more than craft are built with: the rotors differ by " +
                           percent(unjudged) + ", as those of a sound craft may; give --reference flights");
  return all;
}

/// Where nothing else was found, a dependence is looked for at its share of the verdict's level.
std::vector<Dependence> what_remains(const Evidence& evidence, const std::vector<Accepted>& accepted, bool silent,
                                     const CauseSearchOptions& options) {
  options.progress("whether what remains depends on something");
  const double level = silent ? kRules.dependence_share * options.accept_p : kRules.dependence_level.value;
  return remaining_dependence(evidence, columns_of(accepted, evidence.seen()), options.seed, level);
}

/// Where nothing else was found, a dependence is a structure without a name. Beside an accepted cause, or one that the
/// model holds, it is a hint: with enough flights the error of the cause's form is found as well.
std::vector<UnknownStructure> with_dependence(std::vector<UnknownStructure> unknown,
                                              const std::vector<Dependence>& remaining, bool silent) {
  if (!silent || remaining.empty() || !remaining.front().found) return unknown;
  const Dependence& first = remaining.front();
  unknown.push_back({first.regressor, first.group, first.p_holm / kRules.dependence_share, {}, "any", {}});
  return unknown;
}

/// Whether a cause moves the means of level axes (0) or of z (1) itself.
bool moves(const Accepted& cause, std::size_t axes) {
  return std::ranges::any_of(cause.columns, [&](auto& column) {
    return std::ranges::any_of(column.parts, [&](auto& part) {
      return !part.aside && (axes == 0 ? part.channel <= kMeanY : part.channel == kMeanZ);
    });
  });
}

/// What the loop makes of a cause's push.
void tell_positions(NamedCause& cause, const SteadyAnswer& answer) {
  for (std::size_t k = 0; k < answer.axes.size(); ++k) {
    const auto& axes = answer.axes[k];
    if (cause.found.form->in_sensor || !moves(cause.found, k)) continue;
    cause.shift_decay[k] = axes.rate;
    cause.keeps = cause.keeps && axes.keeps();
    if (!axes.told())
      cause.positions = "whether the loop holds its push off cannot be told: of the shift " + number(axes.low) +
                        " to " + number(axes.high) +
                        " is left; positions of plans and simulations are not this craft's";
  }
}

/// Gain, worth as applied and positions of what acts in all flights.
std::vector<NamedCause> in_all_flights(const Evidence& evidence, const std::vector<Accepted>& accepted,
                                       SteadyAnswer& answer) {
  std::vector<NamedCause> causes;
  std::vector<std::string> unwritable(accepted.size());
  auto applied = judge(evidence, accepted, unwritable);
  for (std::size_t i = 0; i < accepted.size(); ++i) {
    NamedCause cause{};
    cause.found = accepted[i];
    cause.applied = applied[i];
    if (!applied[i].refused.empty()) continue;
    if (const auto why = why_unwritable(cause, evidence.seen())) unwritable[i] = "no model file holds it: " + *why;
  }
  if (std::ranges::any_of(unwritable, [](auto& why) { return !why.empty(); }))
    applied = judge(evidence, accepted, unwritable);
  std::vector<std::vector<double>> beside;
  for (const Applied& each : applied) beside.push_back(each.beside);
  answer = steady_answer(pushes(accepted, beside, evidence.seen()), evidence.seen());
  for (std::size_t i = 0; i < accepted.size(); ++i) {
    NamedCause cause{};
    cause.found = accepted[i];
    cause.gain = held_out(evidence, accepted, i);
    cause.applied = applied[i];
    cause.extrapolated = extrapolated(accepted[i], evidence.seen());
    cause.largest_flown = largest_flown(accepted[i], evidence.seen());
    tell_positions(cause, answer);
    if (cause.found.form->anchor) cause.found.scale.anchor = cause.found.form->anchor(evidence.seen().windows);
    causes.push_back(std::move(cause));
  }
  return causes;
}

/// What a cause may be as well, and what would tell.
struct Doubt {
  const Form* form;
  std::string what;
};

/// A mass costs thrust, and so does one weak rotor.
std::optional<Doubt> doubted_payload(const NamedCause& cause, const std::optional<RotorLevel>& level) {
  const Accepted& found = cause.found;
  if (found.form->effect->at_rotors != AtRotors::weight || rotor_state(*found.form) || !cause.flights.empty() ||
      !level || !may_be_one_rotor(*level, found.theta[0]))
    return std::nullopt;
  const auto propeller =
      std::ranges::find_if(catalogue(), [](auto* form) { return rotor_state(*form) == RotorState::propeller_damage; });
  return Doubt{*propeller, "none: give --reference flights of the craft while its rotors were sound"};
}

/// How much more thrust was commanded per unit of x, within flights, m/s².
double asked_along(const std::vector<double>& x, const Observations& seen) {
  double product = 0, square = 0;
  for (std::size_t f = 0; f + 1 < seen.first.size(); ++f) {
    const double n = static_cast<double>(seen.first[f + 1] - seen.first[f]);
    double mean = 0;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i) mean += x[i] / n;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i) {
      product += (x[i] - mean) * seen.windows[i].thrust_acc;
      square += (x[i] - mean) * (x[i] - mean);
    }
  }
  return square > 0 ? product / square : 0;
}

/// A drift of the sensor asks for no more thrust, a battery that sags for as much as the drift. Without a logged
/// voltage the one is told as the other: where more than half of it was commanded both stand.
std::optional<Doubt> doubted_drift(const NamedCause& cause, const Observations& seen) {
  const Accepted& found = cause.found;
  if (seen.has(Source::battery) || !seen.has(Source::thrust) || !found.form->in_sensor || found.columns.size() <= kZ)
    return std::nullopt;
  const double z = found.theta[kZ], asked = asked_along(found.columns[kZ].parts.back().x, seen);
  if (-asked * z < z * z / 2) return std::nullopt;
  const auto sag =
      std::ranges::find_if(catalogue(), [](auto* f) { return std::ranges::count(f->needs, Source::battery) > 0; });
  return Doubt{*sag, "none: log the battery's voltage (battery_v)"};
}

/// All that was found, with what it is told apart by. `level`: of all rotors (SettledRotors).
std::vector<NamedCause> causes_of(const WholeSearch& whole, const Evidence& evidence, const Observations& seen,
                                  const std::optional<RotorLevel>& level, SteadyAnswer& answer) {
  std::vector<NamedCause> causes = in_all_flights(evidence, whole.found.accepted, answer);
  for (const auto& cause : whole.changes) causes.push_back(named(cause, evidence));
  for (auto& cause : causes) {
    cause.found = in_words(std::move(cause.found));
    for (const Rival& rival : cause.found.rivals)
      cause.separate_by.push_back(separations(evidence, cause.found, rival).front());
    for (const auto& doubt : {doubted_payload(cause, level), doubted_drift(cause, seen)}) {
      if (!doubt) continue;
      cause.found.rivals.push_back({doubt->form->cause(), doubt->form, doubt->form->scales.front(), 0});
      cause.separate_by.push_back({doubt->form->cause(), doubt->what, std::nullopt});
    }
  }
  return causes;
}

StudyVerdict verdict_of(const std::vector<NamedCause>& causes, const std::vector<UnknownStructure>& unknown) {
  if (causes.empty()) return unknown.empty() ? StudyVerdict::nothing_found : StudyVerdict::unknown_structure;
  const bool clear = std::ranges::all_of(causes, [](const auto& cause) { return cause.found.rivals.empty(); });
  return clear ? StudyVerdict::cause_found : StudyVerdict::cannot_distinguish;
}

}  // namespace

double coverage(const Observations& seen) { return covered(seen, {}, {}).before; }

const char* to_string(StudyVerdict verdict) {
  static const char* const kNames[] = {"cause_found", "cannot_distinguish", "unknown_structure", "nothing_found",
                                       "insufficient"};
  return kNames[static_cast<std::size_t>(verdict)];
}

StudyResult study(const Observations& seen, const StudyOptions& options) {
  if (static_cast<double>(flown(seen)) < kRules.fewest_flights)
    return {.verdict = StudyVerdict::insufficient, .not_tested = untested(seen, 0)};
  SettledRotors settled = settle_rotors(options.sound, seen);
  const WholeSearch whole = search_all(std::move(settled.seen), options.search);
  const CauseSearchResult& found = whole.found;
  Evidence evidence = whole.evidence();
  evidence.whiten(columns_of(found.accepted, whole.rest));
  SteadyAnswer answer;
  const auto causes = causes_of(whole, evidence, seen, settled.level, answer);
  const bool silent = causes.empty() && found.unknown.empty() && options.search.known.empty();
  const auto remaining =
      options.dependence ? what_remains(evidence, found.accepted, silent, options.search) : std::vector<Dependence>{};
  const auto unknown = with_dependence(found.unknown, remaining, silent);
  const double threshold = std::max(found.threshold, kRules.least_threshold.value);
  if (options.minimum_detectable) options.search.progress("smallest effects that these flights would show");
  return {.verdict = verdict_of(causes, unknown),
          .causes = causes,
          .steady = answer,
          .unknown = unknown,
          .refused = found.refused,
          .not_tested = untested(seen, settled.unjudged),
          .minimum_detectable = options.minimum_detectable ? minimum_detectable(evidence, options.search, threshold)
                                                           : decltype(StudyResult::minimum_detectable){},
          .smallest_looked_for = options.minimum_detectable,
          .threshold = found.threshold,
          .remaining = remaining};
}

std::map<std::string, std::map<std::string, double>> minimum_detectable(const Evidence& evidence,
                                                                        const CauseSearchOptions& options,
                                                                        double threshold) {
  constexpr int kFlips = static_cast<int>(kRules.power_flips);
  const auto draws = sign_draws(evidence.seen().units.size(), kFlips, options.seed + 1);
  std::map<std::string, std::map<std::string, double>> least;
  each_named(evidence, {}, [&](SearchCandidate&& c) {
    if (least.contains(c.name) && !least[c.name].contains(c.form->parameters[0])) return;
    NormalEquations injected = c.normal;
    const auto power = [&](double size) {
      int found = 0;
      for (const auto& signs : draws) {
        for (std::size_t f = 0; f < injected.b.size(); ++f)
          injected.b[f] = signs[f] * c.normal.b[f] + size * c.normal.A[f].col(0);
        const SmallVector fit = injected.fit();
        if (injected.gain() - c.prior_nats(fit) >= threshold && c.effect(fit)) ++found;
      }
      return static_cast<double>(found) / kFlips;
    };
    double low = kRules.power_low, high = kRules.power_high;  // ln of the parameter
    if (power(std::exp(high)) < kRules.power) return;
    for (int i = 0; i < kRules.power_halvings; ++i) {
      const double middle = (low + high) / 2;
      (power(std::exp(middle)) >= kRules.power ? high : low) = middle;
    }
    auto& entry = least[c.name];
    const double size = c.form->in_words(0, std::exp(high));
    const auto [at, fresh] = entry.emplace(c.form->parameters[0], size);
    if (!fresh) at->second = std::min(at->second, size);
  });
  return least;
}

}  // namespace backwash::study
