// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/reach/bound/bound_field.hpp"
#include "core/reach/response/integrator.hpp"

/// A loop with an integrator, integrated without the code under test, and air to fly in.
namespace backwash::reach {

inline constexpr double kEuler = 5e-4;  // s

/// PX4's default level gains, with a delay and a lag.
inline constexpr AxisLoop kAxis{0.95 * 1.8, 1.8, 0.04, 0.1, 0.4};

/// Oracle: one axis by Euler's method in steps of 0.5 ms, u = a_cmd + k_p e + k_d ė + i, i̇ = (k_i/k_d)(k_p e + k_d ė)
/// with what was measured `feedback_delay` ago.
class Loop1 {
 public:
  explicit Loop1(const AxisLoop& axis)
      : axis_(axis), past_(static_cast<std::size_t>(std::lround(axis.feedback_delay / kEuler)) + 1) {}
  void step(double w, double p_cmd = 0, double v_cmd = 0, double a_cmd = 0) {
    past_[at_] = {p, v};
    at_ = (at_ + 1) % past_.size();
    const double off = axis_.kp * (p_cmd - past_[at_][0]) + axis_.kd * (v_cmd - past_[at_][1]);
    const double wanted = a_cmd + off + held;
    held += kEuler * axis_.velocity_integrator / axis_.kd * off;
    a += kEuler * (wanted - a) / axis_.attitude_lag;
    p += kEuler * (v + kEuler / 2 * (a + w));
    v += kEuler * (a + w);
  }
  double p = 0, v = 0, a = 0, held = 0;

 private:
  AxisLoop axis_;
  std::vector<std::array<double, 2>> past_;
  std::size_t at_ = 0;
};

inline Vehicle vehicle_of(double integrator) {
  Vehicle vehicle;
  vehicle.controller.kp = {kAxis.kp, 4};
  vehicle.controller.kd = {kAxis.kd, 4};
  vehicle.controller.feedback_delay = kAxis.feedback_delay;
  vehicle.controller.attitude_lag = kAxis.attitude_lag;
  vehicle.controller.velocity_integrator = {integrator, 5 * integrator};
  vehicle.body.radius = 0.1;
  vehicle.limits = {.v_max = 1, .a_max = 1};
  return vehicle;
}

/// Free air, 8 m wide, with gusts of a deviation, m/s², a constant push and a steady one of unknown sign.
struct OpenAir {
  explicit OpenAir(const Vec3& push = Vec3::Zero(), double mean = 0, double gusts = 0.1, double tau_w = 0.15)
      : grid(Vec3::Constant(-4), 0.5, Index3::Constant(16), map::Cell::free),
        distance(grid),
        bounds(grid, {3, mean, mean, tau_w}, extension(push)) {
    std::vector<std::size_t> all(grid.cell_count());
    for (std::size_t n = 0; n < all.size(); ++n) all[n] = n;
    bounds.update(map::all_of(grid.size()), all, [&](const auto& store) {
      for (const std::size_t n : all) store(n, Variance::horizontal_vertical(gusts * gusts, gusts * gusts));
    });
  }
  static field::Extension extension(const Vec3& push) {
    Model model;
    if (!push.isZero()) model.extension = {{Law::push, push, Vec3::Zero(), 0}};
    return {map::OccupancyGrid(Vec3::Constant(-4), 0.5, Index3::Constant(16), map::Cell::free), model};
  }
  map::OccupancyGrid grid;
  map::DistanceField distance;
  BoundField bounds;
};

inline AxisLoop with_gain(double integrator) {
  AxisLoop axis = kAxis;
  axis.velocity_integrator = integrator;
  return axis;
}

}  // namespace backwash::reach
