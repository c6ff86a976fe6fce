// SPDX-License-Identifier: BSD-3-Clause
// Cost of a tick of core/adapt, of the daemon's with it, and of a world in rougher air.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <random>
#include <vector>

#include "core/adapt/in_flight.hpp"
#include "core/config/config.hpp"
#include "core/log/raw/air_log.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world/world.hpp"

namespace {

using namespace backwash;
using namespace backwash::adapt;

constexpr int kTicks = 6000;

/// A flight along a line in noise; the loop late by 30 ms is the dearest: its centre goes in steps of 1 ms.
std::vector<AirTick> flown() {
  std::mt19937_64 rng(1);
  std::normal_distribution<double> normal;
  std::vector<AirTick> ticks(kTicks);
  for (int k = 0; k < kTicks; ++k) {
    AirTick& tick = ticks[static_cast<std::size_t>(k)];
    tick.now_ns = 20'000'000LL * k;
    tick.age_s = 0.01;
    tick.air = AirClass::wall;
    tick.sigma = Vec3(0.01, 0.02, 0.01);
    tick.command.p_W.x() = std::sin(0.01 * k);
    tick.command.v_W.x() = 0.5 * std::cos(0.01 * k);
    tick.state.p_W = tick.command.p_W + 0.01 * Vec3(normal(rng), normal(rng), normal(rng));
    tick.state.v_W = tick.command.v_W;
  }
  return ticks;
}

InFlight learner(double feedback_delay) {
  InFlightConstants constants;
  constants.controller = config::load_vehicle("builtin:quad-5in").value().controller;
  constants.controller.feedback_delay = feedback_delay;
  return InFlight(constants);
}

void tick(benchmark::State& state) {
  const auto ticks = flown();
  InFlight air = learner(1e-3 * static_cast<double>(state.range(0)));
  std::int64_t shift = 0;
  for (auto _ : state) {
    for (AirTick tick : ticks) {
      tick.now_ns += shift;
      benchmark::DoNotOptimize(air.add(tick));
    }
    shift += kTicks * 20'000'000LL;
  }
  state.SetItemsProcessed(state.iterations() * kTicks);
}
BENCHMARK(tick)->Name("in_flight_add_delay_ms")->Arg(0)->Arg(30);

double now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1e9 * static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec);
}

/// The daemon's tick by the monotonic clock: its decision alone, and with what it learns of the air (Σ and class at the
/// place, the update, its record). By turns, so that both see the same machine.
void spread_in_the_daemon() {
  const Vehicle vehicle = config::load_vehicle("builtin:quad-5in").value();
  const auto world =
      plan::rebuilt(*plan::build_world(map::builtin_scene("parallel-walls-2m", 0.1).value(), Model{}, vehicle),
                    {.air = kModelledAir});
  InFlight air = learner(0);
  track::FlightTick flight(vehicle, 0);
  std::array<std::vector<double>, 2> ns;
  std::mt19937_64 rng(1);
  std::normal_distribution<double> normal;
  std::array<std::uint8_t, 512> ring{};
  track::TickInput in;
  for (int k = 0; k < 120'000; ++k) {
    in.now_ns += 20'000'000;
    track::OdometrySample s;
    s.received_ns = s.stamp_ns = in.now_ns;
    s.state.p_W = Vec3(0.3 * std::sin(0.002 * k), 0, 1.2);
    s.state.v_W = 0.002 * Vec3(normal(rng), normal(rng), normal(rng));
    in.odometry = s;
    const bool learns = k % 4 >= 2;  // two in a row: half of them after one that learnt too
    const double before = now();
    const auto out = flight.step(in);
    if (learns) {
      const auto place = plan::air_at(world->air, world->grid, flight.odometry()->state.p_W);
      log::AirRecord r{};
      std::copy_n(place.sigma.data(), 3, r.sigma);
      r.air = static_cast<std::uint32_t>(place.air);
      benchmark::DoNotOptimize(log::learn(air, in, flight, out, r));
      std::memcpy(ring.data(), &r, sizeof r);
    }
    ns[learns].push_back(now() - before);
    benchmark::DoNotOptimize(ring);
  }
  for (auto& x : ns) std::ranges::sort(x);
  const auto at = [&](std::size_t learns, double share) {
    return ns[learns][static_cast<std::size_t>(share * static_cast<double>(ns[learns].size()))];
  };
  std::printf("the daemon's decision, ns: p50 %.0f, p99 %.0f; with what it learns: p50 %.0f, p99 %.0f\n", at(0, 0.5),
              at(0, 0.99), at(1, 0.5), at(1, 0.99));
}

/// Single ticks by the monotonic clock, its own cost in them: most step the centre, each 42nd bets.
void spread(double feedback_delay) {
  const auto ticks = flown();
  InFlight air = learner(feedback_delay);
  std::vector<double> ns, empty;
  std::int64_t shift = 0;
  for (int turn = 0; turn < 20; ++turn, shift += kTicks * 20'000'000LL)
    for (AirTick tick : ticks) {
      tick.now_ns += shift;
      const double before = now();
      benchmark::DoNotOptimize(air.add(tick));
      const double after = now();
      ns.push_back(after - before);
      empty.push_back(now() - after);
    }
  std::ranges::sort(ns);
  std::ranges::sort(empty);
  const auto at = [](const std::vector<double>& x, double share) {
    return x[static_cast<std::size_t>(share * static_cast<double>(x.size()))];
  };
  std::printf("single ticks, delay %g s, ns: p50 %.0f, p99 %.0f, p99.9 %.0f; the clock alone: p50 %.0f, p99 %.0f\n",
              feedback_delay, at(ns, 0.5), at(ns, 0.99), at(ns, 0.999), at(empty, 0.5), at(empty, 0.99));
}

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// A world for a factor that grew, beside the same with loop, bounds and all places to hover made anew; one thread.
void worlds() {
  const auto vehicle = config::load_vehicle("builtin:quad-5in").value();
  for (const char* scene : {"narrow-gap", "apartment"}) {
    const auto known =
        plan::rebuilt(*plan::build_world(map::builtin_scene(scene).value(), Model{}, vehicle), {.air = kModelledAir});
    for (int turn = 0; turn < 3; ++turn) {
      const double begun = cpu_ms();
      plan::World anew = *known;
      anew.air.factors = {2, 2, 2, 2, 1};
      const map::VoxelBox all = map::all_of(anew.grid.size());
      const auto voxels = plan::voxels_for_centre(anew.grid, anew.distance, vehicle, all);
      anew.bounds = reach::BoundField(anew.grid, Model{}.bound);
      anew.bounds.update(all, voxels, [&](const auto& store) {
        for (const std::size_t n : voxels) store(n, anew.air.flown_at(n));
      });
      const plan::Clearance clearance{plan::sets_of(vehicle, known->reach.method)};
      benchmark::DoNotOptimize(plan::rebuilt(std::move(anew), {.clearance = clearance}));
      const double between = cpu_ms();
      benchmark::DoNotOptimize(plan::rebuilt(*known, {.air = AirFactors{2, 2, 2, 2, 1}}));
      std::printf("%s in rougher air, ms of CPU: all anew %.1f, rebuilt %.1f\n", scene, between - begun,
                  cpu_ms() - between);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  spread(0);
  spread(0.03);
  spread_in_the_daemon();
  worlds();
  return 0;
}
