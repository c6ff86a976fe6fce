// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/adapt/adaptation.hpp"
#include "tests/gusts/gust_air.hpp"

namespace gusts {

/// A flight in this air, and how it differs from what the model says.
struct Trial {
  Form form = Form::first_order;
  double tau_s = 0.15;                         ///< true
  double tau_low_s = 0.15, tau_high_s = 0.15;  ///< as calibrated
  Bursts bursts{};
  bool form_told = false;  ///< by the calibration
  double rate_hz = 50;
  double jitter = 0;  ///< of the period, half range
  double noise = 0;   ///< standard deviation of the sensor, m/s²; the calibrated one is the same
  double push = 0;    ///< steady, along x, m/s²; the model allows for as much
  double seconds = 120;
  double factor = 1;        ///< on the variance
  double since_s = 0;       ///< from then on
  bool walls_only = false;  ///< 4 s of every 10 are near a wall, and the factor acts only there
  std::uint64_t seed = 1;
  std::vector<double> at_s{};  ///< rising
};

/// What it learned.
struct Learned {
  std::optional<double> alarm_s;    ///< when any class was first called rougher, s since the start
  std::optional<double> exposed_s;  ///< in the class that the factor acts in: time in it from then on until that, s
  double factor = 1;                ///< of that class, at the end
  std::optional<double> calmer;     ///< the same
  std::vector<double> calmer_at;    ///< the same at the times of Trial::at_s; 2: nothing was told by then
};
Learned fly(const Trial& trial);

}  // namespace gusts
