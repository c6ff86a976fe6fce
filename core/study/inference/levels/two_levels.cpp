// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/levels/two_levels.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/study/inference/rules.hpp"
#include "core/study/windows/signals/distributions.hpp"

namespace backwash::study {
namespace {

constexpr auto kFewestASide = static_cast<std::size_t>(kRules.fewest_a_side.value);

/// Sums of values on one side of a division.
struct Side {
  double n = 0, sum = 0, square = 0;
  void add(double x) {
    n += 1;
    sum += x;
    square += x * x;
  }
  double scatter() const { return square - sum * sum / n; }
};

/// Tries divisions and keeps the one of least p.
class Divisions {
 public:
  Divisions(const std::vector<double>& values, double least_spread) : values_(values), least_(least_spread) {}

  /// Divisions of another kind. `tried`: how many there are; `lost`: degrees of freedom.
  void begin(double tried, double lost) {
    tried_ = tried;
    lost_ = lost;
    clearest_ = -1;
  }

  /// `off`: sum of the `count` values that are called high, all values taken about their mean. Of one kind, t rises
  /// with off²/(count (n − count)): what is less clear by that than an earlier one has no less p, and most are.
  template <typename High>
  void offer(double off, std::size_t count, High high) {
    const double n = static_cast<double>(values_.size()), k = static_cast<double>(count);
    if (count == values_.size()) return look(high);  // all of one value
    const double clear = off * off / (k * (n - k));
    if (clear <= clearest_ * (1 - kRules.bound_error)) return;
    clearest_ = std::max(clearest_, clear);
    look(high);
  }

  const std::optional<TwoLevels>& best() const { return best_; }

 private:
  template <typename High>
  void look(High high) {
    Side sides[2];
    for (std::size_t f = 0; f < values_.size(); ++f) sides[high(f) ? 1 : 0].add(values_[f]);
    const double n = static_cast<double>(values_.size()),
                 between = sides[1].sum / sides[1].n - sides[0].sum / sides[0].n;
    const double spread = std::max(least_, std::sqrt(std::max(0.0, sides[0].scatter() + sides[1].scatter()) / (n - 2)));
    const double t = std::abs(between) / (spread * std::sqrt(1 / sides[0].n + 1 / sides[1].n));
    const double p = std::min(1.0, kRules.division_kinds * tried_ * 2 * student_tail(t, n - lost_));
    if (best_ && p >= best_->p) return;
    best_ = TwoLevels{{}, p, spread};
    for (std::size_t f = 0; f < values_.size(); ++f) best_->high.push_back(high(f) == (between > 0));
  }

  const std::vector<double>& values_;
  double least_, tried_ = 0, lost_ = 0, clearest_ = -1;
  std::optional<TwoLevels> best_;
};

/// Sums of the first 0, 1, … values about their mean.
std::vector<double> sums_off_mean(const std::vector<double>& values) {
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  std::vector<double> sums{0};
  for (const double x : values) sums.push_back(sums.back() + (x - mean));
  return sums;
}

}  // namespace

std::optional<TwoLevels> two_levels(const std::vector<double>& values, double least_spread) {
  const std::size_t n = values.size();
  if (static_cast<double>(n) < kRules.fewest_divided) return std::nullopt;
  const double flights = static_cast<double>(n);
  const auto sum = sums_off_mean(values);
  Divisions divisions(values, least_spread);
  divisions.begin(flights - 1, 2);
  for (std::size_t a = kFewestASide; a + kFewestASide <= n; ++a)
    divisions.offer(sum[n] - sum[a], n - a, [a](std::size_t f) { return f >= a; });
  divisions.begin((flights - 1) * (flights - 2) / 2, 2);
  for (std::size_t a = 1; a + 1 < n; ++a)
    for (std::size_t b = a + kFewestASide; b < n; ++b)
      divisions.offer(sum[b] - sum[a], b - a, [a, b](std::size_t f) { return f >= a && f < b; });
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const auto sorted_sum = sums_off_mean(sorted);
  divisions.begin(std::exp2(flights - 1), 2 + kRules.level_scatter);
  for (std::size_t k = kFewestASide; k + kFewestASide <= n; ++k) {
    const auto first =
        static_cast<std::size_t>(std::lower_bound(sorted.begin(), sorted.end(), sorted[k]) - sorted.begin());
    divisions.offer(sorted_sum[n] - sorted_sum[first], n - first,
                    [&](std::size_t f) { return values[f] >= sorted[k]; });
  }
  return divisions.best();
}

Level level(const AmplitudeCourse& course, std::size_t begin, std::size_t end) {
  Level l;
  for (std::size_t i = begin; i < end; ++i) {
    l.value += course.weight[i] * course.value[i];
    l.weight += course.weight[i];
  }
  if (l.weight > 0) l.value /= l.weight;
  return l;
}

std::optional<Step> largest_step(const AmplitudeCourse& course, std::size_t fewest) {
  const std::size_t n = course.value.size();
  std::optional<Step> best;
  for (std::size_t at = fewest; at + fewest <= n; ++at) {
    const Level before = level(course, 0, at), after = level(course, at, n);
    if (!(before.weight > 0) || !(after.weight > 0)) continue;
    const double size = after.value - before.value;
    const double t = std::abs(size) / std::sqrt(1 / before.weight + 1 / after.weight);
    if (!best || t > best->t) best = {at, size, t};
  }
  return best;
}

double inflation(const AmplitudeCourse& course, std::size_t lags) {
  const std::size_t n = course.value.size();
  const double mean = level(course, 0, n).value;
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = std::sqrt(course.weight[i]) * (course.value[i] - mean);
  const double square = std::inner_product(x.begin(), x.end(), x.begin(), 0.0);
  double sum = 1;
  for (std::size_t k = 1; k <= lags && k < n && square > 0; ++k)
    sum += 2 * std::inner_product(x.begin() + static_cast<std::ptrdiff_t>(k), x.end(), x.begin(), 0.0) / square;
  return std::max(1.0, sum);
}

namespace {

/// ln likelihood of windows about `low`, `high` in [begin, end), the flight's own offset integrated out.
double likelihood(const AmplitudeCourse& course, double low, double high, double between, Acting a) {
  double square = 0, sum = 0, weight = 0;
  for (std::size_t i = 0; i < course.value.size(); ++i) {
    const double rest = course.value[i] - (i >= a.begin && i < a.end ? high : low), w = course.weight[i];
    square += w * rest * rest;
    sum += w * rest;
    weight += w;
  }
  return -0.5 * (square - between * sum * sum / (1 + between * weight));
}

}  // namespace

Acting acting(const AmplitudeCourse& course, double low, double high, double between, double price,
              std::size_t fewest) {
  const std::size_t n = course.value.size();
  Acting best{0, 0};
  double most = likelihood(course, low, high, between, best);
  const auto offer = [&](Acting a, double cost) {
    const double nats = likelihood(course, low, high, between, a) - cost;
    if (nats > most) {
      most = nats;
      best = a;
    }
  };
  offer({0, n}, 0);
  for (std::size_t at = fewest; at + fewest <= n; ++at) {
    offer({at, n}, price);
    offer({0, at}, price);
  }
  return best;
}

}  // namespace backwash::study
