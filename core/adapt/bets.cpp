// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/bets.hpp"

#include <algorithm>

namespace backwash::adapt {
namespace {

constexpr double kNearly = 0.9;  // of a block: groups end on samples
constexpr double kFull = 1e200;  // a detector says no more

/// Mean over the axes of the squared innovation over its largest expectation under the factor v.
double excess(const Innovation& i, double v) noexcept {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) sum += std::min(kMostSquare, i.square[axis] / (v * i.most + i.beside[axis]));
  return sum / 3;
}

/// The same over its smallest expectation: no noise, no steady push.
double shortfall(const Innovation& i, double v) noexcept {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) sum += std::min(kMostSquare, i.square[axis] / (v * i.least));
  return sum / 3;
}

template <std::size_t n>
double mean_value(const std::array<Wealth, n>& bets) noexcept {
  double sum = 0;
  for (const Wealth& bet : bets) sum += bet.value();
  return sum / n;
}

}  // namespace

void Bets::bet_rougher(const Innovation& innovation, bool ends) noexcept {
  for (std::size_t k = 0; k < kRougher.size(); ++k) {
    square_[k] += excess(innovation, kRougher[k]);
    if (!ends) continue;
    const double x = square_[k] / in_block_;
    square_[k] = 0;
    double change = 0;
    for (std::size_t j = 0; j < kStakes.size(); ++j) {
      const double factor = 1 + kStakes[j] * (x - 1);
      rougher_[k][j].times(factor);
      since_[k][j] = std::min(kFull, (since_[k][j] + block_s_) * factor);
      change += since_[k][j] / kStakes.size();
    }
    const double value = mean_value(rougher_[k]);
    if (k == 0) highest_ = std::max(highest_, value), highest_change_ = std::max(highest_change_, change);
    if (k == above_ && (value >= refuted_ || change >= kRunLength)) ++above_;
  }
}

void Bets::bet_calmer(const Innovation& innovation, bool ends) noexcept {
  for (std::size_t k = 0; k < kCalmer.size(); ++k) {
    calm_square_[k] += shortfall(innovation, kCalmer[k]);
    if (!ends) continue;
    const double x = calm_square_[k] / in_block_;
    calm_square_[k] = 0;
    for (std::size_t j = 0; j < kCalmStakes.size(); ++j)
      calmer_[k][j].times(1 + kCalmStakes[j] / (kMostSquare - 1 + kBeyond) * (1 - kBeyond - x));
    if (k == below_ && mean_value(calmer_[k]) >= refuted_) ++below_;
  }
}

void Bets::add(const Innovation& innovation) noexcept {
  seconds_ += innovation.seconds, block_s_ += innovation.seconds, ++in_block_;
  const bool ends = block_s_ > kNearly * innovation.block_s;
  bet_rougher(innovation, ends);
  bet_calmer(innovation, ends);
  if (ends) in_block_ = 0, block_s_ = 0;
}

std::optional<double> Bets::above() const noexcept {
  return above_ > 0 ? std::optional(kRougher[above_ - 1]) : std::nullopt;
}

std::optional<double> Bets::below() const noexcept {
  return below_ > 0 && seconds_ >= kLeastCalm ? std::optional(kCalmer[below_ - 1]) : std::nullopt;
}

}  // namespace backwash::adapt
