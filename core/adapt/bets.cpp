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
  for (int axis = 0; axis < 3; ++axis) sum += std::min(Bets::kMostCalm, i.square[axis] / (v * i.least));
  return sum / 3;
}

template <std::size_t n>
double mean_value(const std::array<Wealth, n>& bets) noexcept {
  double sum = 0;
  for (const Wealth& bet : bets) sum += bet.value();
  return sum / n;
}

}  // namespace

double Bets::detect(Detector& since, double x, double seconds) noexcept {
  double mean = 0;
  for (std::size_t j = 0; j < kStakes.size(); ++j) {
    since[j] = std::min(kFull, (since[j] + seconds) * (1 + kStakes[j] * (x - 1)));
    mean += since[j] / kStakes.size();
  }
  return mean;
}

void Bets::bet_watched(const Innovation& innovation, bool ends) noexcept {
  watched_square_ += excess(innovation, watched_);
  if (!ends) return;
  rose_ = rose_ || detect(watch_, watched_square_ / in_block_, block_s_) >= kReturnLength;
  watched_square_ = 0;
}

void Bets::bet_rougher(const Innovation& innovation, bool ends) noexcept {
  for (std::size_t k = 0; k < kRougher.size(); ++k) {
    square_[k] += excess(innovation, kRougher[k]);
    if (!ends) continue;
    const double x = square_[k] / in_block_;
    square_[k] = 0;
    for (std::size_t j = 0; j < kStakes.size(); ++j) rougher_[k][j].times(1 + kStakes[j] * (x - 1));
    const double change = detect(since_[k], x, block_s_);
    const double value = mean_value(rougher_[k]);
    if (k == 0) highest_ = std::max(highest_, value), highest_change_ = std::max(highest_change_, change);
    if (k == above_ && (value >= refuted_ || change >= kRunLength)) ++above_;
  }
}

bool Bets::add_pair(const Innovation& pair) noexcept {
  const std::size_t before = below_;
  for (std::size_t k = 0; k < kCalmer.size(); ++k) {
    const double x = shortfall(pair, kCalmer[k]);
    for (std::size_t j = 0; j < kCalmStakes.size(); ++j)
      calmer_[k][j].times(1 + kCalmStakes[j] / (kMostCalm - 1 + kBeyond) * (1 - kBeyond - x));
    if (k == below_ && mean_value(calmer_[k]) >= refuted_) ++below_;
  }
  if (!(watched_ > 0)) return below_ != before;
  const bool risen = detect(pair_watch_, excess(pair, watched_), pair.seconds) >= kReturnLength;
  const bool rises = risen && !rose_;
  rose_ = rose_ || risen;
  return rises || below_ != before;
}

void Bets::forget_calmer() noexcept {
  calmer_ = {}, below_ = 0, calm_from_ = seconds_;
  watched_ = 0, rose_ = false;
}

void Bets::add(const Innovation& innovation) noexcept {
  seconds_ += innovation.seconds, block_s_ += innovation.seconds, ++in_block_;
  const bool ends = block_s_ > kNearly * innovation.block_s;
  bet_rougher(innovation, ends);
  if (watched_ > 0) bet_watched(innovation, ends);
  if (ends) in_block_ = 0, block_s_ = 0;
}

std::optional<double> Bets::above() const noexcept {
  return above_ > 0 ? std::optional(kRougher[above_ - 1]) : std::nullopt;
}

std::optional<double> Bets::below() const noexcept {
  return below_ > 0 && seconds_ - calm_from_ >= kLeastCalm ? std::optional(kCalmer[below_ - 1]) : std::nullopt;
}

}  // namespace backwash::adapt
