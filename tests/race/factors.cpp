// SPDX-License-Identifier: BSD-3-Clause
// Where the factor between the worst case and what touches goes: the clearance that is asked towards the nearest
// obstacle, after each step from one to the other.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "core/plan/rest.hpp"
#include "core/reach/response/coloured_error.hpp"
#include "services/parallel/parallel.hpp"
#include "tests/race/flown.hpp"
#include "tests/race/race.hpp"
#include "tests/race/trajectories.hpp"

namespace backwash::race {
namespace {

constexpr double kRisk = 1e-3, kSeconds = 10;  ///< of a flight
constexpr double kNear = 1;                    ///< m: what is farther asks for nothing
constexpr int kSeeds = 4;

/// What is assumed; each is a step when it is set.
struct Steps {
  bool centre = false, truth = false, level = false, loop = false, own = false, first = false, estimate = false,
       mean = false, fine = false;
};
struct Row {
  const char* name;
  Steps steps;
};
const Row kRows[] = {
    {"worst case as it stands", {}},
    {"Σ: most in the set → at its centre", {.centre = true}},
    {"Σ: upper limit of calibration → the true one", {.centre = true, .truth = true}},
    {"κ = 3 → level of five directions a second", {.level = true}},
    {"worst pattern → the loop's covariance (3 σ)", {.loop = true}},
    {"prism → the obstacle's own direction", {.own = true}},
    {"first set → none", {.first = true}},
    {"estimation → as it errs (rms)", {.estimate = true}},
    {"mean push → as it is", {.mean = true}},
    {"level and covariance", {.level = true, .loop = true}},
    {"level and covariance and own direction", {.level = true, .loop = true, .own = true}},
    {"the same by steps of 2.5 ms", {.level = true, .loop = true, .own = true, .fine = true}},
    {"all of it", {true, true, true, true, true, true, true, true, true}},
};

/// Support of the prism in direction n: of the pairs of directions about it, the least.
double prism_support(const PerDirection& h, const Vec3& n) {
  const double x = std::abs(n.x()), y = std::abs(n.y()), root = std::numbers::sqrt2;
  const bool same = n.x() * n.y() >= 0;
  const double along = same ? h[kXyPlus] : h[kXyMinus], across = same ? h[kXyMinus] : h[kXyPlus];
  const double level =
      std::min({x * h[kX] + y * h[kY], std::abs(x - y) * (x > y ? h[kX] : h[kY]) + root * std::min(x, y) * along,
                (x + y) / root * along + std::abs(x - y) / root * across});
  return level + std::abs(n.z()) * h[kZ];
}

/// Support of the ellipsoid that has these half widths in the five directions.
double own_support(const PerDirection& h, const Vec3& n) {
  const double xy = (h[kXyPlus] * h[kXyPlus] - h[kXyMinus] * h[kXyMinus]) / 2;
  return std::sqrt(std::max(0.0, std::pow(n.x() * h[kX], 2) + std::pow(n.y() * h[kY], 2) + std::pow(n.z() * h[kZ], 2) +
                                     2 * n.x() * n.y() * xy));
}

/// Half widths along a flight under scales s of each entry: κ times the worst pattern or level times σ_e.
class Widths {
 public:
  Widths(const reach::Reachability& reach, double tau_w, bool fine)
      : reach_(reach),
        fine_(fine),
        horizontal_(reach::axis_loop(reach.vehicle, false, reach.loop), tau_w, kControlPeriod / (fine ? 8 : 1)),
        vertical_(reach::axis_loop(reach.vehicle, true, reach.loop), tau_w, kControlPeriod / (fine ? 8 : 1)) {}

  std::vector<PerDirection> of(const std::vector<PerDirection>& s, const Steps& steps) const {
    Vehicle still = reach_.vehicle;
    still.initial_error = {0, 0};
    reach::SupportRecursion worst(reach_.horizontal, reach_.vertical, still);
    std::vector<reach::ErrorCovariance> error;
    for (std::size_t d = 0; d < kDirections; ++d) error.emplace_back(d == kZ ? vertical_ : horizontal_);
    std::vector<PerDirection> result;
    for (const auto& scales : s) {
      PerDirection h = worst.half_widths();
      for (std::size_t d = 0; d < kDirections; ++d)
        h[d] = (steps.loop ? error[d].position_deviation() : h[d]) * (steps.level ? level(d, steps.own) : 3.0);
      result.push_back(h);
      worst.step({scales});
      for (std::size_t d = 0; d < kDirections; ++d)
        for (int i = 0; i < (fine_ ? 8 : 1); ++i) error[d].advance(scales[d]);
    }
    return result;
  }

 private:
  /// Of the flight's risk in one direction, as reach::kappa_of; or of a fifth of it in each second, as chance tubes.
  double level(std::size_t d, bool own) const {
    double& kept = level_[d == kZ][own];
    if (kept > 0) return kept;
    reach::ErrorCovariance error(d == kZ ? vertical_ : horizontal_);
    for (int i = 0; i < 4000; ++i) error.advance(1);
    const double turn = error.turn_rate();
    return kept = own ? reach::exit_level(0.05 * turn / 2, std::numeric_limits<double>::infinity(), kRisk)
                      : reach::exit_level(turn, std::numeric_limits<double>::infinity(), 0.9 * kRisk / kSeconds / 5);
  }
  const reach::Reachability& reach_;
  bool fine_;
  reach::ColouredStep horizontal_, vertical_;
  mutable double level_[2][2] = {};
};

/// One flight: where it is near something, and what blows there.
struct Look {
  reach::ReachTube tube;
  std::vector<PerDirection> window, centre, truth;  ///< deviations of the disturbance, m/s²
  std::vector<Vec3> towards, push;                  ///< unit vector to the nearest obstacle; true mean push, m/s²
  std::vector<double> distance;                     ///< m
  int touched = 0;
};

Look looked(const plan::World& world, const Vehicle& vehicle, const Calibrated& c, Trajectory flight,
            std::uint64_t seed) {
  Look look;
  const State start{flight.commands.front().p_W, Vec3::Zero()};
  Setpoint hover;
  hover.p_W = start.p_W;
  plan::hold_until_settled(world.reach, flight.commands);
  look.tube = reach::tube_over_field(world.reach, start, hover, flight.commands, world.bounds);
  const sim::AirflowTruth truth(world.grid, vehicle, 1);
  const auto scale = [&](const DisturbanceBound& w) {
    PerDirection s;
    for (std::size_t d = 0; d < kDirections; ++d)
      s[d] = std::max(0.0, w.w[d] - (d == kZ ? c.bound.mean_vertical : c.bound.mean_horizontal)) / c.bound.kappa;
    return s;
  };
  for (const auto& step : look.tube) {
    const Vec3& p = step.center.p_W;
    look.window.push_back(scale(step.w_bar));
    look.centre.push_back(scale(world.bounds.at(world.grid.index(p))));
    const Vec3 v = truth.variance(p).cwiseSqrt();
    const double diagonal = std::sqrt((v.x() * v.x() + v.y() * v.y()) / 2);
    look.truth.push_back({v.x(), v.y(), v.z(), diagonal, diagonal});
    look.push.push_back(truth.mean(p));
    look.distance.push_back(world.distance.exact(world.grid, p));
    Vec3 away;
    for (int axis = 0; axis < 3; ++axis)
      away[axis] = world.distance.exact(world.grid, p + 0.01 * Vec3::Unit(axis)) -
                   world.distance.exact(world.grid, p - 0.01 * Vec3::Unit(axis));
    look.towards.push_back(away.norm() > 0 ? Vec3(-away.normalized()) : Vec3::Zero());
  }
  for (unsigned k = 0; k < kSeeds; ++k)
    look.touched += touches(world.grid, world.distance, vehicle, flight.commands, start.p_W, seed + k, 1);
  return look;
}

/// Clearance that is asked at each entry of a flight, m.
std::vector<double> asked(const Look& look, const plan::World& world, const Calibrated& c, const Widths& widths,
                          const Steps& steps) {
  const auto h = widths.of(steps.truth ? look.truth : steps.centre ? look.centre : look.window, steps);
  const auto& reach = world.reach;
  const auto& v = reach.vehicle;
  std::vector<double> result;
  for (std::size_t k = 0; k < look.tube.size(); ++k) {
    const Vec3& n = look.towards[k];
    const auto at = k * reach::AxisResponse::kPhases;
    const auto first = [&](const reach::AxisResponse& r) {
      const auto left = [&](const std::vector<double>& table) { return at < table.size() ? table[at] : 0.0; };
      return steps.first ? 0.0
                         : std::hypot(v.initial_error.position * left(r.from_position),
                                      v.initial_error.velocity * left(r.from_velocity));
    };
    const double level = n.head<2>().norm(), upright = std::abs(n.z());
    const double push =
        steps.mean ? std::max(0.0, n.dot(Vec3(look.push[k].cwiseProduct(
                                       Vec3(reach.horizontal.h_inf, reach.horizontal.h_inf, reach.vertical.h_inf)))))
                   : level * reach.horizontal.h_inf * c.bound.mean_horizontal +
                         upright * reach.vertical.h_inf * c.bound.mean_vertical;
    result.push_back((steps.own ? own_support(h[k], n) : prism_support(h[k], n)) + push +
                     level * first(reach.horizontal) + upright * first(reach.vertical) +
                     (steps.estimate ? 0.003 : v.estimation.position));
  }
  return result;
}

void print_table(const Place& place, const Vehicle& vehicle, const std::vector<Trajectory>& all) {
  const Calibrated c = calibrated(vehicle, 1);
  const Worlds worlds(place, vehicle, run_parallel);
  const plan::World world = worlds.make(c, {"", {}, {}}, run_parallel);
  std::vector<Look> looks(all.size());
  run_parallel(all.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      if (all[n].map == place.name) looks[n] = looked(world, vehicle, c, all[n], 8 * n);
  });
  std::vector<double> base;
  for (const Row& row : kRows) {
    const Widths widths(world.reach, c.bound.tau_w, row.steps.fine);
    std::vector<double> ratios, now;
    int flights = 0, accepted = 0, touched = 0;
    for (const Look& look : looks) {
      if (look.tube.empty()) continue;
      const auto clearance = asked(look, world, c, widths, row.steps);
      bool ok = true;
      for (std::size_t k = 0; k < clearance.size(); ++k) {
        ok = ok && look.distance[k] - vehicle.body.radius > clearance[k];
        if (look.distance[k] < kNear) now.push_back(clearance[k]);
      }
      ++flights;
      accepted += ok;
      touched += ok ? look.touched : 0;
    }
    if (base.empty()) base = now;
    for (std::size_t k = 0; k < now.size(); ++k) ratios.push_back(now[k] / base[k]);
    const auto median = [](std::vector<double> x) {
      const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
      std::nth_element(x.begin(), middle, x.end());
      return *middle;
    };
    std::printf("%s,%s,%s,%.4f,%.3f,%d,%d,%d\n", place.name.c_str(), vehicle.name.c_str(), row.name, median(now),
                median(ratios), accepted, flights, touched);
  }
}

}  // namespace

int print_factors(const std::string& folder) {
  std::printf("map,vehicle,step,median_m,ratio,accepted,trajectories,touched_of_4_each\n");
  auto all = rivals(folder);
  for (const char* const name : {"5in-shipped", "5in-px4", "5in-stiff"}) {
    for (const char* const map : {"forest-1", "corridors"}) print_table(place_named(map), vehicle_named(name), all);
    print_table(places(), vehicle_named(name), through_places(vehicle_named(name).body.radius, 40));
  }
  return 0;
}

}  // namespace backwash::race
