// SPDX-License-Identifier: BSD-3-Clause
// Cost of a tick of core/adapt beside the same bets with a logarithm each, in one run.
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
#include "core/log/air_log.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world.hpp"

namespace {

using namespace backwash;
using namespace backwash::adapt;

std::vector<AirSample> samples() {
  std::mt19937_64 rng(1);
  std::normal_distribution<double> normal;
  std::vector<AirSample> all;
  for (int k = 0; k < 6000; ++k)
    all.push_back(
        {0.02 * k, 0.1 * Vec3(normal(rng), normal(rng), normal(rng)), Vec3(0.01, 0.02, 0.01), AirClass::wall});
  return all;
}

/// As the equations are written: every bet's logarithm in every innovation, every mean of exponentials. Bets that it is
/// calmer, one in twelve correlation times, are left out.
class LogEachBet {
 public:
  double add(const Innovation& i) {
    double told = 0;
    for (std::size_t k = 0; k < Bets::kRougher.size(); ++k) {
      double x = 0, sum = 0;
      for (int axis = 0; axis < 3; ++axis)
        x += std::min(kMostSquare, i.square[axis] / (Bets::kRougher[k] * i.most + i.beside[axis])) / 3;
      for (std::size_t j = 0; j < Bets::kStakes.size(); ++j) {
        ln_[k][j] += std::log1p(Bets::kStakes[j] * (x - 1));
        since_[k][j] = std::log(std::exp(since_[k][j]) + i.seconds) + std::log1p(Bets::kStakes[j] * (x - 1));
        sum += std::exp(ln_[k][j]) + std::exp(since_[k][j]);
      }
      told += sum;
    }
    return told;
  }

 private:
  std::array<std::array<double, 3>, Bets::kRougher.size()> ln_{}, since_{};
};

constexpr const char* kBaseline = "log_each_bet";

void log_each_bet(benchmark::State& state) {
  const auto all = samples();
  Innovations innovations{Gusts{}};
  LogEachBet bets;
  double t = 0;
  for (auto _ : state)
    for (AirSample sample : all) {
      sample.t_s = t += 0.02;
      if (const auto i = innovations.add(sample)) benchmark::DoNotOptimize(bets.add(*i));
    }
  state.counters["ticks"] = static_cast<double>(all.size());
}

void tick(benchmark::State& state) {
  const auto all = samples();
  Adaptation adaptation{Gusts{}};
  double t = 0;
  for (auto _ : state)
    for (AirSample sample : all) {
      sample.t_s = t += 0.02;
      benchmark::DoNotOptimize(adaptation.add(sample));
    }
  state.counters["ticks"] = static_cast<double>(all.size());
}

BENCHMARK(log_each_bet)->Name(kBaseline);
BENCHMARK(tick)->Name("adaptation_add");

/// Adds the cost of a tick, and what the baseline costs in it.
class Ratios : public benchmark::ConsoleReporter {
 public:
  Ratios() : ConsoleReporter(OO_None) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      const double seconds = run.cpu_accumulated_time / static_cast<double>(run.iterations);
      const double ns = 1e9 * seconds / run.counters.at("ticks");
      if (run.benchmark_name() == kBaseline) baseline_ = ns;
      std::printf("%-20s %8.1f ns/tick, baseline/this %.1f\n", run.benchmark_name().c_str(), ns, baseline_ / ns);
    }
  }

 private:
  double baseline_ = 0;
};

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
      plan::with_air(*plan::build_world(map::builtin_scene("parallel-walls-2m", 0.1).value(), Model{}, vehicle),
                     kModelledAir, Model{});
  InFlightConstants constants;
  constants.controller = vehicle.controller;
  InFlight air(constants);
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
      benchmark::DoNotOptimize(log::learn(air, flight, out, r));
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

/// Single ticks by the monotonic clock, its own cost in them.
void spread() {
  const auto all = samples();
  Adaptation adaptation{Gusts{}};
  std::vector<double> ns, empty;
  double t = 0;
  for (int turn = 0; turn < 20; ++turn)
    for (AirSample sample : all) {
      sample.t_s = t += 0.02;
      const double before = now();
      benchmark::DoNotOptimize(adaptation.add(sample));
      const double after = now();
      ns.push_back(after - before), empty.push_back(now() - after);
    }
  std::ranges::sort(ns), std::ranges::sort(empty);
  const auto at = [](const std::vector<double>& x, double share) {
    return x[static_cast<std::size_t>(share * x.size())];
  };
  std::printf("single ticks, ns: p50 %.0f, p99 %.0f, p99.9 %.0f; the clock alone: p50 %.0f, p99 %.0f\n", at(ns, 0.5),
              at(ns, 0.99), at(ns, 0.999), at(empty, 0.5), at(empty, 0.99));
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
        plan::with_air(*plan::build_world(map::builtin_scene(scene).value(), Model{}, vehicle), kModelledAir, Model{});
    for (int turn = 0; turn < 3; ++turn) {
      const double begun = cpu_ms();
      plan::World anew = *known;
      anew.air.factors = {2, 2, 2, 2, 1};
      anew.bounds = reach::BoundField(anew.grid, anew.air.flown(), Model{}.bound, known->bounds.extension());
      benchmark::DoNotOptimize(plan::with_clearance_by(std::move(anew), known->reach.method, known->constant_margin));
      const double between = cpu_ms();
      benchmark::DoNotOptimize(plan::with_air(*known, {2, 2, 2, 2, 1}, Model{}));
      std::printf("%s in rougher air, ms of CPU: all anew %.1f, with_air %.1f\n", scene, between - begun,
                  cpu_ms() - between);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  Ratios reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  spread();
  spread_in_the_daemon();
  worlds();
  return 0;
}
