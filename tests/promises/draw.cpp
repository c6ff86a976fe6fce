// SPDX-License-Identifier: BSD-3-Clause
#include "tests/promises/draw.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iomanip>
#include <sstream>

namespace backwash::promises {
namespace {

/// docs/model.md 4-3 at the one crossover.
bool stable(const Plant& plant) {
  const double delay = plant.delay * plant.step();
  const auto gain = [&](double w) {
    return std::hypot(plant.kp, plant.kd * w) * std::hypot(1, plant.ki / (plant.kd * w)) /
           (w * w * std::hypot(1, plant.lag * w));
  };
  double low = 1e-6, high = 1e6;
  for (int n = 0; n < 200; ++n) {
    const double middle = std::sqrt(low * high);
    (gain(middle) > 1 ? low : high) = middle;
  }
  const double late = std::atan(plant.lag * high) + delay * high + std::atan(plant.ki / (plant.kd * high));
  return std::atan(plant.kd * high / plant.kp) > late;
}

void draw_gains(Random& random, double& kp, double& kd) {
  switch (random.whole(0, 3)) {
    case 0:  // PX4's defaults
      kp = 1.71;
      kd = 1.8;
      break;
    case 1:  // its cascade
      kd = random.magnitude(0.3, 20);
      kp = kd * random.magnitude(0.1, 20);
      break;
    default:  // slow ones are dear: N of docs/model.md 5.2-2 grows with k_d/k_p
      do {
        kp = random.magnitude(0.1, 200);
        kd = random.magnitude(0.2, 100);
      } while (kp < 0.3 * kd && !random.chance(0.03));
  }
}

int set(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : otherwise;
}

}  // namespace

unsigned block() { return static_cast<unsigned>(set("BACKWASH_PROMISES_BLOCK", 0)); }

Random::Random(unsigned kind, unsigned number) {
  std::seed_seq seeds{block(), kind, number};
  source_.seed(seeds);
}

Plant DrawnVehicle::plant(bool vertical, bool integrator) const {
  const auto& c = vehicle.controller;
  const auto of = [vertical](const Vehicle::HorizontalVertical& x) { return vertical ? x.vertical : x.horizontal; };
  Plant plant{of(c.kp), of(c.kd), integrator ? of(c.velocity_integrator) : 0, c.attitude_lag, 0, per_period};
  plant.delay = static_cast<int>(std::lround(c.feedback_delay / plant.step()));
  plant.sampled = sampled;
  return plant;
}

void demand_at_most(double value, double most, const std::string& what) {
  if (value <= most) return;
  std::ostringstream numbers;
  numbers << what << ": " << std::setprecision(10) << value << " > " << most;
  throw Broken(numbers.str());
}

void draw_all(unsigned kind, unsigned count, const std::function<void(Random&)>& draw) {
  const int alone = set("BACKWASH_PROMISES_CASE", -1);
  for (unsigned number = 0, broken = 0; number < count && broken < 10; ++number) {
    if (alone >= 0 && number != static_cast<unsigned>(alone)) continue;
    Random random(kind, number);
    try {
      draw(random);
    } catch (const Broken& what) {
      ADD_FAILURE() << "block " << block() << ", case " << number << ": " << what.what(), ++broken;
    }
  }
}

DrawnVehicle draw_vehicle(Random& random, bool integrator, bool sampled) {
  DrawnVehicle drawn;
  drawn.sampled = sampled;
  Vehicle& v = drawn.vehicle;
  auto& c = v.controller;
  drawn.per_period = sampled ? random.whole(4, 6) : random.whole(10, 20);
  const double step = kControlPeriod / drawn.per_period;
  const int longest = static_cast<int>(0.3 / step);
  drawn.latency = random.chance(0.2) ? 0 : random.whole(0, longest);
  int delay = random.chance(0.3) ? 0 : static_cast<int>(random.magnitude(1, longest));
  c.attitude_lag = random.chance(0.2) ? 0 : random.magnitude(1e-3, 1);
  draw_gains(random, c.kp.horizontal, c.kd.horizontal);
  draw_gains(random, c.kp.vertical, c.kd.vertical);
  const auto gain = [&] { return integrator ? random.magnitude(0.05, 20) : 0.0; };
  c.velocity_integrator = {gain(), gain()};
  const auto may_fly = [&] {
    c.feedback_delay = delay * step;
    return stable(drawn.plant(false, true)) && stable(drawn.plant(true, true));
  };
  while (!may_fly()) {  // so that many lie close to what is just stable
    switch (random.whole(0, 3)) {
      case 0:
        delay /= 2;
        break;
      case 1:
        c.attitude_lag /= 2;
        break;
      case 2:
        c.velocity_integrator.horizontal /= 2;
        c.velocity_integrator.vertical /= 2;
        break;
      default:
        for (auto [kp, kd] : {std::pair(&c.kp.horizontal, &c.kd.horizontal), {&c.kp.vertical, &c.kd.vertical}})
          if (*kp > 0.5 * *kd * *kd) *kp /= 2;
    }
  }
  c.latency = drawn.latency * step;
  v.limits = {.v_max = random.magnitude(0.2, 20), .a_max = random.magnitude(0.2, 30)};
  v.initial_error = {.position = random.chance(0.2) ? 0 : random.magnitude(1e-3, 1),
                     .velocity = random.chance(0.2) ? 0 : random.magnitude(1e-3, 5)};
  v.body.radius = random.uniform(0.05, 0.3);
  v.body.diagonal_radius = v.body.radius;
  v.estimation.position = random.uniform(0, 0.05);
  return drawn;
}

DrawnModel draw_model(Random& random, bool gusts) {
  DrawnModel drawn;
  Model& m = drawn.model;
  const auto scale = [&](double& amplitude) { amplitude *= gusts ? random.magnitude(0.1, 10) : 0; };
  scale(m.base.horizontal);
  scale(m.base.vertical);
  scale(m.ground.lambda.horizontal);
  scale(m.ground.lambda.vertical);
  scale(m.ground.k1.horizontal);
  scale(m.ground.k1.vertical);
  scale(m.corner.lambda.normal);
  scale(m.corner.lambda.tangential);
  scale(m.corner.lambda.vertical);
  scale(m.wall.k1.normal);
  scale(m.wall.k1.tangential);
  scale(m.wall.k1.vertical);
  m.ground.l_max = random.uniform(0.3, 2);
  m.ground.l_footprint_max = random.uniform(0.3, 4);
  m.corner.l_max = random.uniform(0.3, 1.5);
  m.wall.l_max = random.uniform(0.3, 1.5);
  m.bound.kappa = random.uniform(1, 4);
  m.bound.tau_w = random.uniform(0.05, 0.5);
  m.bound.mean_horizontal = gusts && random.chance(0.5) ? 0 : random.uniform(0.01, 0.3);
  m.bound.mean_vertical = gusts && random.chance(0.5) ? 0 : random.uniform(0.01, 0.3);
  if (gusts && random.chance(0.5))
    for (double& factor : drawn.factors) factor = random.chance(0.3) ? 1 : random.magnitude(0.5, 8);
  return drawn;
}

map::VoxelBox draw_box(Random& random, map::OccupancyGrid& grid, map::Cell cell, int longest) {
  map::VoxelBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = random.whole(-longest / 2, grid.size()[axis] - 1);
    box.high[axis] = box.low[axis] + random.whole(0, longest - 1);
  }
  map::VoxelBox changed;
  map::for_each_voxel(map::common(box, map::all_of(grid.size())), [&](const Index3& v) {
    if (grid.at(v) != cell) {
      grid.set(v, cell);
      changed.add(v);
    }
  });
  return changed;
}

map::OccupancyGrid draw_map(Random& random, const Index3& least, const Index3& most, bool window) {
  Index3 size;
  for (int axis = 0; axis < 3; ++axis) size[axis] = random.whole(least[axis], most[axis]);
  map::OccupancyGrid grid(random.within(Vec3::Constant(-5), Vec3::Constant(5)), random.magnitude(0.08, 0.4), size,
                          map::Cell::free);
  for (int n = random.whole(0, 4); n > 0; --n)
    draw_box(random, grid, random.chance(0.8) ? map::Cell::occupied : map::Cell::unknown, size.maxCoeff() / 2 + 1);
  if (random.chance(0.7))  // a floor
    for (int i = 0; i < size.x(); ++i)
      for (int j = 0; j < size.y(); ++j) grid.set({i, j, 0}, map::Cell::occupied);
  if (!window) return grid;
  Index3 low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = random.whole(0, size[axis] / 4);
    high[axis] = size[axis] - 1 - random.whole(0, size[axis] / 4);
  }
  map::for_each_voxel(map::all_of(size), [&](const Index3& v) {
    if (!map::VoxelBox{low, high}.contains(v)) grid.set(v, map::Cell::unknown);
  });
  return grid;
}

}  // namespace backwash::promises
