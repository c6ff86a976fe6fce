// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/study/windows/signals/series.hpp"
#include "core/study/windows/signals/signals.hpp"
#include "core/study/windows/stretch.hpp"

namespace backwash::study {

/// Mean of value(i) over a window; `sum`: zero.
template <typename T, typename F>
T mean_over(SampleRange w, T sum, F value) {
  for (std::size_t i = w.begin; i < w.end; ++i) sum += value(i) / static_cast<double>(w.size());
  return sum;
}

template <typename F>
std::vector<double> detrended_values(SampleRange w, F value) {
  std::vector<double> x;
  for (std::size_t i = w.begin; i < w.end; ++i) x.push_back(value(i));
  return detrended(x);
}

/// Slope over the neighbours.
template <typename F>
std::vector<double> rates(const Series& s, SampleRange w, F value) {
  std::vector<double> x;
  for (std::size_t i = w.begin; i < w.end; ++i) {
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, s.size() - 1);
    x.push_back((value(b) - value(a)) / (s.t[b] - s.t[a]));
  }
  return detrended(x);
}

/// Weight of a sample in the bell about another one, not normalised.
inline double bell(const Series& s, std::size_t about, std::size_t at, double width) {
  const double away = (s.t[at] - s.t[about]) / width;
  return std::exp(-0.5 * away * away);
}
/// z weighted by a bell of standard deviation `width` in s over the window's own rows, detrended: what is slow in it.
std::vector<double> slow(const Series& s, SampleRange w, const std::vector<double>& z, double width);

/// Σ z·y and Σ z·x of detrended z over √Σz²: one row of an instrumental regression; nothing without excitation.
struct Moment {
  double y = 0, square = 0;
  std::vector<double> z;
  explicit Moment(std::vector<double> instrument) : z(std::move(instrument)) {
    for (const double v : z) square += v * v;
  }
  double with(const std::vector<double>& x) const {
    double sum = 0;
    for (std::size_t i = 0; i < z.size(); ++i) sum += z[i] * x[i];
    return sum / std::sqrt(square);
  }
  /// The same of a course given at n points in the middles of n equal parts, joined by lines: weight of each point.
  template <std::size_t n>
  std::array<double, n> at_points() const {
    std::array<double, n> weight{};
    for (std::size_t i = 0; i < z.size(); ++i) {
      const double q = (static_cast<double>(i) + 0.5) / static_cast<double>(z.size()) * n - 0.5;
      const double at = std::clamp(q, 0.0, n - 1.0);
      const std::size_t k = std::min(static_cast<std::size_t>(at), n - 2);
      const double share = at - static_cast<double>(k);
      weight[k] += (1 - share) * z[i] / std::sqrt(square);
      weight[k + 1] += share * z[i] / std::sqrt(square);
    }
    return weight;
  }
  bool excited(double least_rms) const { return square > least_rms * least_rms * static_cast<double>(z.size()); }
};

/// First stage of the thrust's instrumental regression: how the commanded thrust T/m − g and the rate ȧ of the
/// acceleration along it follow z, the set-points' own vertical acceleration and its rate. In a closed loop neither is
/// the nominal one: the feedback commands less of a steeper thrust, and earlier of a late one. Sums of z zᵀ and
/// z (T/m, ȧ) over all windows, in which the gusts' part averages out.
struct FirstStage {
  Eigen::Matrix2d instruments = Eigen::Matrix2d::Zero(), followed = Eigen::Matrix2d::Zero();
  void add(const std::array<std::vector<double>, 2>& z, const std::array<std::vector<double>, 2>& thrust);
  void add(const FirstStage& other) {
    instruments += other.instruments;
    followed += other.followed;
  }
  /// Columns: T/m − g and ȧ as combinations of z = (level, rate); the nominal itself where nothing was excited.
  Eigen::Matrix2d coefficients() const;
};

/// A delay of set-points by τ makes a difference a(t − τ) − a(t) that is proportional to τ only while it is short
/// against what the set-points do (at 0.06 s, 13 % less). So the design is the difference per second at the delay that
/// the windows together show: its fixed point τ = Σ g(τ) y/Σ g(τ)².
class DelayStage {
 public:
  using PerSecond = std::array<double, kShifts.size()>;  ///< design at each shift; at 0 its limit
  struct Seen {
    std::size_t window;
    double y;
    PerSecond design;
  };
  void add(std::size_t window, double y, const PerSecond& design) { seen_.push_back({window, y, design}); }
  /// What another one was given, its windows counted from `first`.
  void add(const DelayStage& other, std::size_t first) {
    for (const auto& w : other.seen_) seen_.push_back({first + w.window, w.y, w.design});
  }
  const std::vector<Seen>& seen() const noexcept { return seen_; }
  /// Window and design at the fixed point.
  std::vector<std::pair<std::size_t, double>> designs() const;

 private:
  std::vector<Seen> seen_;
};

}  // namespace backwash::study
