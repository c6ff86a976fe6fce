// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/study/findings/held_out.hpp"
#include "core/study/findings/steady_answer.hpp"
#include "core/study/inference/levels/dependence.hpp"
#include "core/study/inference/rotors/sound_rotors.hpp"
#include "core/study/inference/whole_search.hpp"

namespace backwash::study {

enum class StudyVerdict { cause_found, cannot_distinguish, unknown_structure, nothing_found, insufficient };
const char* to_string(StudyVerdict verdict);

struct Separation {
  std::string rival, manoeuvre;
  std::optional<double> expected_nats;  ///< none: no manoeuvre of the list separates the two
};

struct NamedCause {
  Accepted found;
  Gain gain;
  std::vector<Separation> separate_by;
  Applied applied = {};                    ///< what the extension by it is worth; refused: it does not join the model
  std::string extrapolated = {};           ///< why the size is none that was flown (words.hpp)
  double largest_flown = 0;                ///< m/s² or ln: what the cause added at most, of its first channel
  std::array<double, 2> shift_decay{};     ///< level and up, 1/s: at which the loop holds its push off; 0: it does not
  bool keeps = true;                       ///< the craft rests where the push holds it: plans move their centre there
  std::string positions = {};              ///< why its positions are not to be believed; empty: they are
  std::vector<ActingFlight> flights = {};  ///< in which it acts; empty: all
  std::string when = {};                   ///< of a change (when_it_acts.hpp)
};

struct StudyOptions {
  CauseSearchOptions search;
  bool minimum_detectable = true;
  bool dependence = true;  ///< whether what remains depends on something: where nothing is accepted, of the verdict too
  std::optional<SoundRotors> sound = {};  ///< of reference flights; without, rotors may differ as craft are built
};

struct StudyResult {
  StudyVerdict verdict = StudyVerdict::nothing_found;
  std::vector<NamedCause> causes{};
  SteadyAnswer steady{};  ///< of the loop that flew, to all causes together
  std::vector<UnknownStructure> unknown{};
  std::vector<Refused> refused{};  ///< causes that would have led, but for a size that their laws cannot have
  std::vector<std::pair<std::string, std::string>> not_tested{};  ///< name, why
  /// Per cause and parameter: least size found with 80 % power.
  std::map<std::string, std::map<std::string, double>> minimum_detectable{};
  bool smallest_looked_for = false;  ///< whether that was computed
  double threshold = 0;              ///< nats
  /// Every pair tested, found ones first. Where nothing was accepted, those found make the verdict
  /// unknown_structure; else they are hints. Empty with too few flights.
  std::vector<Dependence> remaining{};
};

/// Share of the measured samples in the model's central 90 %.
double coverage(const Observations& seen);

/// The whole procedure on observed flights. About 1 s for 12 flights of 100 s, more with the minimum detectable
/// effects.
StudyResult study(const Observations& seen, const StudyOptions& options);

/// Expected nats by which 12 further flights of a manoeuvre would separate a cause from its rival beyond what as many
/// hovers on one spot would, for each manoeuvre of the list that brings 0.5 nats; best first. Never empty: where none
/// does, one entry without a number says so.
std::vector<Separation> separations(const Evidence& evidence, const Accepted& cause, const Rival& rival);

/// Least first parameter of each testable cause that is found with 80 % power, by injection into sign-flipped
/// residuals.
std::map<std::string, std::map<std::string, double>> minimum_detectable(const Evidence& evidence,
                                                                        const CauseSearchOptions& options,
                                                                        double threshold);

}  // namespace backwash::study
