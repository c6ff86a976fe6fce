// SPDX-License-Identifier: BSD-3-Clause
// Whether the larger steps of flown.hpp fly as core/sim does: the error's deviation, and contacts.
#include <cstdio>

#include "core/sim/flight.hpp"
#include "services/parallel/parallel.hpp"
#include "tests/race/course.hpp"
#include "tests/race/flown.hpp"
#include "tests/race/race.hpp"

namespace backwash::race {
namespace {

constexpr double kAir = 4;
constexpr unsigned kSeeds = 3;

struct Deviations {
  Vec3 squares = Vec3::Zero();
  int samples = 0, touched = 0, flights = 0;
};

/// The loop of core/sim with Flown's face.
class Simulated {
 public:
  Simulated(const Place& place, const Vehicle& vehicle, const Vec3& at_W, std::uint64_t seed)
      : loop_(place.grid, vehicle, {at_W, Vec3::Zero()}, seed, {.strength = kAir}) {}
  void fly(const Setpoint& command) { loop_.fly(command); }
  State truth() { return loop_.sample({}, {}).truth; }

 private:
  sim::ClosedLoop loop_;
};

template <class Flight>
void add(Flight flight, const plan::Plan& plan, const Vec3& start_W, const Place& place, double radius, Deviations& d) {
  Setpoint hover;
  hover.p_W = start_W;
  for (int k = 0; k < 50; ++k) flight.fly(hover);
  bool touched = false;
  for (std::size_t k = 0; k < plan.commands.size(); ++k) {
    flight.fly(plan.commands[k]);
    const Vec3 p = flight.truth().p_W;
    d.squares += (p - plan.tube[k + 1].center.p_W).cwiseAbs2();
    ++d.samples;
    touched = touched || place.distance.exact(place.grid, p) < radius;
  }
  d.touched += touched;
  ++d.flights;
}

enum class As { simulated, fine, raced };

void compare(const Place& place, const Vehicle& vehicle, As as, const std::vector<sim::RoutePair>& pairs,
             const std::vector<plan::Plan>& plans) {
  std::vector<Deviations> each(pairs.size());
  run_parallel(pairs.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      for (unsigned k = 0; k < kSeeds && plans[n].status == plan::PlanStatus::ok; ++k) {
        const Vec3& at = pairs[n].start_W;
        const auto seed = pairs[n].seed + 17 * k + static_cast<unsigned>(as);
        const auto fly = [&](auto flight) {
          add(std::move(flight), plans[n], at, place, vehicle.body.radius, each[n]);
        };
        if (as == As::simulated) fly(Simulated(place, vehicle, at, seed));
        if (as == As::fine) fly(Flown(place.grid, vehicle, at, seed, kAir, 20, 0));
        if (as == As::raced) fly(Flown(place.grid, vehicle, at, seed, kAir));
      }
  });
  Deviations all;
  for (const auto& d : each) {
    all.squares += d.squares;
    all.samples += d.samples;
    all.touched += d.touched;
    all.flights += d.flights;
  }
  const Vec3 sd = (all.squares / all.samples).cwiseSqrt();
  constexpr const char* kNames[] = {"core/sim", "1 ms", "raced"};
  std::printf("%s,%s,%d,%d,%.4f,%.4f,%.4f\n", vehicle.name.c_str(), kNames[static_cast<int>(as)], all.flights,
              all.touched, sd.x(), sd.y(), sd.z());
  std::fflush(stdout);
}

}  // namespace

int compare_steps() {
  const Place place = place_named("corridors");
  const Way bare{"", {}, 0.0};
  std::printf("vehicle,as,flights,touched,sd_x_m,sd_y_m,sd_z_m\n");
  for (const char* const name : {"5in-shipped", "5in-px4", "5in-stiff", "35g-firm", "5in-soft"}) {
    const Vehicle& vehicle = vehicle_named(name);
    const auto world = Worlds(place, vehicle, run_parallel).make({}, bare, run_parallel);
    const auto pairs = pairs_of(place, vehicle, 150);
    std::vector<plan::Plan> plans;
    for (const auto& pair : pairs) plans.push_back(planned(world, pair, 1.5));
    for (const As as : {As::simulated, As::fine, As::raced}) compare(place, vehicle, as, pairs, plans);
  }
  return 0;
}

}  // namespace backwash::race
