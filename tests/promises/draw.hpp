// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>

#include "core/plan/world/world.hpp"
#include "tests/promises/motion.hpp"

namespace backwash::promises {

/// What is drawn belongs to one of a thousand blocks. `./check` draws block 0, tests/nightly/promises.sh all of them.
/// The block is BACKWASH_PROMISES_BLOCK, 0 where that is not set; BACKWASH_PROMISES_CASE draws one case of it alone.
unsigned block();

/// Draws of one case: by its kind, its number and the block alone, so that a case that fails is drawn again alone.
class Random {
 public:
  Random(unsigned kind, unsigned number);
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(source_); }
  /// Even over the orders of magnitude.
  double magnitude(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(source_); }  ///< both included
  bool chance(double p) { return uniform(0, 1) < p; }
  double normal() { return normal_(source_); }
  Vec3 within(const Vec3& low, const Vec3& high) {
    return {uniform(low.x(), high.x()), uniform(low.y(), high.y()), uniform(low.z(), high.z())};
  }

 private:
  std::mt19937_64 source_;
  std::normal_distribution<double> normal_;
};

/// A vehicle within the ranges of a vehicle file whose loop is stable (docs/model.md 4-3), delay and latency multiples
/// of the oracle's step.
struct DrawnVehicle {
  Vehicle vehicle;
  bool sampled = false;  ///< for --loop sampled
  int per_period = 0;    ///< steps of the oracle in 20 ms
  int latency = 0;       ///< in these steps
  Plant plant(bool vertical, bool integrator) const;
};
DrawnVehicle draw_vehicle(Random& random, bool integrator, bool sampled);

/// The case's own words for what did not hold.
struct Broken : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// Throws Broken where `value` is above `most`, or no number.
void demand_at_most(double value, double most, const std::string& what);
/// Draws the cases 0 … count − 1 of a kind; those that throw Broken fail the test by number, the tenth ends it.
void draw_all(unsigned kind, unsigned count, const std::function<void(Random&)>& draw);

/// What kinds of air a map is drawn with.
struct DrawnModel {
  Model model;
  AirFactors factors = kModelledAir;
};
/// `gusts`: false: a steady push alone.
DrawnModel draw_model(Random& random, bool gusts);

/// Free space with boxes of occupied and unknown voxels, and often a mapper's window: unknown beyond a box.
map::OccupancyGrid draw_map(Random& random, const Index3& least, const Index3& most, bool window);
/// A box of voxels, which may reach beyond the map, becomes `cell`; returns what changed.
map::VoxelBox draw_box(Random& random, map::OccupancyGrid& grid, map::Cell cell, int longest);

}  // namespace backwash::promises
