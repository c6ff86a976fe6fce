// SPDX-License-Identifier: BSD-3-Clause
// Plans the pairs of a race file (../shared/data/race/README.md: start and goal of each pair) and tells what each stage
// costs: CPU ms of the thread, the median of five calls a pair; instructions where the kernel counts them.
//   plan_timings --pairs FILE [--v V] [--calls N] [--json]
#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"
#include "core/types/quantile.hpp"

namespace {

using namespace backwash;
using Json = nlohmann::ordered_json;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// Instructions of this thread in user space; -1 where the kernel does not count them.
class Instructions {
 public:
  Instructions() {
    perf_event_attr asked{};
    asked.type = PERF_TYPE_HARDWARE;
    asked.size = sizeof asked;
    asked.config = PERF_COUNT_HW_INSTRUCTIONS;
    asked.exclude_kernel = 1;
    file_ = static_cast<int>(::syscall(SYS_perf_event_open, &asked, 0, -1, -1, 0));
  }
  double now() const {
    std::uint64_t count = 0;
    return file_ >= 0 && ::read(file_, &count, sizeof count) == sizeof count ? static_cast<double>(count) : -1;
  }

 private:
  int file_;
};

struct Query {
  Vec3 start, goal;
};

/// The pairs of a file and its map, each once.
std::pair<std::string, std::vector<Query>> read_pairs(const std::string& path) {
  std::ifstream file(path);
  std::string line, map;
  std::map<int, Query> pairs;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::ranges::replace(line, ',', ' ');
    std::istringstream cells(line);
    std::string planner;
    double margin = 0, v = 0;
    int pair = 0;
    Query q;
    if (cells >> planner >> margin >> map >> v >> pair >> q.start.x() >> q.start.y() >> q.start.z() >> q.goal.x() >>
        q.goal.y() >> q.goal.z())
      pairs[pair] = q;
  }
  std::vector<Query> all;
  for (const auto& [n, q] : pairs) all.push_back(q);
  return {map, all};
}

/// The flight time of a trajectory from rest, s, were its limits of the norm: stretched or shortened to keep them.
double time_by_norm(const plan::BSpline& trajectory, double v_max, double a_max) {
  double v = 0, a = 0;
  for (double t = 0; t < trajectory.duration(); t += 0.01) {
    v = std::max(v, trajectory.derivative(t, 1).norm());
    a = std::max(a, trajectory.derivative(t, 2).norm());
  }
  return trajectory.duration() * std::max(v / v_max, std::sqrt(a / a_max));
}

Json quantiles(std::vector<double> x) {
  if (x.empty()) return nullptr;
  return {{"p50", quantile(x, 0.5)}, {"p95", quantile(x, 0.95)}, {"max", std::ranges::max(x)}};
}

}  // namespace

int main(int argc, char** argv) {
  std::string pairs;
  double v_max = 1.5;
  int calls = 5;
  bool json = false;
  for (int k = 1; k < argc; ++k) {
    if (std::strcmp(argv[k], "--pairs") == 0 && k + 1 < argc) pairs = argv[++k];
    if (std::strcmp(argv[k], "--v") == 0 && k + 1 < argc) v_max = std::atof(argv[++k]);
    if (std::strcmp(argv[k], "--calls") == 0 && k + 1 < argc) calls = std::atoi(argv[++k]);
    if (std::strcmp(argv[k], "--json") == 0) json = true;
  }
  const auto [map, queries] = read_pairs(pairs);
  const auto grid = map::builtin_scene(map, 0.1);
  if (queries.empty() || !grid) {
    std::fprintf(stderr, "plan_timings: --pairs '%s': no pairs of a built-in map\n", pairs.c_str());
    return 66;
  }
  const auto world = plan::build_world(*grid, config::load_model("builtin:quad-5in").value(),
                                       config::load_vehicle("builtin:quad-5in").value());
  const Instructions instructions;
  Json told = {{"map", map}, {"pairs", queries.size()}, {"v_max_mps", v_max}};
  std::map<std::string, std::vector<double>> found;
  for (const auto& q : queries) {
    std::map<std::string, std::vector<double>> measured;
    for (int call = 0; call < calls; ++call) {
      Setpoint hover;
      hover.p_W = q.start;
      const double begun = cpu_ms(), counted = instructions.now();
      const auto plan = plan::plan(*world, {{q.start, Vec3::Zero()}, hover}, q.goal, {.v_max = v_max, .a_max = 2});
      if (counted >= 0) measured["instructions"].push_back(instructions.now() - counted);
      measured["total_ms"].push_back(cpu_ms() - begun);
      if (plan.status != plan::PlanStatus::ok) continue;
      const auto& m = plan.metrics;
      for (const auto& [what, value] : {std::pair{"search_ms", m.search_ms},
                                        {"tubes_ms", m.tubes_ms},
                                        {"optimise_ms", m.optimise_ms},
                                        {"verify_ms", m.verify_ms},
                                        {"evaluations", static_cast<double>(m.evaluations)},
                                        {"time_s", m.time_s},
                                        {"time_by_norm_s", time_by_norm(plan.trajectory, v_max, 2)},
                                        {"jerk2_time5", m.jerk2 * std::pow(m.time_s, 5)},
                                        {"clearance_m", m.min_clearance_m}})
        measured[what].push_back(value);
    }
    if (!measured.contains("time_s")) continue;
    for (auto& [what, values] : measured) found[what].push_back(quantile(values, 0.5));
  }
  told["solved"] = found["time_s"].size();
  for (const auto& [what, values] : found) told[what] = quantiles(values);
  double flown = 0, flown_by_norm = 0, jerk = 0;
  for (const double t : found["time_s"]) flown += t;
  for (const double t : found["time_by_norm_s"]) flown_by_norm += t;
  for (const double j : found["jerk2_time5"]) jerk += std::log(j) / static_cast<double>(queries.size());
  told["flight_time_sum_s"] = flown;
  told["flight_time_by_norm_sum_s"] = flown_by_norm;
  told["mean_ln_jerk2_time5"] = jerk;
  std::printf("%s\n", told.dump(json ? -1 : 2).c_str());
  return 0;
}
