// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/study/inference/estimate.hpp"
#include "core/study/inference/rivals.hpp"

namespace backwash::study {
namespace {

/// What a cause may disturb besides the channels that its columns move: the error of its form is left over there too.
/// Bits: level means; vertical mean; variance, tail and lines; delays and slope; single rotors.
unsigned disturbs(const std::vector<DesignColumn>& columns) {
  unsigned kinds = 0;
  for (const auto& column : columns) {
    for (const auto& part : column.parts) {
      const Channel c = part.channel;
      if (part.aside) continue;
      if (c == kMeanX || c == kMeanY) kinds |= 1;
      if (c == kMeanZ) kinds |= 16;
      if ((c >= kVarX && c <= kTail) || (c >= kLine1 && c <= kLine4)) kinds |= 2;
      if (c >= kThrustDelay && c <= kTiltDelay) kinds |= 4;
      if (c >= kLine1) kinds |= 8;
    }
  }
  return kinds;
}

/// Gain that a further cause needs beside one that has `gain`: a share of it where it might be the error of that one's
/// form.
double needed_beside(const SearchCandidate& candidate, const std::vector<DesignColumn>& columns, double gain) {
  return disturbs(columns) & disturbs(candidate.columns) ? kRules.least_share * gain : 0;
}

/// Gain that a further cause needs beside the accepted ones and those that the model holds.
double needed_gain(const SearchCandidate& candidate, const std::vector<Accepted>& accepted,
                   const std::vector<Known>& known, double threshold) {
  double needed = threshold;
  for (const auto& a : accepted) needed = std::max(needed, needed_beside(candidate, a.columns, a.gain));
  for (const auto& k : known) needed = std::max(needed, needed_beside(candidate, k.columns, k.gain));
  return needed;
}

/// Gain that a structure needs beside the accepted causes.
double needed_structure(const SearchCandidate& structure, const std::vector<Accepted>& accepted) {
  double needed = 0;
  for (const auto& a : accepted)
    if (share_a_channel(structure.columns, a.columns))
      needed = std::max(needed, (a.form->constant ? kRules.left_of_constant : kRules.left_share) * a.gain);
  return needed;
}

/// Drops causes that the others make unnecessary, and estimates the rest given each other.
void settle(const Evidence& evidence, std::vector<Accepted>& accepted, double threshold) {
  for (bool dropped = true; dropped && accepted.size() > 1;) {
    dropped = false;
    std::size_t weakest = SIZE_MAX;
    double least = threshold;
    for (std::size_t i = 0; i < accepted.size(); ++i) {
      const auto& a = accepted[i];
      const NormalEquations n = evidence.normal(
          a.columns, nuisance_of(*a.form, a.columns, columns_of(accepted, evidence.seen(), i), evidence.seen()));
      const double gain = n.solvable ? n.gain() : 0;
      if (gain < least) {
        least = gain;
        weakest = i;
      }
    }
    if (weakest != SIZE_MAX) {
      accepted.erase(accepted.begin() + static_cast<std::ptrdiff_t>(weakest));
      dropped = true;
    }
  }
  for (std::size_t i = 0; i < accepted.size(); ++i)
    refine(evidence, accepted[i], columns_of(accepted, evidence.seen(), i));
}

/// What one step tries: the catalogue and the structures, outlined, each with the null of its own maxima and its share
/// of the level.
struct SearchStep {
  std::vector<SearchCandidate> named, structures;
  std::vector<double> null_named, null_structures;
  double threshold, structure_threshold;  // nats

  SearchStep(const Evidence& evidence, const std::vector<DesignColumn>& accepted,
             const std::vector<std::vector<int>>& draws, double level) {
    NullMaxima of_named(draws), of_structures(draws);
    each_named(evidence, accepted, [&](SearchCandidate&& c) {
      of_named.add(c);
      named.push_back(outline(std::move(c)));
    });
    each_structure_candidate(evidence, accepted, [&](SearchCandidate&& c) {
      of_structures.add(c);
      structures.push_back(outline(std::move(c)));
    });
    null_named = of_named.sorted();
    null_structures = of_structures.sorted();
    threshold = least_gain(null_named, named_share() * level);
    structure_threshold = least_gain(null_structures, kRules.structure_share * level);
    // The largest gain first, in the order of trial where they are the same: who takes the first that will do fills in
    // no other.
    for (auto* all : {&named, &structures})
      std::stable_sort(all->begin(), all->end(), [](auto& a, auto& b) { return a.gain > b.gain; });
  }

  static double named_share() { return 1 - kRules.structure_share - kRules.dependence_share; }
  /// Gain above which p_value is at most `level`: so many of the null may be larger.
  static double least_gain(const std::vector<double>& null, double level) {
    const auto larger = static_cast<std::size_t>(level * (1 + static_cast<double>(null.size())) + kRules.bound_error);
    return std::max(kRules.least_threshold.value, null[null.size() - std::clamp<std::size_t>(larger, 1, null.size())]);
  }
};

bool is_known(const SearchCandidate& c, const std::vector<Accepted>& accepted) {
  return std::any_of(accepted.begin(), accepted.end(),
                     [&](auto& a) { return c.form && a.form->effect == c.form->effect; });
}

/// What a step's candidates are judged beside.
struct Beside {
  const Evidence& evidence;
  const std::vector<Accepted>& accepted;
  const std::vector<DesignColumn>& columns;  ///< of the accepted
  const std::vector<Known>& known;
};

Refused refused(const Form& form, std::size_t k, double value) {
  const Prior& prior = form.priors[k];
  return {form.cause(), form.formula, form.parameters[k], value, prior.least, prior.most, prior.reason};
}

/// The cause that gains most beside what is accepted, more than `led` nats, but is beyond what its law can be.
std::optional<Refused> beyond_its_law(const std::vector<SearchCandidate>& all, const Beside& beside, double threshold,
                                      double led) {
  for (const auto& c : all) {
    if (c.gain <= std::max(led, threshold)) return std::nullopt;
    if (!c.form || is_known(c, beside.accepted)) continue;
    const auto k = c.beyond_ends(c.fit);
    if (!k || !c.large_enough(c.fit)) continue;
    const auto whole = filled(c, beside.evidence, beside.columns);
    if (c.gain <= needed_gain(whole, beside.accepted, beside.known, threshold) ||
        !excludes_zero(whole.normal, whole.columns))
      continue;
    return refused(*c.form, *k, c.fit[static_cast<Eigen::Index>(*k)]);
  }
  return std::nullopt;
}

std::optional<SearchCandidate> best_of(const std::vector<SearchCandidate>& all, const Beside& beside,
                                       double threshold) {
  for (const auto& c : all) {
    if (c.gain <= threshold) return std::nullopt;
    if (is_known(c, beside.accepted) || !c.effect(c.fit)) continue;
    auto whole = filled(c, beside.evidence, beside.columns);
    if (c.gain <= needed_gain(whole, beside.accepted, beside.known, threshold)) continue;
    if (!c.form || excludes_zero(whole.normal, whole.columns)) return whole;
  }
  return std::nullopt;
}

UnknownStructure told(const SearchCandidate& structure, double p) {
  const auto group = std::find_if(channel_groups().begin(), channel_groups().end(), [&](auto& g) {
    return g.second.front() == structure.columns.front().parts.front().channel;
  });
  return {structure.name, group->first, p, structure.gain, structure.structure.shape, structure.structure.hz};
}

/// Whether a structure says more than any cause does, and more than the error of an accepted one could.
bool leads(const SearchCandidate& structure, const std::optional<SearchCandidate>& cause,
           const std::vector<Accepted>& accepted) {
  if (structure.gain < needed_structure(structure, accepted)) return false;
  return !cause ||
         structure.gain - cause->gain > std::max(kRules.structure_lead.value, kRules.structure_margin * cause->gain);
}

/// A constant of which more than half as much again varies along a regressor is the structure's mean.
void drop_means_of(const std::vector<DesignColumn>& structure, double gain, std::vector<Accepted>& accepted) {
  std::erase_if(accepted, [&](const Accepted& a) {
    return a.form->constant && gain > kRules.left_of_constant * a.gain && share_a_channel(structure, a.columns);
  });
}

/// What reaches farther than its cause can, all of its interval, is told as a structure in its place. False: it may be
/// the cause.
bool reaches_too_far(const Accepted& a, CauseSearchResult& result) {
  if (!a.form->reach || a.parameters.empty() || a.parameters.back().low <= a.form->reach->most) return false;
  const Reach& reach = *a.form->reach;
  result.refused.push_back(
      {a.form->cause(), a.form->formula, a.form->scale_name, a.scale.value, 0, reach.most, reach.reason});
  SearchCandidate as_structure;
  as_structure.name = reach.regressor;
  as_structure.columns = a.columns;
  as_structure.gain = a.gain;
  as_structure.structure.shape = a.form->formula;
  result.unknown.push_back(told(as_structure, a.p));
  drop_means_of(a.columns, a.gain, result.accepted);
  return true;
}

/// What came out beyond its law's ends, once averaged over the shapes, is refused; no interval holds it.
void keep_within_ends(CauseSearchResult& result) {
  std::erase_if(result.accepted, [&](Accepted& a) {
    const auto& priors = a.form->priors;
    for (std::size_t k = 0; k < priors.size() && !a.form->displaces_map && k < a.parameters.size(); ++k) {
      Estimate& e = a.parameters[k];
      if (!priors[k].holds(e.value)) {
        result.refused.push_back(refused(*a.form, k, e.value));
        return true;
      }
      e.low = std::max(e.low, priors[k].least);
      e.high = std::min(e.high, priors[k].most);
    }
    return false;
  });
  std::vector<Refused> once;  // what was accepted in another form or scale is no refusal
  for (const Refused& r : result.refused)
    if (std::none_of(once.begin(), once.end(), [&](auto& o) { return o.name == r.name; }) &&
        std::none_of(result.accepted.begin(), result.accepted.end(),
                     [&](auto& a) { return a.form->cause() == r.name; }))
      once.push_back(r);
  result.refused = std::move(once);
}

}  // namespace

double prior_nats_of(const Accepted& a) {
  return a.form->prior_nats({a.theta.data(), static_cast<std::size_t>(a.theta.size())});
}

CauseSearchResult search(const Evidence& start, const CauseSearchOptions& options) {
  CauseSearchResult result;
  Evidence evidence = start;
  const auto draws = sign_draws(evidence.seen().units.size(), options.flips, options.seed);
  while (result.accepted.size() < options.most_causes) {
    const auto accepted = columns_of(result.accepted, evidence.seen());
    evidence.whiten(accepted);
    options.progress("looking at every cause, step " + std::to_string(result.accepted.size() + 1));
    const SearchStep step(evidence, accepted, draws,
                          options.accept_p * (result.accepted.empty() ? 1 : kRules.further_level.value));
    if (step.named.empty() && step.structures.empty()) break;
    result.threshold = step.threshold;
    result.structure_threshold = step.structure_threshold;
    const Beside beside{evidence, result.accepted, accepted, options.known};
    const auto cause = best_of(step.named, beside, step.threshold);
    const auto structure = best_of(step.structures, beside, step.structure_threshold);
    if (const auto no = beyond_its_law(step.named, beside, step.threshold, cause ? cause->gain : 0))
      result.refused.push_back(*no);
    if (structure && leads(*structure, cause, result.accepted)) {
      drop_means_of(structure->columns, structure->gain, result.accepted);
      const double p = p_value(step.null_structures, structure->gain) / kRules.structure_share;
      result.unknown.push_back(told(with_harmonics(*structure, evidence, accepted), p));
      break;
    }
    if (!cause) break;
    const double p = p_value(step.null_named, cause->gain) / SearchStep::named_share();
    Accepted a{cause->form, cause->scale, cause->columns, {}, p, cause->gain, {}, {}};
    refine(evidence, a, accepted);
    if (reaches_too_far(a, result)) break;
    result.accepted.push_back(std::move(a));
  }
  evidence.whiten(columns_of(result.accepted, evidence.seen()));
  settle(evidence, result.accepted, result.threshold);
  for (const Accepted& a : std::exchange(result.accepted, {}))  // all estimates are settled now
    if (!reaches_too_far(a, result)) result.accepted.push_back(a);
  keep_within_ends(result);
  for (std::size_t i = 0; i < result.accepted.size(); ++i) find_rivals(evidence, result.accepted, i, result.threshold);
  return result;
}

}  // namespace backwash::study
