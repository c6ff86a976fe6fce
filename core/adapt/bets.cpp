// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/bets.hpp"

namespace backwash::adapt {
namespace {

constexpr double kFull = 1e200;  // a detector says no more

/// Largest expectation of the square under the factor v, m².
double most(const ErrorSquare& e, int axis, double v) noexcept {
  return v * e.promised[axis] + e.noise[axis] + e.granted[axis];
}

/// Over the smallest expectation: no noise, no steady push.
double shortfall(const ErrorSquare& e, double v) noexcept {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis)
    sum += std::min(Bets::kMostCalm, e.square[axis] / (v * e.least * e.promised[axis]));
  return sum / 3;
}

template <std::size_t n>
double mean_value(const std::array<Wealth, n>& bets) noexcept {
  double sum = 0;
  for (const Wealth& bet : bets) sum += bet.value();
  return sum / n;
}

}  // namespace

double excess(const ErrorSquare& e, double v) noexcept {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) sum += std::min(kMostSquare, e.square[axis] / most(e, axis, v));
  return sum / 3;
}

double Bets::detect(Detector& since, double x, double seconds) noexcept {
  double mean = 0;
  for (std::size_t j = 0; j < kStakes.size(); ++j) {
    since[j] = std::min(kFull, (since[j] + seconds) * (1 + kStakes[j] * (x - 1)));
    mean += since[j] / kStakes.size();
  }
  return mean;
}

void Bets::bet_rougher(const ErrorSquare& error) noexcept {
  for (std::size_t k = 0; k < kRougher.size(); ++k) {
    const double x = excess(error, kRougher[k]);
    for (std::size_t j = 0; j < kStakes.size(); ++j) rougher_[k][j].times(1 + kStakes[j] * (x - 1));
    const double change = detect(since_[k], x, error.seconds), value = mean_value(rougher_[k]);
    if (k == 0) {
      highest_ = std::max(highest_, value);
      highest_change_ = std::max(highest_change_, change);
    }
    if (k == above_ && (value >= refuted_ || change >= kRunLength)) ++above_;
  }
}

void Bets::bet_calmer(const ErrorSquare& error) noexcept {
  for (std::size_t k = 0; k < kCalmer.size(); ++k) {
    const double x = shortfall(error, kCalmer[k]);
    for (std::size_t j = 0; j < kCalmStakes.size(); ++j)
      calmer_[k][j].times(1 + kCalmStakes[j] / (kMostCalm - 1 + kBeyond) * (1 - kBeyond - x));
    if (k == below_ && mean_value(calmer_[k]) >= refuted_) ++below_;
  }
  if (watched_ > 0) rose_ = detect(watch_, excess(error, watched_), error.seconds) >= kReturnLength || rose_;
}

void Bets::forget_calmer() noexcept {
  calmer_ = {};
  below_ = 0;
  calm_from_ = seconds_;
  watched_ = 0;
  rose_ = false;
}

bool Bets::add(const ErrorSquare& error) noexcept {
  const auto known = std::tuple(above(), below(), rose_);
  seconds_ += error.seconds;
  ++count_;
  for (int axis = 0; axis < 3; ++axis) beyond_ += error.square[axis] > kLevel * kLevel * most(error, axis, 1);
  bet_rougher(error);
  bet_calmer(error);
  return known != std::tuple(above(), below(), rose_);
}

std::optional<double> Bets::above() const noexcept {
  return above_ > 0 ? std::optional(kRougher[above_ - 1]) : std::nullopt;
}

std::optional<double> Bets::below() const noexcept {
  return below_ > 0 && seconds_ - calm_from_ >= kLeastCalm ? std::optional(kCalmer[below_ - 1]) : std::nullopt;
}

}  // namespace backwash::adapt
