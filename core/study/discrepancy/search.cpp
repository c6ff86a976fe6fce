// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/discrepancy/search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/study/discrepancy/estimate.hpp"

namespace backwash::study::discrepancy {
namespace {

/// Nats by which a smooth must beat the best cause, and the share of the cause's own gain.
constexpr double kSmoothLead = 3, kSmoothShare = 0.6;
/// A further cause explains at least this share of the first one's gain: less repairs the first one's form.
constexpr double kLeastShare = 0.08;
constexpr double kRepairShare = 0.25;
/// And a smooth left over after a cause at least this share: less is the cause's form.
constexpr double kLeftShare = 0.3;
constexpr double kRivalNats = 3, kRivalErrors = 2;

const std::vector<std::pair<std::string, std::vector<Channel>>>& groups() {
  static const std::vector<std::pair<std::string, std::vector<Channel>>> all = {
      {"mean x, y", {kMeanX, kMeanY}}, {"mean z", {kMeanZ}}, {"ln variance", {kVarX, kVarY, kVarZ}}};
  return all;
}

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

/// Gain that a further cause needs: a share of the first one's, a larger one where it repairs the form of an accepted
/// cause in the same moments of the thrust's or the commands' delay.
double needed_gain(const Candidate& candidate, const std::vector<Accepted>& accepted, double threshold) {
  double needed = threshold;
  for (const auto& a : accepted) {
    const auto dynamic = [](const std::vector<Column>& columns) {
      const Channel c = columns.front().parts.front().channel;
      return c >= kThrustDelay && c <= kCommandDelayZ;
    };
    const double share = dynamic(a.columns) && dynamic(candidate.columns) ? kRepairShare : kLeastShare;
    needed = std::max(needed, share * a.gain);
  }
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
  for (const Form& form : catalogue()) {
    if (form.cause == own.form->cause || why_not_tested(form, evidence.seen())) continue;
    if (std::any_of(accepted.begin(), accepted.end(), [&](auto& a) { return a.form->cause == form.cause; })) continue;
    for (const double scale : form.scales) {
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
      if (!theirs.solvable || !ours.solvable || theirs.gain() < std::min(threshold, 0.5 * ours.gain())) continue;
      const Candidate rival{&form, form.cause, scale, {}, {}, 0, evidence.size(columns)};
      if (!rival.effect(theirs.fit())) continue;
      // Two causes that explain different data are two causes, not rivals: a rival gains less once ours is known.
      std::vector<Column> with_ours = nuisance;
      with_ours.insert(with_ours.end(), own.columns.begin(), own.columns.end());
      const Normal rest = evidence.normal(columns, with_ours);
      if (rest.solvable && rest.gain() > 0.5 * theirs.gain()) continue;
      const auto [lead, error] = difference(ours, theirs);
      // Motor commands alone do not tell a damaged rotor from a weight near it, whichever fits better: only the line of
      // its rate does.
      const auto motors_alone = [](const Form& f) {
        return (f.cause == "propeller_damage" && f.parameters.size() == 1) || (f.cause == "payload" && f.integer_scale);
      };
      if (motors_alone(*own.form) && motors_alone(form)) {
        found.push_back({form.cause, &form, scale, lead});
        continue;
      }
      if (lead > kRivalNats && lead > kRivalErrors * error) continue;
      if (lead > 4 * kRivalNats) continue;
      found.push_back({form.cause, &form, scale, lead});
    }
  }
  std::sort(found.begin(), found.end(), [](auto& a, auto& b) { return a.behind_nats < b.behind_nats; });
  for (const auto& rival : found)
    if (std::none_of(own.rivals.begin(), own.rivals.end(), [&](auto& r) { return r.name == rival.name; }))
      own.rivals.push_back(rival);
}

/// A constant of which the structure left over explains more than half as much again is the structure's mean.
void drop_its_mean(std::vector<Accepted>& accepted, const Candidate& smooth) {
  std::array<bool, kChannels> moved{};
  for (const auto& column : smooth.columns) moved[column.parts.front().channel] = true;
  std::erase_if(accepted, [&](const Accepted& a) {
    return a.form->constant && moved[a.columns.front().parts.front().channel] && smooth.gain > 0.5 * a.gain;
  });
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
  // Least root mean square of a smooth: as in the catalogue, m/s² and ln variance.
  if (!form) return theta.dot(size * theta) >= std::pow(columns.front().parts.front().channel == kVarX ? 0.2 : 0.03, 2);
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
  for (const Form& form : catalogue()) {
    if (why_not_tested(form, seen)) continue;
    for (const double scale : form.scales) {
      Candidate c{&form, form.cause, scale, form.columns(seen.windows, scale), {}, 0, {}};
      const auto nuisance = nuisance_of(form, c.columns, accepted, seen);
      add(std::move(c), nuisance);
    }
  }
  if (!smooths) return all;
  for (const auto& along : regressors(seen)) {
    for (const auto& [name, channels] : groups()) {
      Candidate c{nullptr, along.name, 0, smooth_columns(along, seen.windows, channels), {}, 0, {}};
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
  const auto draws = sign_draws(evidence.seen().first.size() - 1, options.flips, options.seed);
  double first_gain = 0;
  while (result.accepted.size() < options.most_causes) {
    const auto accepted = columns_of(result.accepted, evidence.seen());
    evidence.whiten(accepted);
    options.progress("looking at every cause, step " + std::to_string(result.accepted.size() + 1));
    auto all = candidates(evidence, accepted, true);
    if (all.empty()) break;
    result.null_gain = null_maxima(all, draws);
    const auto index = static_cast<std::size_t>((1 - options.accept_p) * static_cast<double>(draws.size()));
    result.threshold = std::max(0.5, result.null_gain[std::min(index, draws.size() - 1)]);

    const Candidate *cause = nullptr, *smooth = nullptr;
    for (const auto& c : all) {
      const bool known = std::any_of(result.accepted.begin(), result.accepted.end(),
                                     [&](auto& a) { return c.form && a.form->cause == c.name; });
      if (known) continue;
      if (c.gain < needed_gain(c, result.accepted, result.threshold) || !c.effect(c.normal.fit())) continue;
      if (!c.form && (!smooth || c.gain > smooth->gain)) smooth = &c;
      if (c.form && (!cause || c.gain > cause->gain)) cause = &c;
    }
    if (smooth && smooth->gain >= std::max(result.threshold, kLeftShare * first_gain) &&
        (!cause || smooth->gain - cause->gain > std::max(kSmoothLead, kSmoothShare * cause->gain))) {
      const auto group = std::find_if(groups().begin(), groups().end(), [&](auto& g) {
        return g.second.front() == smooth->columns.front().parts.front().channel;
      });
      drop_its_mean(result.accepted, *smooth);
      result.unknown.push_back({smooth->name, group->first, p_value(result.null_gain, smooth->gain), smooth->gain});
      break;
    }
    if (!cause) break;
    first_gain = std::max(first_gain, cause->gain);
    Accepted a{cause->form, cause->scale, cause->columns, {}, p_value(result.null_gain, cause->gain), cause->gain, {},
               {}};
    refine(evidence, a, accepted);
    if (!excludes_zero(a)) break;
    result.accepted.push_back(std::move(a));
  }
  evidence.whiten(columns_of(result.accepted, evidence.seen()));
  settle(evidence, result.accepted, result.threshold);
  for (std::size_t i = 0; i < result.accepted.size(); ++i) find_rivals(evidence, result.accepted, i, result.threshold);
  return result;
}

}  // namespace backwash::study::discrepancy
