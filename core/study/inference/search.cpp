// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/search.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/study/inference/estimate.hpp"

namespace backwash::study {
namespace {

/// Everything accepted but one, with what it leaves open, as columns.
std::vector<Column> columns_of(const std::vector<Accepted>& accepted, const Observations& seen,
                               std::size_t but = SIZE_MAX) {
  std::vector<Column> all;
  for (std::size_t i = 0; i < accepted.size(); ++i) {
    if (i == but) continue;
    all.insert(all.end(), accepted[i].columns.begin(), accepted[i].columns.end());
    const auto open = companions(*accepted[i].form, seen);
    all.insert(all.end(), open.begin(), open.end());
  }
  return all;
}

/// What a cause may disturb besides the channels that its columns move: the error of its form is left over there too.
/// Bits: level means; vertical mean; variance, tail and lines; delays and slope; single rotors.
unsigned disturbs(const std::vector<Column>& columns) {
  unsigned kinds = 0;
  for (const auto& column : columns) {
    for (const auto& part : column.parts) {
      const Channel c = part.channel;
      if (c == kMeanX || c == kMeanY) kinds |= 1;
      if (c == kMeanZ) kinds |= 16;
      if ((c >= kVarX && c <= kTail) || (c >= kLine1 && c <= kLine4)) kinds |= 2;
      if (c >= kThrustDelay && c <= kCommandDelayZ) kinds |= 4;
      if (c >= kLine1) kinds |= 8;
    }
  }
  return kinds;
}

/// Gain that a further cause needs: a share of that of each accepted one whose form's error it might be, a larger one
/// where it repairs it in the same moments of the thrust's or the commands' delay.
double needed_gain(const Candidate& candidate, const std::vector<Accepted>& accepted, double threshold) {
  double needed = threshold;
  for (const auto& a : accepted) {
    if (!(disturbs(a.columns) & disturbs(candidate.columns))) continue;
    const auto dynamic = [](const std::vector<Column>& columns) {
      const Channel c = columns.front().parts.front().channel;
      return c >= kThrustDelay && c <= kCommandDelayZ;
    };
    const double share = dynamic(a.columns) && dynamic(candidate.columns) ? kRules.repair_share : kRules.least_share;
    needed = std::max(needed, share * a.gain);
  }
  return needed;
}

bool share_a_channel(const std::vector<Column>& a, const std::vector<Column>& b) {
  std::array<bool, kChannels> moved{};
  for (const auto& column : a)
    for (const auto& part : column.parts) moved[part.channel] = true;
  return std::any_of(b.begin(), b.end(), [&](const Column& column) {
    return std::any_of(column.parts.begin(), column.parts.end(), [&](auto& part) { return moved[part.channel]; });
  });
}

/// Gain that a structure needs beside the accepted causes.
double needed_structure(const Candidate& structure, const std::vector<Accepted>& accepted) {
  double needed = 0;
  for (const auto& a : accepted)
    if (share_a_channel(structure.columns, a.columns))
      needed = std::max(needed, (a.form->constant ? kRules.left_of_constant : kRules.left_share) * a.gain);
  return needed;
}

/// Σ and standard error of the sum of per-flight differences.
std::pair<double, double> difference(const Normal& a, const Normal& b) {
  const auto ga = a.gain_per_flight(), gb = b.gain_per_flight();
  double sum = 0, square = 0;
  const double n = static_cast<double>(ga.size());
  for (std::size_t f = 0; f < ga.size(); ++f) sum += ga[f] - gb[f], square += (ga[f] - gb[f]) * (ga[f] - gb[f]);
  return {sum, std::sqrt(std::max(0.0, (square - sum * sum / n) * n / (n - 1)))};
}

void find_rivals(const Evidence& evidence, std::vector<Accepted>& accepted, std::size_t which, double threshold) {
  Accepted& own = accepted[which];
  const auto others = columns_of(accepted, evidence.seen(), which);
  std::vector<Rival> found;
  for (const Form* each : catalogue()) {
    const Form& form = *each;
    if (form.effect == own.form->effect || why_not_tested(form, evidence.seen())) continue;
    if (std::any_of(accepted.begin(), accepted.end(), [&](auto& a) { return a.form->effect == form.effect; })) continue;
    for (const Scale& scale : form.scales) {
      const auto columns = form.columns(evidence.seen().windows, scale);
      // Both with the same free offsets, unless one of them is an offset itself.
      std::vector<Column> both = own.columns;
      both.insert(both.end(), columns.begin(), columns.end());
      std::vector<Column> nuisance = others;
      if (!form.constant && !own.form->constant) {
        const auto free = offsets(both, evidence.seen());
        nuisance.insert(nuisance.end(), free.begin(), free.end());
      }
      const Normal theirs = evidence.normal(columns, nuisance), ours = evidence.normal(own.columns, nuisance);
      if (!theirs.solvable || !ours.solvable || theirs.gain() < std::min(threshold, kRules.rival_rest * ours.gain()))
        continue;
      const Candidate rival{&form, form.cause(), scale, {}, {}, 0, evidence.size(columns)};
      if (!rival.effect(theirs.fit())) continue;
      // Two causes that explain different data are two causes, not rivals: a rival gains less once ours is known.
      std::vector<Column> with_ours = nuisance;
      with_ours.insert(with_ours.end(), own.columns.begin(), own.columns.end());
      const Normal rest = evidence.normal(columns, with_ours);
      if (rest.solvable && rest.gain() > kRules.rival_rest * theirs.gain()) continue;
      const auto [lead, error] = difference(ours, theirs);
      // Motor commands alone do not tell a damaged rotor from a weight near it, whichever fits better: only the line of
      // its rate does.
      if (own.form->motors_alone && form.motors_alone) {
        found.push_back({form.cause(), &form, scale, lead});
        continue;
      }
      if (lead > kRules.rival_nats && lead > kRules.rival_errors * error) continue;
      if (lead > kRules.rival_most_nats) continue;
      found.push_back({form.cause(), &form, scale, lead});
    }
  }
  std::sort(found.begin(), found.end(), [](auto& a, auto& b) { return a.behind_nats < b.behind_nats; });
  for (const auto& rival : found)
    if (std::none_of(own.rivals.begin(), own.rivals.end(), [&](auto& r) { return r.name == rival.name; }))
      own.rivals.push_back(rival);
}

/// Drops causes that the others make unnecessary, and estimates the rest given each other.
void settle(const Evidence& evidence, std::vector<Accepted>& accepted, double threshold) {
  for (bool dropped = true; dropped && accepted.size() > 1;) {
    dropped = false;
    std::size_t weakest = SIZE_MAX;
    double least = threshold;
    for (std::size_t i = 0; i < accepted.size(); ++i) {
      const auto& a = accepted[i];
      const Normal n = evidence.normal(
          a.columns, nuisance_of(*a.form, a.columns, columns_of(accepted, evidence.seen(), i), evidence.seen()));
      const double gain = n.solvable ? n.gain() : 0;
      if (gain < least) least = gain, weakest = i;
    }
    if (weakest != SIZE_MAX) {
      accepted.erase(accepted.begin() + static_cast<std::ptrdiff_t>(weakest));
      dropped = true;
    }
  }
  for (std::size_t i = 0; i < accepted.size(); ++i)
    refine(evidence, accepted[i], columns_of(accepted, evidence.seen(), i));
}

/// What one step tries: the catalogue and the structures, each with the null of its own maxima and its share of the
/// level.
struct Step {
  std::vector<Candidate> named, structures;
  std::vector<double> null_named, null_structures;
  double threshold, structure_threshold;  // nats

  Step(const Evidence& evidence, const std::vector<Column>& accepted, const std::vector<std::vector<int>>& draws,
       double level)
      : named(named_candidates(evidence, accepted)),
        structures(structure_candidates(evidence, accepted)),
        null_named(null_maxima(named, draws)),
        null_structures(null_maxima(structures, draws)),
        threshold(least_gain(null_named, named_share() * level)),
        structure_threshold(least_gain(null_structures, kRules.structure_share * level)) {}

  static double named_share() { return 1 - kRules.structure_share - kRules.dependence_share; }
  /// Gain above which p_value is at most `level`: so many of the null may be larger.
  static double least_gain(const std::vector<double>& null, double level) {
    const auto larger = static_cast<std::size_t>(level * (1 + static_cast<double>(null.size())) + kRules.bound_error);
    return std::max(kRules.least_threshold.value, null[null.size() - std::clamp<std::size_t>(larger, 1, null.size())]);
  }
};

const Candidate* best_of(const std::vector<Candidate>& all, const std::vector<Accepted>& accepted, double threshold) {
  const Candidate* best = nullptr;
  for (const auto& c : all) {
    const bool known = std::any_of(accepted.begin(), accepted.end(),
                                   [&](auto& a) { return c.form && a.form->effect == c.form->effect; });
    if (known || (best && c.gain <= best->gain)) continue;
    if (c.gain <= needed_gain(c, accepted, threshold) || !c.effect(c.normal.fit())) continue;
    if (!c.form || excludes_zero(c.normal, c.columns)) best = &c;
  }
  return best;
}

UnknownStructure told(const Candidate& structure, double p) {
  const auto group = std::find_if(channel_groups().begin(), channel_groups().end(), [&](auto& g) {
    return g.second.front() == structure.columns.front().parts.front().channel;
  });
  return {structure.name, group->first, p, structure.gain, structure.structure.shape, structure.structure.hz};
}

/// Whether a structure says more than any cause does, and more than the error of an accepted one could.
bool leads(const Candidate& structure, const Candidate* cause, const std::vector<Accepted>& accepted) {
  if (structure.gain < needed_structure(structure, accepted)) return false;
  return !cause ||
         structure.gain - cause->gain > std::max(kRules.structure_lead.value, kRules.structure_margin * cause->gain);
}

}  // namespace

SearchResult search(const Evidence& start, const SearchOptions& options) {
  SearchResult result;
  Evidence evidence = start;
  const auto draws = sign_draws(evidence.seen().units.size(), options.flips, options.seed);
  while (result.accepted.size() < options.most_causes) {
    const auto accepted = columns_of(result.accepted, evidence.seen());
    evidence.whiten(accepted);
    options.progress("looking at every cause, step " + std::to_string(result.accepted.size() + 1));
    const Step step(evidence, accepted, draws,
                    options.accept_p * (result.accepted.empty() ? 1 : kRules.further_level.value));
    if (step.named.empty() && step.structures.empty()) break;
    result.null_gain = step.null_named;
    result.threshold = step.threshold, result.structure_threshold = step.structure_threshold;
    const Candidate* cause = best_of(step.named, result.accepted, step.threshold);
    const Candidate* structure = best_of(step.structures, result.accepted, step.structure_threshold);
    if (structure && leads(*structure, cause, result.accepted)) {
      // A constant of which more than half as much again varies along a regressor is the structure's mean.
      std::erase_if(result.accepted, [&](const Accepted& a) {
        return a.form->constant && share_a_channel(structure->columns, a.columns);
      });
      const double p = p_value(step.null_structures, structure->gain) / kRules.structure_share;
      result.unknown.push_back(told(with_harmonics(*structure, evidence, accepted), p));
      break;
    }
    if (!cause) break;
    const double p = p_value(step.null_named, cause->gain) / Step::named_share();
    Accepted a{cause->form, cause->scale, cause->columns, {}, p, cause->gain, {}, {}};
    refine(evidence, a, accepted);
    result.accepted.push_back(std::move(a));
  }
  evidence.whiten(columns_of(result.accepted, evidence.seen()));
  settle(evidence, result.accepted, result.threshold);
  for (std::size_t i = 0; i < result.accepted.size(); ++i) find_rivals(evidence, result.accepted, i, result.threshold);
  return result;
}

}  // namespace backwash::study
