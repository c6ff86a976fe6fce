// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

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

std::vector<Column> nuisance_of(const Form& form, const std::vector<Column>& columns,
                                const std::vector<Column>& accepted, const Observations& seen) {
  std::vector<Column> nuisance = form.constant ? std::vector<Column>{} : offsets(columns, seen);
  nuisance.insert(nuisance.end(), accepted.begin(), accepted.end());
  return nuisance;
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

/// Gain that a smooth needs beside the accepted causes.
double needed_structure(const Candidate& smooth, const std::vector<Accepted>& accepted) {
  double needed = 0;
  for (const auto& a : accepted)
    if (share_a_channel(smooth.columns, a.columns))
      needed = std::max(needed, (a.form->constant ? kRules.left_of_constant : kRules.left_share) * a.gain);
  return needed;
}

std::vector<double> null_maxima(const std::vector<Candidate>& all, const std::vector<std::vector<int>>& draws) {
  std::vector<double> maxima;
  for (const auto& signs : draws) {
    double most = 0;
    for (const auto& candidate : all) {
      const double gain = candidate.normal.gain(signs);
      if (gain > most && candidate.effect(candidate.normal.fit(signs))) most = gain;
    }
    maxima.push_back(most);
  }
  std::sort(maxima.begin(), maxima.end());
  return maxima;
}

double p_value(const std::vector<double>& sorted_null, double gain) {
  const auto above = sorted_null.end() - std::lower_bound(sorted_null.begin(), sorted_null.end(), gain);
  return (1.0 + static_cast<double>(above)) / (1.0 + static_cast<double>(sorted_null.size()));
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

}  // namespace

bool Candidate::effect(const SmallVector& theta) const {
  const auto floor_of_smooth = [&] {
    return columns.front().parts.front().channel == kVarX ? kRules.smooth_floor_ln : kRules.smooth_floor_mean;
  };
  if (!form) return theta.dot(size * theta) >= std::pow(floor_of_smooth().value, 2);
  if (std::abs(theta[0]) < form->least || (form->one_sided && theta[0] < 0)) return false;
  const double square =
      form->integer_scale && form->one_sided ? theta[0] * theta[0] * size(0, 0) : theta.dot(size * theta);
  return square >= form->floor * form->floor;
}

std::vector<std::vector<int>> sign_draws(std::size_t flights, int flips, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::vector<std::vector<int>> draws(static_cast<std::size_t>(flips), std::vector<int>(flights));
  for (auto& signs : draws)
    for (int& s : signs) s = (rng() >> 33) & 1 ? 1 : -1;
  return draws;
}

std::vector<Candidate> candidates(const Evidence& evidence, const std::vector<Column>& accepted, bool smooths) {
  std::vector<Candidate> all;
  const Observations& seen = evidence.seen();
  const auto add = [&](Candidate c, const std::vector<Column>& nuisance) {
    c.normal = evidence.normal(c.columns, nuisance);
    if (!c.normal.solvable) return;
    c.gain = c.normal.gain();
    c.size = evidence.size(c.columns);
    all.push_back(std::move(c));
  };
  for (const Form* each : catalogue()) {
    const Form& form = *each;
    if (why_not_tested(form, seen)) continue;
    for (const Scale& scale : form.scales) {
      Candidate c{&form, form.cause(), scale, form.columns(seen.windows, scale), {}, 0, {}};
      const auto nuisance = nuisance_of(form, c.columns, accepted, seen);
      add(std::move(c), nuisance);
    }
  }
  if (!smooths) return all;
  for (const auto& along : regressors(seen)) {
    for (const auto& [name, channels] : channel_groups()) {
      Candidate c;
      c.name = along.name;
      c.columns = smooth_columns(along, seen.windows, channels);
      auto nuisance = offsets(c.columns, seen);
      nuisance.insert(nuisance.end(), accepted.begin(), accepted.end());
      add(std::move(c), nuisance);
    }
  }
  return all;
}

SearchResult search(const Evidence& start, const SearchOptions& options) {
  SearchResult result;
  Evidence evidence = start;
  const auto draws = sign_draws(evidence.seen().units.size(), options.flips, options.seed);
  while (result.accepted.size() < options.most_causes) {
    const auto accepted = columns_of(result.accepted, evidence.seen());
    evidence.whiten(accepted);
    options.progress("looking at every cause, step " + std::to_string(result.accepted.size() + 1));
    auto all = candidates(evidence, accepted, true);
    if (all.empty()) break;
    result.null_gain = null_maxima(all, draws);
    const double level = options.accept_p * (result.accepted.empty() ? 1 : kRules.further_level.value);
    const auto index = static_cast<std::size_t>((1 - level) * static_cast<double>(draws.size()));
    result.threshold = std::max(kRules.least_threshold.value, result.null_gain[std::min(index, draws.size() - 1)]);

    const Candidate *cause = nullptr, *smooth = nullptr;
    for (const auto& c : all) {
      const bool known = std::any_of(result.accepted.begin(), result.accepted.end(),
                                     [&](auto& a) { return c.form && a.form->effect == c.form->effect; });
      if (known) continue;
      if (c.gain < needed_gain(c, result.accepted, result.threshold) || !c.effect(c.normal.fit())) continue;
      if (c.form && !excludes_zero(c.normal, c.columns)) continue;
      if (!c.form && (!smooth || c.gain > smooth->gain)) smooth = &c;
      if (c.form && (!cause || c.gain > cause->gain)) cause = &c;
    }
    if (smooth && smooth->gain >= needed_structure(*smooth, result.accepted) &&
        (!cause ||
         smooth->gain - cause->gain > std::max(kRules.smooth_lead.value, kRules.smooth_share * cause->gain))) {
      const auto group = std::find_if(channel_groups().begin(), channel_groups().end(), [&](auto& g) {
        return g.second.front() == smooth->columns.front().parts.front().channel;
      });
      // A constant of which more than half as much again varies along a regressor is the structure's mean.
      std::erase_if(result.accepted,
                    [&](const Accepted& a) { return a.form->constant && share_a_channel(smooth->columns, a.columns); });
      result.unknown.push_back({smooth->name, group->first, p_value(result.null_gain, smooth->gain), smooth->gain});
      break;
    }
    if (!cause) break;
    Accepted a{cause->form, cause->scale, cause->columns, {}, p_value(result.null_gain, cause->gain), cause->gain, {},
               {}};
    refine(evidence, a, accepted);
    result.accepted.push_back(std::move(a));
  }
  evidence.whiten(columns_of(result.accepted, evidence.seen()));
  settle(evidence, result.accepted, result.threshold);
  for (std::size_t i = 0; i < result.accepted.size(); ++i) find_rivals(evidence, result.accepted, i, result.threshold);
  return result;
}

}  // namespace backwash::study
