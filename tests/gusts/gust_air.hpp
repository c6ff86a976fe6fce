// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

/// Gusts in continuous time for the tests of core/adapt, which shares nothing with them: white noise through lags, in
/// steps of 2.5 ms. No correlation function is used, no sample is made from the one before it by a rule of the sampled
/// process.
namespace gusts {

using Vec3 = Eigen::Vector3d;

enum class Form { karman, first_order, second_order };
inline constexpr std::array kForms{Form::karman, Form::first_order, Form::second_order};
inline constexpr std::array kFormNames{"karman", "first_order", "second_order"};

/// Bursts: the gusts of all axes together louder for a share of the time, kurtosis 3 e^K, mean square unchanged.
struct Bursts {
  double ln_kurtosis = 0;
  double mean_s = 0.06;  ///< of one; lengths are exponential
  double share = 0.07;   ///< of the time
};

/// Unit-variance gusts of three axes.
class GustAir {
 public:
  static constexpr double kStep = 0.0025;  ///< s
  /// tau_s: what the integral of the correlation of all this is, bursts included: what a calibration would tell, s.
  GustAir(Form form, double tau_s, const Bursts& bursts, std::uint64_t seed);
  /// On by a step; what blows then.
  Vec3 step();
  /// Correlation time of lags and bursts, by their closed forms, s.
  double correlation_time() const;
  double normal() { return normal_(rng_); }
  double uniform() { return std::generate_canonical<double, 53>(rng_); }

 private:
  struct Lag {
    double rate, weight, decay, kick;
  };
  void tune(double tau_s);
  Vec3 blown();

  Form form_;
  Bursts bursts_;
  double loud_ = 1, calm_ = 1, mean_off_ = 0;
  bool on_ = false;
  double tau_;             // of the lags alone
  std::vector<Lag> lags_;  // in parallel: first_order has one, karman many
  std::vector<Vec3> states_;
  Vec3 first_ = Vec3::Zero(), second_ = Vec3::Zero();  // second_order: two in a row
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
};

}  // namespace gusts
