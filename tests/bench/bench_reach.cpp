// SPDX-License-Identifier: BSD-3-Clause
// Cost of a step of the reachable sets in one run, beside the paper's literal per-step Lyapunov solve.
#include <benchmark/benchmark.h>

#include <Eigen/LU>
#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <unsupported/Eigen/KroneckerProduct>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world/world.hpp"
#include "core/reach/clearance.hpp"
#include "core/reach/reach_tube.hpp"

namespace {

using namespace backwash;
using namespace backwash::reach;

constexpr const char* kBaseline = "literal_lyapunov";
constexpr std::size_t kSteps = 1000;  // per iteration
constexpr double kPlan = 100;         // steps of a tube

Vehicle vehicle() { return *config::load_vehicle("builtin:quad-5in"); }

const std::vector<DisturbanceBound>& bounds() {
  static const std::vector<DisturbanceBound> all = [] {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0.2, 2);
    std::vector<DisturbanceBound> drawn(kSteps);
    for (DisturbanceBound& b : drawn)
      for (double& w : b.w) w = uniform(random);
    return drawn;
  }();
  return all;
}
Vec3 channels(const DisturbanceBound& b) { return {b.w[kX], b.w[kY], b.w[kZ]}; }

void count(benchmark::State& state, double steps, double directions) {
  state.counters["steps"] = steps;
  state.counters["directions"] = directions;
}

/// The paper's step with dense 6×6 matrices. literal: every X_i is solved for in every step, as written, by one LU of
/// the 36×36 Kronecker form for all three channels; e^{Φdt} is computed once, in the baseline's favour.
class DensePaper {
 public:
  DensePaper(const Vehicle& v, bool literal) : literal_(literal) {
    Phi_.setZero();
    Phi_.topRightCorner<3, 3>().setIdentity();
    const auto& c = v.controller;
    Phi_.bottomLeftCorner<3, 3>().diagonal() << -c.kp.horizontal, -c.kp.horizontal, -c.kp.vertical;
    Phi_.bottomRightCorner<3, 3>().diagonal() << -c.kd.horizontal, -c.kd.horizontal, -c.kd.vertical;
    transition_ = (Phi_ * kControlPeriod).exp();
    back_ = (-Phi_ * kControlPeriod).exp();
    Q_.setZero();
    Q_.diagonal().head<3>().setConstant(v.initial_error.position * v.initial_error.position);
    Q_.diagonal().tail<3>().setConstant(v.initial_error.velocity * v.initial_error.velocity);
    X_ = solve();
  }
  void step(const Vec3& w) {
    if (literal_) X_ = solve();
    constexpr double dt = kControlPeriod;
    double sum = 0;
    Mat6 Q_d = Mat6::Zero();
    for (int i = 0; i < 3; ++i) {
      const Mat6 Q_i = dt * w[i] * w[i] * X_[static_cast<std::size_t>(i)] + 1e-10 * dt * dt * Mat6::Identity();
      const double root = std::sqrt(Q_i.trace());
      sum += root;
      Q_d += Q_i / root;
    }
    Q_d *= sum;
    const double a = std::sqrt(Q_.trace()), b = std::sqrt(Q_d.trace());
    Q_ = (transition_ * ((1 + b / a) * Q_ + (1 + a / b) * Q_d) * transition_.transpose()).eval();
  }
  const Mat6& Q() const { return Q_; }

 private:
  std::array<Mat6, 3> solve() const {
    using Kronecker = Eigen::Matrix<double, 36, 36>;
    const Mat6 I = Mat6::Identity();
    const Kronecker K = -(Kronecker(Eigen::kroneckerProduct(I, Phi_)) + Kronecker(Eigen::kroneckerProduct(Phi_, I)));
    const Eigen::PartialPivLU<Kronecker> lu(K);
    std::array<Mat6, 3> X;
    for (int i = 0; i < 3; ++i) {
      Mat6 D = Mat6::Zero();
      D(3 + i, 3 + i) = 1;
      const Mat6 right = back_ * D * back_.transpose() - D;
      const Eigen::Matrix<double, 36, 1> x = lu.solve(Eigen::Map<const Eigen::Matrix<double, 36, 1>>(right.data()));
      X[static_cast<std::size_t>(i)] = Eigen::Map<const Mat6>(x.data());
    }
    return X;
  }

  bool literal_;
  Mat6 Phi_, transition_, back_, Q_;
  std::array<Mat6, 3> X_;
};

void dense(benchmark::State& state, bool literal) {
  const Vehicle v = vehicle();
  DensePaper paper(v, literal);
  EllipsoidRecursion reference(v);
  for (int k = 0; k < 50; ++k) {
    paper.step(channels(bounds()[0]));
    reference.step(channels(bounds()[0]));
  }
  if ((paper.Q() - reference.Q()).norm() > 1e-9 * reference.Q().norm()) {
    state.SkipWithError("the dense step differs from EllipsoidRecursion");
    return;
  }
  const std::size_t steps = literal ? 50 : kSteps;
  for (auto _ : state)
    for (std::size_t k = 0; k < steps; ++k) paper.step(channels(bounds()[k]));
  benchmark::DoNotOptimize(paper.Q().sum());
  count(state, static_cast<double>(steps), 0);
}

void paper_blocks(benchmark::State& state) {
  EllipsoidRecursion paper(vehicle());
  for (auto _ : state)
    for (const DisturbanceBound& b : bounds()) paper.step(channels(b));
  benchmark::DoNotOptimize(paper.position_shape().sum());
  count(state, kSteps, 0);
}

/// Steps with a full history.
void supports(benchmark::State& state, Loop loop, bool between) {
  const Reachability reach(vehicle(), Method::tight, loop);
  SupportRecursion sets(reach.horizontal, reach.vertical, reach.vehicle);
  for (const DisturbanceBound& b : bounds()) sets.step(b);
  for (auto _ : state)
    for (const DisturbanceBound& b : bounds()) {
      sets.step(b);
      benchmark::DoNotOptimize(between ? sets.half_widths_until_next(b) : sets.half_widths());
    }
  count(state, kSteps, kDirections);
  state.counters["taps"] = static_cast<double>(reach.horizontal.G.size());
}

const plan::World& world() {
  static const auto built =
      plan::build_world(*map::load_map("builtin:apartment"), *config::load_model("builtin:quad-5in"), vehicle());
  return *built;
}

/// Through the free space of the apartment at 1 m/s.
std::vector<Setpoint> flight(const plan::World& w) {
  Vec3 from = Vec3::Zero();
  double roomiest = 0;
  for (std::size_t n = 0; n < w.grid.cell_count(); ++n) {
    const Vec3 p = w.grid.center(w.grid.voxel(n));
    double least = 1e9;
    for (double s = 0; s <= 2.0; s += 0.1) least = std::min(least, w.distance.interpolated(p + s * Vec3::UnitX()));
    if (least > roomiest) {
      roomiest = least;
      from = p;
    }
  }
  std::vector<Setpoint> commands;
  for (double k = 0; k < kPlan; ++k) commands.push_back({from + k * kControlPeriod * Vec3::UnitX(), Vec3::UnitX()});
  return commands;
}

void tube(benchmark::State& state, Loop loop) {
  const plan::World& w = world();
  const std::vector<Setpoint> commands = flight(w);
  const Reachability reach(vehicle(), Method::tight, loop);
  const State start{commands[0].p_W, commands[0].v_W};
  for (auto _ : state) benchmark::DoNotOptimize(tube_over_field(reach, start, commands[0], commands, w.bounds));
  count(state, kPlan, kDirections);
}

void tube_with_given_bounds(benchmark::State& state) {
  const Reachability reach(vehicle());
  const std::vector<Setpoint> commands(static_cast<std::size_t>(kPlan));
  const auto some = std::span(bounds()).first(commands.size());
  for (auto _ : state) benchmark::DoNotOptimize(tube_with_bounds(reach, {}, {}, commands, some));
  count(state, kPlan, kDirections);
}

void centre_start(benchmark::State& state) {
  const Vehicle v = vehicle();
  for (auto _ : state) benchmark::DoNotOptimize(CentrePredictor(v, Loop::vehicle, {}, Vec3::Zero(), {}));
}
void centre_steps(benchmark::State& state) {
  CentrePredictor centre(vehicle(), Loop::vehicle, {}, Vec3::Zero(), {});
  for (auto _ : state)
    for (int k = 0; k < 100; ++k) benchmark::DoNotOptimize(centre.step({}));
}

BENCHMARK_CAPTURE(dense, literal_lyapunov, true)->Name(kBaseline);
BENCHMARK_CAPTURE(dense, constant_X, false)->Name("paper_dense");
BENCHMARK(paper_blocks);
BENCHMARK_CAPTURE(supports, fir, Loop::vehicle, false)->Name("tight_vehicle_fir");
BENCHMARK_CAPTURE(supports, fir_between, Loop::vehicle, true)->Name("tight_vehicle_fir_between");
BENCHMARK_CAPTURE(supports, delay, Loop::continuous, false)->Name("tight_second_order");
BENCHMARK_CAPTURE(supports, delay_between, Loop::continuous, true)->Name("tight_second_order_between");
BENCHMARK_CAPTURE(supports, sampled, Loop::sampled, false)->Name("tight_sampled_fir");
BENCHMARK(tube_with_given_bounds);
BENCHMARK_CAPTURE(tube, vehicle, Loop::vehicle)->Name("tube_100_apartment_vehicle");
BENCHMARK_CAPTURE(tube, continuous, Loop::continuous)->Name("tube_100_apartment_second_order");
BENCHMARK(centre_start);
BENCHMARK(centre_steps);

/// Adds a table of costs per step, and what a step of the baseline costs in it.
class Ratios : public benchmark::ConsoleReporter {
 public:
  Ratios() : ConsoleReporter(OO_None) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      const auto steps = run.counters.find("steps");
      if (run.error_occurred || steps == run.counters.end()) continue;
      const double seconds = run.cpu_accumulated_time / static_cast<double>(run.iterations);
      rows_.push_back({run.benchmark_name(), 1e9 * seconds / steps->second, run.counters.at("directions")});
    }
  }
  void Finalize() override {
    ConsoleReporter::Finalize();
    double baseline = 0;
    for (const Row& row : rows_)
      if (row.name == kBaseline) baseline = row.step_ns;
    std::printf("\n%-34s %12s %12s %14s   thread CPU time\n", "", "ns/step", "per direction", "baseline/this");
    for (const Row& row : rows_) {
      std::printf("%-34s %12.1f ", row.name.c_str(), row.step_ns);
      row.directions > 0 ? std::printf("%12.1f ", row.step_ns / row.directions) : std::printf("%12s ", "");
      baseline > 0 ? std::printf("%14.1f\n", baseline / row.step_ns) : std::printf("\n");
    }
  }

 private:
  struct Row {
    std::string name;
    double step_ns, directions;
  };
  std::vector<Row> rows_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  Ratios reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  return 0;
}
