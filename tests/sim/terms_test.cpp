// SPDX-License-Identifier: BSD-3-Clause
// What an extended model adds to the simulation, against closed forms and long-time statistics.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "core/config/config.hpp"
#include "core/sim/setpoint_flight.hpp"
#include "core/types/minimum_jerk.hpp"
#include "tests/sim/five_inch.hpp"

namespace backwash::sim {
namespace {

using Kind = SimulationTerm::Kind;
using Terms = std::vector<SimulationTerm>;

/// 4 × 4 × 3 m of air between a floor at z = 0, a ceiling at z = 3 and walls all around.
map::OccupancyGrid room() {
  map::OccupancyGrid grid(Vec3(-0.1, -0.1, -0.1), 0.1, Index3(42, 42, 32), map::Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    if (v.minCoeff() == 0 || v.x() == 41 || v.y() == 41 || v.z() == 31) grid.set(v, map::Cell::occupied);
  }
  return grid;
}

AirTerms::Now now(const Terms& terms, const FlightInstant& flying) {
  static const auto grid = room();
  return AirTerms(grid, terms, 1).step(flying, 1e-3);
}

/// What air, thrust, set-points, sensors and rotors make of the terms in a moment of a flight.
std::vector<double> all_that_is_simulated(const Terms& given) {
  const auto grid = room();
  AirTerms air(grid, given, 1);
  ThrustTerms thrust(given);
  Sensors sensors(five_inch(), given, {}, 1);
  const auto ki = least_integrator(given, five_inch().controller.kd);
  std::vector<double> all{setpoint_delay(given), more_attitude_lag(given), ki.horizontal, ki.vertical};
  const FlightInstant at{20, {2, 2, 0.5}, {0.6, -0.8, 0.3}, 0.5};
  const double acceleration = thrust.step(kGravity, 0, 15.0, 1e-3);
  for (int i = 0; i < 50; ++i) {
    const auto seen = air.step(at, 1e-2);
    all.push_back(seen.gust);
    sensors.step(acceleration, 1e-3);
    for (const Vec3& v : {seen.push_W, seen.place_W, sensors.acceleration(Vec3::Zero(), at.yaw, at.t, 20.0)})
      all.insert(all.end(), v.begin(), v.end());
    const auto rotors = sensors.rotors();
    all.insert(all.end(), rotors.motor.begin(), rotors.motor.end());
    all.insert(all.end(), rotors.rpm.begin(), rotors.rpm.end());
  }
  all.push_back(thrust.step(kGravity + 1, at.t, 15.0, 1e-3));
  return all;
}

TEST(SimulationTerms, EveryKindChangesWhatIsSimulated) {
  const auto without = all_that_is_simulated({});
  for (const SimulationKind& kind : kSimulationKinds) {
    SimulationTerm term{kind.kind, {}};
    for (const TermRange& r : kind.numbers) term.value.push_back(r.least + 0.6 * (r.most - r.least));
    EXPECT_NE(all_that_is_simulated({term}), without) << kind.name << " is computed by nothing in core/sim";
  }
}

TEST(AirTermsOfAModel, PushAsTheirFormulasSay) {
  const FlightInstant low{0, {2, 2, 0.5}, {0.6, -0.8, 0}, M_PI / 2};
  EXPECT_NEAR(now({{Law::push_over_surface, {0.3, 0.2}}}, low).push_W.z(), 0.3 * std::exp(-0.1 / 0.2), 1e-9);
  EXPECT_NEAR(now({{Law::push_under_surface, {0.3, 0.5}}}, {0, {2, 2, 2.5}, Vec3::Zero()}).push_W.z(),
              0.3 * std::exp(-0.2 / 0.5), 1e-9);
  const Vec3 pull = now({{Law::push_to_walls, {0.3, 0.1}}}, {0, {0.5, 2, 1.5}, Vec3::Zero()}).push_W;
  EXPECT_NEAR(pull.x(), -0.3 * std::exp(-0.1 / 0.1), 1e-3);
  EXPECT_TRUE(now({{Law::push, {0.1, 0.2, 0.3}}}, low).push_W.isApprox(Vec3(0.1, 0.2, 0.3)));
  EXPECT_TRUE(now({{Kind::push_of_heading, {0.1, 0.2}}}, low).push_W.isApprox(Vec3(-0.2, 0.1, 0), 1e-9));
  EXPECT_TRUE(now({{Law::push_against_velocity, {0.5}}}, low).push_W.isApprox(Vec3(-0.3, 0.4, 0)));
  EXPECT_TRUE(now({{Law::push_against_climb, {0.5}}}, {0, {2, 2, 1}, {1, 1, 0.4}}).push_W.isApprox(Vec3(0, 0, -0.2)));
  EXPECT_TRUE(now({{Law::push_with_speed, {0.5}}}, low).push_W.isApprox(Vec3(0, 0, 0.5)));
}

TEST(AirTermsOfAModel, ScaleTheGustsAsTheirFormulasSay) {
  const FlightInstant fast{20, {2, 2, 1}, {2, 0, 0}};
  EXPECT_NEAR(now({{Law::ln_variance_with_speed, {0.4, 1.5}}}, fast).gust, std::exp(0.2 * std::pow(2, 1.5)), 1e-9);
  EXPECT_NEAR(now({{Kind::ln_variance_with_time, {0.8, 10}}}, fast).gust, std::exp(0.4 * (1 - std::exp(-2))), 1e-9);
  EXPECT_NEAR(now({{Law::ln_variance_under_surface, {0.6, 0.4}}}, {0, {2, 2, 2.5}, Vec3::Zero()}).gust,
              std::exp(0.3 * std::exp(-0.2 / 0.4)), 1e-9);
  EXPECT_EQ(now({{Law::push, {1, 1, 1}}}, fast).gust, 1);
}

TEST(AirTermsOfAModel, LookSigmaUpElsewhereButNotInASolid) {
  EXPECT_TRUE(now({{Kind::variance_elsewhere, {1, 0.3, -0.2}}}, {0, {2, 2, 1}, Vec3::Zero()})
                  .place_W.isApprox(Vec3(2.3, 1.8, 1)));
  const Vec3 at = now({{Kind::variance_elsewhere, {1, -0.5, 0}}}, {0, {0.3, 2, 1}, Vec3::Zero()}).place_W;
  EXPECT_GT(at.x(), -1e-9) << "behind the wall";
  EXPECT_LT(at.x(), 0.1);
}

TEST(AirTermsOfAModel, BurstsRaiseTheKurtosisAndKeepTheVariance) {
  for (const double K : {0.4, 1.0, 1.6}) {
    const auto grid = room();
    AirTerms terms(grid, Terms{{Kind::kurtosis, {K}}}, 7);
    double square = 0, fourth = 0;
    constexpr int kSteps = 3'000'000;
    for (int i = 0; i < kSteps; ++i) {
      const double m2 = std::pow(terms.step({0, {2, 2, 1}, Vec3::Zero()}, 2e-3).gust, 2);
      square += m2 / kSteps;
      fourth += m2 * m2 / kSteps;
    }
    EXPECT_NEAR(square, 1, 0.04) << K;
    EXPECT_NEAR(std::log(fourth / (square * square)), K, 0.06) << K;
  }
}

TEST(ModelAir, HasTheModelsVarianceAndCorrelation) {
  const auto grid = room();
  const auto model = config::load_model("builtin:quad-5in").value();
  ModelField field(grid, model);
  ModelAir air(field, 3);
  const Vec3 p(0.75, 1.85, 0.85);
  const auto sigma = field::ProximityField(grid, model).at(p).sigma();
  const double dt = 0.01, late = 0.1;
  double xx = 0, zz = 0, shared = 0;
  std::vector<double> x;
  constexpr int kSteps = 400'000;
  for (int i = 0; i < kSteps; ++i) {
    const Vec3 w = air.step(p, dt);
    xx += w.x() * w.x() / kSteps;
    zz += w.z() * w.z() / kSteps;
    x.push_back(w.x());
    if (x.size() > 10) shared += x[x.size() - 11] * w.x() / kSteps;
  }
  EXPECT_NEAR(xx / sigma.xx, 1, 0.06);  // between lattice points too
  EXPECT_NEAR(zz / sigma.zz, 1, 0.06);
  EXPECT_NEAR(shared / xx, std::exp(-late / model.bound.tau_w), 0.03);
}

/// Where the vehicle comes to rest without gusts, less its set-point.
Vec3 rests(const Terms& terms, std::optional<double> voltage = {}, double yaw = 0) {
  const auto grid = room();
  Model calm;
  calm.base = {0, 0};
  calm.ground.lambda = {0, 0};
  calm.ground.k1 = {0, 0};
  calm.corner.lambda = {0, 0, 0};
  calm.wall.k1 = {0, 0, 0};
  ModelField field(grid, calm);
  auto vehicle = five_inch();
  vehicle.estimation.position = 0;
  Setpoint at;
  at.p_W = {2, 2, 1.5};
  ClosedLoop loop(grid, vehicle, {at.p_W, Vec3::Zero()}, 1, {.terms = terms, .air = &field});
  for (int i = 0; i < 15'000; ++i) {
    loop.set_conditions(yaw, voltage, std::nullopt);
    loop.step(at);
  }
  return loop.estimated().p_W - at.p_W;
}

TEST(ThrustTermsOfAModel, LetTheVehicleSinkByWhatTheyTake) {
  const auto kp = five_inch().controller.kp;
  const double m = 0.05;
  EXPECT_NEAR(rests({{Kind::thrust_share, {m}}}).z(), -kGravity * m / (1 - m) / kp.vertical, 1e-3);
  EXPECT_NEAR(rests({{Kind::thrust_slope, {0.3}}}).norm(), 0, 1e-3) << "hover is where the curve is right";
  const Terms sag{{Kind::thrust_with_voltage, {0.5, 16.0, 15.0, 15.5, -0.01}}};
  EXPECT_NEAR(rests(sag, 16.0).z(), 0, 1e-3) << "as modelled at V*";
  const double lost = 0.5 * 1.0 / 15.0;
  EXPECT_NEAR(rests(sag, 15.0).z(), -kGravity * lost / (1 - lost) / kp.vertical, 1e-3);
  EXPECT_NEAR(rests(sag).z(), rests(sag, 15.5 - 0.01 * 15).z(), 2e-3) << "the term's own course";
  EXPECT_TRUE(rests({{Kind::push_of_heading, {0.3, 0}}}, {}, M_PI / 2).isApprox(Vec3(0, 0.3 / kp.horizontal, 0), 1e-3));
}

TEST(ThrustTermsOfAModel, LagIsOfFirstOrderAndSlopeIsAboutHover) {
  ThrustTerms lag(Terms{{Kind::thrust_lag, {0.05}}});
  EXPECT_DOUBLE_EQ(lag.step(kGravity, 0, {}, 1e-3), kGravity);
  double at = 0;
  for (int i = 0; i < 50; ++i) at = lag.step(kGravity + 1, 0, {}, 1e-3);
  EXPECT_NEAR(at - kGravity, 1 - std::exp(-1), 1e-9);
  ThrustTerms steep(Terms{{Kind::thrust_slope, {0.2}}});
  EXPECT_NEAR(steep.step(kGravity + 2, 0, {}, 1e-3), kGravity + 2.4, 1e-12);
}

TEST(ThrustTermsOfAModel, SetpointsActLater) {
  const auto grid = room();
  const auto vehicle = five_inch();
  const auto rises = [&](const Terms& terms) {
    ClosedLoop loop(grid, vehicle, {Vec3(2, 2, 1.5), Vec3::Zero()}, 1, {.terms = terms});
    ClosedLoop still(grid, vehicle, {Vec3(2, 2, 1.5), Vec3::Zero()}, 1, {.terms = terms});
    Setpoint up, stay;
    up.p_W = {2, 2, 1.6};
    stay.p_W = {2, 2, 1.5};
    for (int i = 1; i < 1000; ++i) {
      loop.step(up);
      still.step(stay);
      if ((loop.estimated().p_W - still.estimated().p_W).norm() > 1e-9) return i;
    }
    return 0;
  };
  EXPECT_EQ(rises({{Kind::setpoint_delay, {0.04}}}) - rises({}), 40);
}

TEST(ThrustTermsOfAModel, TheAttitudeLagsLonger) {
  const auto grid = room();
  const auto way_after_50_ms = [&](const Terms& terms) {
    ClosedLoop loop(grid, five_inch(), {Vec3(2, 2, 1.5), Vec3::Zero()}, 1, {.terms = terms});
    ClosedLoop still(grid, five_inch(), {Vec3(2, 2, 1.5), Vec3::Zero()}, 1, {.terms = terms});
    Setpoint aside, stay;
    aside.p_W = {2.1, 2, 1.5};
    stay.p_W = {2, 2, 1.5};
    for (int i = 0; i < 120; ++i) {
      loop.step(aside);
      still.step(stay);
    }
    return (loop.estimated().p_W - still.estimated().p_W).norm();
  };
  // Of a first-order lag the way in the beginning goes with its inverse.
  const double as_filed = way_after_50_ms({}), slower = way_after_50_ms({{Kind::attitude_lag, {0.05}}});
  EXPECT_GT(as_filed, 0);
  EXPECT_LT(slower, 0.8 * as_filed);
  EXPECT_GT(slower, 0.3 * as_filed);
}

TEST(ShiftDecayOfAModel, IsTheRateAtWhichASteadyPushsShiftGoes) {
  const auto grid = room();
  Vehicle v = five_inch();
  v.estimation.position = 0;
  const double push = 0.4, rate = 0.2;
  const auto shift_after = [&](const Terms& terms, int seconds) {
    ClosedLoop loop(grid, v, {{2, 2, 1.5}, Vec3::Zero()}, 1, {.strength = 0, .terms = terms});
    Setpoint stay;
    stay.p_W = {2, 2, 1.5};
    for (int i = 0; i < 1000 * seconds; ++i) loop.step(stay);
    return loop.sample(stay, {}).truth.p_W.x() - 2;
  };
  const SimulationTerm pushed{Law::push, {push, 0, 0}}, decays{Kind::shift_decay, {rate, 0}};
  EXPECT_NEAR(shift_after({pushed}, 12), push / v.controller.kp.horizontal, 0.002);
  const double early = shift_after({pushed, decays}, 8), later = shift_after({pushed, decays}, 12);
  EXPECT_NEAR(std::log(early / later) / 4, rate, 0.1 * rate);
}

TEST(SensorsOfAModel, DriftWithTimeAndTemperatureAlongTheHeading) {
  Sensors by_time(five_inch(), Terms{{Kind::sensor_drift_with_time, {0.1, 0.2, 0.3, 0.01, 0.02, 0.03}}}, {}, 1);
  EXPECT_TRUE(by_time.acceleration(Vec3::Zero(), M_PI / 2, 200, {}).isApprox(Vec3(-0.42, 0.21, 0.63), 1e-9));
  Sensors by_heat(five_inch(), Terms{{Kind::sensor_drift_with_temperature, {0.1, 0, 0, 0, 0, 0.5, 25, 0.1}}}, {}, 1);
  EXPECT_TRUE(by_heat.acceleration(Vec3::Zero(), 0, 0, 35.0).isApprox(Vec3(0.1, 0, 0.5), 1e-9));
  EXPECT_TRUE(by_heat.acceleration(Vec3::Zero(), 0, 50, {}).isApprox(Vec3(0.05, 0, 0.5), 1e-9));
}

TEST(SensorsOfAModel, LinesHaveTheirAmplitudeAtTheRotorsRate) {
  Sensors sensors(five_inch(), Terms{{Kind::sensor_lines, {0, 0, 0.4, 0, 0.02}}}, 9000.0, 1);
  const double hz = 9000 * 1.004 / 60, dt = 1e-3;
  std::complex<double> sum = 0;
  constexpr int kSteps = 20'000;
  for (int i = 0; i < kSteps; ++i) {
    sensors.step(kGravity, dt);
    sum += sensors.acceleration(Vec3::Zero(), 0, 0, {}).z() * std::polar(2.0 / kSteps, 2 * M_PI * hz * (i + 1) * dt);
  }
  EXPECT_NEAR(std::abs(sum), 0.4, 0.01);
}

TEST(SensorsOfAModel, OneRotorNeedsMoreReadsWrongOrNotAtAll) {
  const auto vehicle = five_inch();
  const auto share = [&](double u) {
    return vehicle.propulsion.thr_mdl_fac * u * u + (1 - vehicle.propulsion.thr_mdl_fac) * u;
  };
  Sensors sensors(vehicle,
                  Terms{{Kind::rotor_needs, {0, 0.1, 0, 0}},
                        {Kind::rotor_reading, {0, 0, -0.2, 0}},
                        {Kind::rotor_dropout, {0, 0, 0, 0.25}}},
                  9000.0, 5);
  sensors.step(kGravity, 1e-3);
  const auto told = sensors.rotors();
  EXPECT_NEAR(std::log(share(told.motor[1]) / share(told.motor[0])), 0.1, 1e-9);
  EXPECT_NEAR(2 * std::log(told.rpm[1] / told.rpm[0]), 0.1, 1e-9);
  EXPECT_NEAR(2 * std::log(told.rpm[2] / told.rpm[0]), -0.2, 1e-9);
  int missing = 0;
  for (int i = 0; i < 4000; ++i) missing += sensors.rotors().rpm[3] == 0 ? 1 : 0;
  EXPECT_NEAR(missing / 4000.0, 0.25, 0.04);
}

TEST(SetpointFlight, HasTheLogsStampsAndFollowsItsSetPoints) {
  const auto grid = room();
  auto vehicle = five_inch();
  vehicle.estimation.position = 0;
  ModelField field(grid, config::load_model("builtin:quad-5in").value());
  const auto commands = rest_to_rest({1, 1, 1}, {3, 2, 1.5}, 1.0, 1.0);
  log::FlightLog log;
  double t = 5;
  for (std::size_t k = 0; k < commands.size(); ++k) {
    t += k == 40 ? 0.7 : 0.02 + 0.004 * std::sin(static_cast<double>(k));
    log.t_s.push_back(t);
    const char* const axes[] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i) {
      log.columns[std::string(axes[i]) + "_m"].push_back(commands.front().p_W[i]);
      log.columns[std::string("cmd_") + axes[i] + "_m"].push_back(commands[k].p_W[i]);
    }
    log.columns["battery_v"].push_back(16 - 0.01 * t);
  }
  const auto flight = logged_flight(log, vehicle, "log");
  ASSERT_TRUE(flight) << flight.error().message;
  EXPECT_NEAR(flight->voltage.back(), 16 - 0.01 * t, 1e-6);
  const auto again = to_log(fly_setpoints(grid, vehicle, *flight, 1, {.air = &field}), *flight, log);
  ASSERT_EQ(again.t_s.size(), log.t_s.size());
  for (std::size_t k = 0; k < log.t_s.size(); ++k) EXPECT_NEAR(again.t_s[k], log.t_s[k], 1e-12);
  EXPECT_EQ(again.column("battery_v"), log.column("battery_v"));
  EXPECT_TRUE(again.has("rpm4") && again.has("motor1"));
  EXPECT_NEAR(again.column("x_m").back(), 3, 0.15);
}

TEST(SetpointFlight, RefusesALogWithoutSetPoints) {
  log::FlightLog log;
  log.t_s = {0, 1};
  for (const char* name : {"x_m", "y_m", "z_m"}) log.columns[name] = {0, 0};
  const auto flight = logged_flight(log, five_inch(), "a.csv");
  ASSERT_FALSE(flight);
  EXPECT_NE(flight.error().message.find("a.csv:1:"), std::string::npos);
  EXPECT_NE(flight.error().message.find("cmd_x_m"), std::string::npos);
}

}  // namespace
}  // namespace backwash::sim
