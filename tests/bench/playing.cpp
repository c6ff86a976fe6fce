// SPDX-License-Identifier: BSD-3-Clause
#include "tests/bench/playing.hpp"

#include <fstream>
#include <memory>
#include <sstream>

#include "core/config/config.hpp"
#include "services/bench/emulation/firmware.hpp"
#include "tests/autopilots/session.hpp"

namespace backwash::autopilots {
namespace {

const std::string kHome = std::string(BACKWASH_SOURCE_DIR) + "/tests/autopilots/";

/// The profile in empty, calm air, the session at the other end of its line, and time that moves by 1 ms a step.
std::string play(Kind kind, const std::string& script, const std::map<std::string, double>& parameters) {
  const map::OccupancyGrid nothing(Vec3(-1, -1, -1), 1.0, Index3(2, 2, 2), map::Cell::free);
  const bool px4 = kind == Kind::px4;
  const Vehicle vehicle = config::load_vehicle(kHome + (px4 ? "px4" : "ardupilot") + ".vehicle.toml").value();
  // The simulators' air: ardupilot-vio.csv:271–315 (level, 0.163 → 0.067 m/s in 6.5 s); px4-loss1.csv:213 (0.108 rad
  // at 1.10 m/s).
  const bench::Site site{.grid = nothing, .vehicle = vehicle, .airflow = 0, .drag = px4 ? 1.0 : 0.17};
  const auto autopilot = px4 ? bench::make_px4(site) : bench::make_arducopter(site);
  for (const auto& [name, value] : parameters) autopilot->parameters.at(name) = value;

  std::vector<std::uint8_t> up, down;  // to the autopilot, from it
  bool stopped = false;
  const Line line{[&](std::span<std::uint8_t> bytes) {
                    const std::size_t n = std::min(bytes.size(), down.size());
                    std::copy_n(down.begin(), n, bytes.begin());
                    down.erase(down.begin(), down.begin() + static_cast<std::ptrdiff_t>(n));
                    return n;
                  },
                  [&](std::span<const std::uint8_t> bytes) { up.insert(up.end(), bytes.begin(), bytes.end()); }};
  std::ostringstream trace;
  Session session(line,
                  {.script = kHome + "scripts/" + script + ".txt", .px4 = px4, .stopped = [&](bool s) { stopped = s; }},
                  trace);
  for (std::int64_t ms = 1; !session.done(); ++ms) {
    const std::int64_t now_ns = ms * 1'000'000;
    const double t = static_cast<double>(ms) * 1e-3;
    std::optional<Truth> truth;
    if (!stopped) {
      autopilot->receive(up, t);
      up.clear();
      autopilot->step(t, down);
      if (ms % 10 == 0) truth = Truth{now_ns, autopilot->truth().p_W, autopilot->truth().v_W, autopilot->attitude()};
    }
    if (!session.step(now_ns, truth)) throw std::runtime_error("the script waited in vain:\n" + trace.str());
  }
  session.finish();
  return trace.str();
}

}  // namespace

const Trace& recorded(const std::string& name) {
  static std::map<std::string, std::unique_ptr<Trace>> traces;
  auto& trace = traces[name];
  if (!trace) {
    std::ifstream in(kHome + "traces/" + name + ".csv");
    trace = std::make_unique<Trace>(in);
  }
  return *trace;
}

const Trace& played(Kind kind, const std::string& script, const std::map<std::string, double>& parameters) {
  static std::map<std::pair<std::string, std::map<std::string, double>>, std::unique_ptr<Trace>> traces;
  auto& trace = traces[{script, parameters}];
  if (!trace) {
    const std::string csv = play(kind, script, parameters);
    if (const char* folder = std::getenv("BACKWASH_TRACES"))
      std::ofstream(folder + ("/" + script) + std::to_string(traces.size()) + ".csv") << csv;
    std::istringstream in(csv);
    trace = std::make_unique<Trace>(in);
  }
  return *trace;
}

}  // namespace backwash::autopilots
