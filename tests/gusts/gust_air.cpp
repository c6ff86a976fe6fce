// SPDX-License-Identifier: BSD-3-Clause
#include "tests/gusts/gust_air.hpp"

#include <cmath>

namespace gusts {
namespace {

/// (1 + s)^(−5/6) is a mixture of 1/(u + s), u ≥ 1, by the density (u − 1)^(−5/6): von Kármán's spectrum is one of
/// first-order lags of the rates √u/T. Cut into shares, equal in ln(u − 1).
constexpr int kLags = 7;
constexpr double kFirst = 1e-3, kLast = 4e4, kPower = 5.0 / 6;

}  // namespace

GustAir::GustAir(Form form, double tau_s, const Bursts& bursts, std::uint64_t seed)
    : form_(form), bursts_(bursts), tau_(tau_s), rng_(seed) {
  const double excess = std::expm1(bursts.ln_kurtosis), p = bursts.share;
  const double difference = std::sqrt(excess / (p * (1 - p))), calm2 = 1 - p * difference;
  loud_ = std::sqrt(calm2 + difference);
  calm_ = std::sqrt(calm2);
  mean_off_ = bursts.mean_s * (1 - p) / p;
  for (int turn = 0; turn < 4; ++turn) {  // shorter lags where bursts shorten the correlation
    tune(tau_);
    tau_ *= tau_s / correlation_time();
  }
  tune(tau_);
  states_.resize(lags_.size());
  for (Vec3& state : states_) state = Vec3(normal(), normal(), normal());
  const double settle = form_ == Form::second_order ? 20 * tau_ : 0;
  for (double t = 0; t < settle; t += kStep) blown();
}

void GustAir::tune(double tau_s) {
  lags_.clear();
  if (form_ == Form::second_order) return;
  if (form_ == Form::first_order) {
    lags_ = {{1 / tau_s, 1, 0, 0}};
  } else {
    double sum = 0;
    for (int k = 0; k < kLags; ++k) {
      const auto edge = [](int i) { return kFirst * std::pow(kLast / kFirst, static_cast<double>(i) / kLags); };
      const double low = k == 0 ? 0 : edge(k), high = edge(k + 1), middle = k == 0 ? high / 7 : std::sqrt(low * high);
      const double share = std::pow(high, 1 - kPower) - std::pow(low, 1 - kPower), rate = std::sqrt(1 + middle);
      lags_.push_back({rate, share / rate, 0, 0});  // a lag of rate a and spectrum 1/(a² + ω²) has the variance 1/2a
      sum += share / rate;
    }
    double time = 0;  // ∫ρ dt at rates in units of 1/T
    for (const Lag& lag : lags_) time += lag.weight / sum / lag.rate;
    for (Lag& lag : lags_) {
      lag.weight = std::sqrt(lag.weight / sum);
      lag.rate *= time / tau_s;
    }
  }
  for (Lag& lag : lags_) {
    lag.decay = std::exp(-lag.rate * kStep);
    lag.kick = std::sqrt(1 - lag.decay * lag.decay);
  }
}

double GustAir::correlation_time() const {
  // Of m, the bursts' factor: E m m' = μ² + (1 − μ²) e^{−t/τ_b}, both states left at their rates.
  const double p = bursts_.share, mean = p * loud_ + (1 - p) * calm_;
  const double leaving = bursts_.ln_kurtosis > 0 ? 1 / bursts_.mean_s + 1 / mean_off_ : 0;
  double sum = 0;
  if (form_ == Form::second_order) {
    const double T = tau_ / 2, a = 1 / T + leaving;
    return mean * mean * tau_ + (1 - mean * mean) * (1 / a + 1 / (T * a * a));
  }
  for (const Lag& lag : lags_)
    sum += lag.weight * lag.weight * (mean * mean / lag.rate + (1 - mean * mean) / (lag.rate + leaving));
  return sum;
}

Vec3 GustAir::blown() {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < lags_.size(); ++k) {
    states_[k] = lags_[k].decay * states_[k] + lags_[k].kick * Vec3(normal(), normal(), normal());
    sum += lags_[k].weight * states_[k];
  }
  if (form_ != Form::second_order) return sum;
  // ẍ = −2ẋ/T − x/T² + noise, midpoint: variance 1 with a noise of the density 4/T³.
  const double T = tau_ / 2, kick = std::sqrt(4 / (T * T * T) * kStep);
  const auto bend = [T](const Vec3& x, const Vec3& v) -> Vec3 { return -2 / T * v - x / (T * T); };
  const Vec3 v_half = second_ + kStep / 2 * bend(first_, second_), x_half = first_ + kStep / 2 * second_;
  first_ += kStep * v_half;
  second_ += kStep * bend(x_half, v_half) + kick * Vec3(normal(), normal(), normal());
  return first_;
}

Vec3 GustAir::step() {
  const Vec3 gust = blown();
  if (!(bursts_.ln_kurtosis > 0)) return gust;
  if (uniform() < kStep / (on_ ? bursts_.mean_s : mean_off_)) on_ = !on_;
  return (on_ ? loud_ : calm_) * gust;
}

}  // namespace gusts
