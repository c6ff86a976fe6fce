// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/control/flying.hpp"

#include <algorithm>
#include <cstring>

#include "core/log/raw/raw_log.hpp"
#include "core/plan/rest.hpp"

namespace backwash::daemon {
double clearance_from(const Flying& flying, const plan::World& world, const reach::ReachTube& tube, std::size_t from) {
  const double apart = flying.segment.apart_m;
  return flying.z_safe ? plan::takeoff_clearance(world, tube, *flying.z_safe, from, apart)
                       : plan::tube_clearance(world, tube, from, apart);
}

void verify(Flying& flying, const plan::World& world, std::size_t now) {
  auto& s = flying.segment;
  s.tube = plan::tube_to_rest(world, flying.start, flying.previous, s.commands);
  s.clearance = clearance_from(flying, world, s.tube, now);
  s.air = world.air.factors;
  if (const auto& stated = world.bounds.model().stated) {
    s.worst = stated->worst;
    s.worst_at_rest = stated->worst / stated->at_rest;
  }
}

void add_guards(Flying& flying, const plan::World& world, std::size_t now) {
  auto& s = flying.segment;
  s.clearance_ahead.clear();
  for (std::size_t k = 0; k < s.commands.size(); k += track::AcceptedSegment::kClearanceEvery)
    s.clearance_ahead.push_back(clearance_from(flying, world, s.tube, std::max(k, now)));
  flying.segment.stops = plan::verified_stops(
      world, flying.start, flying.previous, flying.segment.commands, now, kStopEvery,
      [&](const reach::ReachTube& tube) { return clearance_from(flying, world, tube, now) - flying.segment.apart_m; });
}

void add_own_stop(Flying& flying, std::size_t branch) {
  auto& s = flying.segment;
  const auto own = static_cast<std::ptrdiff_t>(branch);
  std::erase_if(s.stops, [&](const plan::Stop& stop) { return stop.branch == branch; });
  s.stops.insert(std::ranges::lower_bound(s.stops, branch, {}, &plan::Stop::branch),
                 {branch, {s.commands.begin() + own, s.commands.end()}, {s.tube.begin() + own, s.tube.end()}});
}

void add_own_stops(Flying& flying, std::size_t branch) {
  const auto& s = flying.segment;
  for (; branch < s.commands.size() && !s.commands[branch].v_W.isZero(); branch += kStopEvery) {
    const auto next = std::ranges::lower_bound(s.stops, branch, {}, &plan::Stop::branch);
    if (next == s.stops.end() || next->branch >= branch + kStopEvery) add_own_stop(flying, branch);
  }
  // Until it rests, also after the last of them.
  std::size_t rest = s.commands.size();
  while (rest > 0 && s.commands[rest - 1].v_W.isZero()) --rest;
  if (rest < s.commands.size()) add_own_stop(flying, rest);
}

std::vector<Setpoint> flown_commands(const Flying& flying, bool braking, std::size_t stop_branch) {
  const auto& s = flying.segment;
  const auto stop = std::ranges::find(s.stops, stop_branch, &plan::Stop::branch);
  if (!braking || stop == s.stops.end()) return s.commands;
  std::vector<Setpoint> commands(s.commands.begin(), s.commands.begin() + static_cast<std::ptrdiff_t>(stop->branch));
  commands.insert(commands.end(), stop->commands.begin(), stop->commands.end());
  return commands;
}

std::vector<std::uint8_t> segment_record(const Flying& flying) {
  const auto& s = flying.segment;
  log::SegmentRecord head{};
  head.id = s.id;
  head.continues = s.continues;
  head.commands = s.commands.size();
  head.search_ms = flying.metrics.search_ms;
  head.optimise_ms = flying.metrics.optimise_ms;
  head.verify_ms = flying.metrics.verify_ms;
  std::copy_n(flying.start.p_W.data(), 3, head.start_p);
  std::copy_n(flying.start.v_W.data(), 3, head.start_v);
  std::vector<double> rows;
  const auto add = [&rows](const Setpoint& c) {
    for (const Vec3& v : {c.p_W, c.v_W, c.a_W}) rows.insert(rows.end(), v.data(), v.data() + 3);
    rows.push_back(c.yaw);
  };
  add(flying.previous);
  for (const Setpoint& c : s.commands) add(c);
  std::vector<std::uint8_t> bytes(sizeof head + rows.size() * sizeof(double));
  std::memcpy(bytes.data(), &head, sizeof head);
  std::memcpy(bytes.data() + sizeof head, rows.data(), rows.size() * sizeof(double));
  return bytes;
}

}  // namespace backwash::daemon
