// SPDX-License-Identifier: BSD-3-Clause
// What the simulation itself flies lacks nothing: the study tells none of its loop, however short the hovers are.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/sim/hover_flight.hpp"
#include "core/sim/vehicle/quadrotor.hpp"
#include "core/study/findings/study.hpp"
#include "core/study/windows/loop.hpp"
#include "core/study/windows/observer.hpp"
#include "core/types/minimum_jerk.hpp"

namespace backwash::study {
namespace {

/// A craft of 35 g.
Vehicle small_craft() {
  Vehicle v = config::load_vehicle("builtin:quad-5in").value();
  v.body.radius = 0.05;
  v.body.diagonal_radius = 0.06;
  v.body.rotor_radius = 0.0225;
  v.body.mass = 0.035;
  v.controller.kp = {9, 12};
  v.controller.kd = {5, 6};
  v.controller.latency = 0.015;
  v.controller.attitude_lag = 0.04;
  v.propulsion.max_thrust = 0.6;
  v.propulsion.thr_mdl_fac = 0.6;
  return v;
}

/// Causes of 12 flights from hover to hover of 1 s between parallel walls.
std::vector<std::string> told_of_short_hovers(const Vehicle& vehicle, unsigned seed) {
  const auto grid = map::builtin_scene("parallel-walls-4m").value();
  Model model = config::load_model("builtin:quad-5in").value();
  model.ground.r0 = vehicle.body.diagonal_radius;
  Observer observer(vehicle, model, &grid);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto spot = [&]() -> Vec3 {
    const double x = -2.4 + 4.8 * uniform(random), y = -1.4 + 2.8 * uniform(random);
    return {x, y, 0.4 + 1.8 * uniform(random)};
  };
  for (unsigned f = 0; f < 12; ++f) {
    sim::HoverFlight flight{.start_W = spot(), .seed = 100 * seed + f, .strength_sd = 0.35, .hovers = {}};
    for (int k = 0; k < 30; ++k) flight.hovers.push_back({spot(), 1.0});
    observer.add(sim::to_log(sim::fly_hovers(grid, vehicle, flight)));
  }
  const auto seen = observer.finish();
  StudyOptions options;
  options.minimum_detectable = false;
  std::vector<std::string> names;
  for (const auto& cause : study(seen, options).causes) names.push_back(cause.found.form->cause());
  return names;
}

TEST(SimulatedFlights, WithShortHoversAreToldNoCause) {
  const Vehicle shipped = config::load_vehicle("builtin:quad-5in").value();
  for (const Vehicle& vehicle : {shipped, small_craft()})
    EXPECT_EQ(told_of_short_hovers(vehicle, 1), std::vector<std::string>()) << vehicle.body.mass << " kg";
}

// The simulation cuts time twenty times as fine. A set-point that is held for a period is half a period old on the
// mean.
TEST(LoopOf, RowsIsAsLateAsTheSimulationOfHeldSetpoints) {
  const Vehicle vehicle = config::load_vehicle("builtin:quad-5in").value();
  for (const int held : {10, 20}) {  // ms
    sim::Quadrotor quad(vehicle, {Vec3::Zero(), Vec3::Zero()});
    std::vector<double> t;
    std::vector<Vec3> p, v, a;
    std::vector<Setpoint> commands;
    const double way = 1.5, seconds = 3;
    for (int row = 0; row < 4000 / held; ++row) {
      t.push_back(quad.time());
      p.push_back(quad.state().p_W);
      v.push_back(quad.state().v_W);
      a.push_back(quad.acceleration());
      const auto [value, first, second] = minimum_jerk(std::min(1.0, quad.time() / seconds));
      commands.push_back(
          {Vec3(way * value, 0, 0), Vec3(way * first / seconds, 0, 0), Vec3(way * second / (seconds * seconds), 0, 0)});
      quad.command(commands.back());
      for (int k = 0; k < held; ++k) quad.step(Vec3::Zero(), quad.state());
    }
    loop::PositionLoop loop(vehicle);
    loop.latency += 0.5e-3 * held;
    const auto nominal = loop_of({t, p, v, commands}, loop).a;
    double product = 0, square = 0;
    for (std::size_t i = 1; i + 1 < t.size(); ++i) {
      const double rate = (nominal[i + 1].x() - nominal[i - 1].x()) / (t[i + 1] - t[i - 1]);
      product += rate * (nominal[i].x() - a[i].x());
      square += rate * rate;
    }
    EXPECT_LT(std::abs(product / square), 0.0008) << "s late, set-points held for " << held << " ms";
  }
}

}  // namespace
}  // namespace backwash::study
