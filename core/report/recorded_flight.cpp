// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/recorded_flight.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/map/octomap_message.hpp"
#include "core/plan/rest.hpp"
#include "core/report/recorded_parts.hpp"

namespace backwash::report {
namespace {

constexpr std::size_t kMostLate = 20;  // ticks that a pose that was judged may be old

tl::unexpected<log::LogError> bad(const std::string& what) {
  return tl::make_unexpected(log::LogError{log::LogError::Kind::bad_data, "raw log: " + what});
}

std::vector<const log::TickRecord*> ticks_of(std::span<const log::RawRecord> log, std::uint64_t id,
                                             std::vector<std::int64_t>& times) {
  std::vector<const log::TickRecord*> ticks;
  for (const log::RawRecord& record : log) {
    if (record.header.kind != log::RecordKind::tick) continue;
    const auto* tick = log::payload<log::TickRecord>(record);
    if (!tick || tick->segment != id) continue;
    ticks.push_back(tick);
    times.push_back(record.header.t_ns);
  }
  return ticks;
}

Vec3 vec(const double* v) { return {v[0], v[1], v[2]}; }

/// Whether the odometry's timing is stated, so that each pose was judged for its own moment (docs/model.md 4-15).
bool timed(std::span<const log::RawRecord> log) {
  return std::ranges::any_of(log, [](const log::RawRecord& r) {
    return r.header.kind == log::RecordKind::constants && log::payload<log::TimedConstantsRecord>(r);
  });
}

track::Inside judged_against(const Vec3& p_W, const Vec3& center_W, const PerDirection& half_widths) {
  track::Inside judged{true, true, {}, half_widths, center_W};
  for (std::size_t d = 0; d < kDirections; ++d) {
    judged.error[d] = unit(static_cast<Direction>(d)).dot(p_W - center_W);
    if (!(std::abs(judged.error[d]) <= half_widths[d])) judged.inside = false;
  }
  return judged;
}

/// Whether the tube passes there on the way to its entry k, from at most `back` entries before.
bool passes(const reach::ReachTube& tube, std::size_t k, std::size_t back, const Vec3& p_W) {
  for (std::size_t n = k - std::min(k, back); n <= k; ++n) {
    const Vec3 &from = tube[n].center.p_W, &to = tube[std::min(n + 1, tube.size() - 1)].center.p_W;
    const double length2 = (to - from).squaredNorm();
    const double share = length2 > 0 ? std::clamp((p_W - from).dot(to - from) / length2, 0.0, 1.0) : 0;
    if ((from + share * (to - from) - p_W).norm() < 1e-6) return true;
  }
  return false;
}

sim::FlightSample sample_of(const log::TickRecord& tick, double t, double t_zero, const TruthRows& truth) {
  sim::FlightSample s{};
  s.t = t - t_zero;
  s.truth = {truth.at(t, "x_m", "y_m", "z_m"), truth.at(t, "vx_mps", "vy_mps", "vz_mps")};
  s.estimated = {vec(tick.p), vec(tick.v)};
  s.acceleration = truth.at(t, "ax_mps2", "ay_mps2", "az_mps2");
  s.attitude = Eigen::Quaterniond::Identity();
  s.command = {vec(tick.cmd_p), vec(tick.cmd_v), vec(tick.cmd_a), tick.cmd_yaw};
  return s;
}

track::Inside as_recorded(const log::TickRecord& tick) {
  PerDirection half_widths;
  std::copy_n(tick.half_widths, kDirections, half_widths.begin());
  return judged_against(vec(tick.p), vec(tick.center), half_widths);
}

tl::expected<sim::FlightPiece, log::LogError> piece_of(std::span<const log::RawRecord> log,
                                                       const RecordedSegment& segment, const TruthRows& truth,
                                                       const plan::World& world, double t_zero, double z_safe) {
  sim::FlightPiece piece;
  piece.accepted.id = segment.head.id;
  piece.accepted.commands = segment.commands;
  const State start{vec(segment.head.start_p), vec(segment.head.start_v)};
  auto& tube = piece.accepted.tube;
  tube = plan::tube_to_rest(world, start, segment.previous, segment.commands);
  std::vector<std::int64_t> times;
  const auto ticks = ticks_of(log, segment.head.id, times);
  if (ticks.empty()) return bad("no tick of segment " + std::to_string(segment.head.id));
  // It may have begun with a later command: as much later as its first pose was old.
  const auto begun =
      static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(ticks.front()->index, segment.commands.size() - 1));
  reach::ReachTube whole(tube.begin(), tube.begin() + begun);  // its first poses are of before
  tube.erase(tube.begin(), tube.begin() + begun);
  piece.accepted.commands.erase(piece.accepted.commands.begin(), piece.accepted.commands.begin() + begun);
  // Past the end the last set holds.
  reach::TubeStep last = tube.back();
  last.half_widths = last.half_widths_interval;
  while (tube.size() < ticks.size()) {
    last.t += kControlPeriod;
    tube.push_back(last);
    piece.accepted.commands.push_back(piece.accepted.commands.back());
  }
  whole.insert(whole.end(), tube.begin(), tube.end());
  const std::size_t back = timed(log) ? kMostLate : 0;
  track::Inside judged;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    const log::TickRecord& tick = *ticks[k];
    const reach::TubeStep& set = tube[k];
    const bool fits = back > 0 ? passes(whole, k + whole.size() - tube.size(), back, vec(tick.center))
                               : (vec(tick.center) - set.center.p_W).norm() <= 1e-6;
    if (tick.judged && !fits)
      return bad("tick " + std::to_string(tick.tick) + " was judged against another set than its commands give");
    const double t = static_cast<double>(times[k]) * 1e-9;
    if (back == 0 && !world.bounds.model().stated)
      judged = judged_against(vec(tick.p), set.center.p_W, set.half_widths);
    else if (tick.judged)  // what was found holds until the next pose; by a risk it was the worst case's
      judged = as_recorded(tick);
    const sim::FlightSample s = sample_of(tick, t, t_zero, truth);
    piece.samples.push_back(s);
    piece.judged.push_back(judged);
    piece.clearance_m.push_back(sim::true_clearance(world, s.truth.p_W, z_safe));
  }
  tube.resize(ticks.size(), last);
  return piece;
}

}  // namespace

tl::expected<map::OccupancyGrid, log::LogError> recorded_map(std::span<const log::RawRecord> log) {
  for (auto record = log.rbegin(); record != log.rend(); ++record)
    if (accepted_map(*record)) return recorded_map(*record);
  return bad("no map was accepted");
}

bool accepted_map(const log::RawRecord& record) noexcept {
  const auto* head = record.header.kind == log::RecordKind::map ? log::payload<log::MapRecord>(record) : nullptr;
  return head && head->accepted;
}

tl::expected<map::OccupancyGrid, log::LogError> recorded_map(const log::RawRecord& accepted) {
  const auto& head = *log::payload<log::MapRecord>(accepted);
  const std::span data(reinterpret_cast<const std::int8_t*>(accepted.bytes.data()) + sizeof head,
                       accepted.bytes.size() - sizeof head);
  auto grid = map::decode_octomap(data, head.resolution, head.binary, "OcTree");
  if (!grid) return bad(grid.error().message);
  return std::move(*grid);
}

tl::expected<sim::Flight, log::LogError> recorded_flight(std::span<const log::RawRecord> log,
                                                         const log::FlightLog& truth, const plan::World& world) {
  for (const char* name : {"x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "ax_mps2", "ay_mps2", "az_mps2"})
    if (!truth.has(name)) return bad(std::string("the truth has no column ") + name);
  if (truth.t_s.size() < 2) return bad("the truth has fewer than two rows");
  std::vector<RecordedSegment> segments;
  for (const log::RawRecord& record : log)
    if (auto segment = recorded_segment(record)) segments.push_back(*std::move(segment));
  if (segments.size() != 2) return bad("needs one take-off and one route, has " + std::to_string(segments.size()));
  for (const RecordedSegment& s : segments)
    if (s.commands.empty() || s.commands.size() != s.head.commands)
      return bad("segment " + std::to_string(s.head.id) + " holds " + std::to_string(s.commands.size()) +
                 " commands, its head says " + std::to_string(s.head.commands));
  const RecordedSegment &up = segments[0], &route = segments[1];

  const auto column = plan::takeoff_column(world, up.commands.back().p_W, 0);
  if (!column) return bad("the map has no floor below the take-off");
  std::vector<std::int64_t> times;
  if (ticks_of(log, up.head.id, times).empty()) return bad("no tick of the take-off");
  const double t_zero = static_cast<double>(times.front()) * 1e-9;

  sim::Flight flight{};
  flight.column = *column;
  const TruthRows rows(truth);
  auto take_off = piece_of(log, up, rows, world, t_zero, column->z_safe);
  if (!take_off) return tl::unexpected(take_off.error());
  flight.take_off = std::move(*take_off);
  auto flown = piece_of(log, route, rows, world, t_zero, sim::kEverywhere);
  if (!flown) return tl::unexpected(flown.error());
  flight.route = std::move(*flown);
  flight.plan.status = plan::PlanStatus::ok;
  flight.plan.metrics.search_ms = route.head.search_ms;
  flight.plan.metrics.optimise_ms = route.head.optimise_ms;
  flight.plan.metrics.verify_ms = route.head.verify_ms;
  const State start{vec(route.head.start_p), vec(route.head.start_v)};
  flight.tight = sim::method_tube(world, world.reach, start, route.previous, route.commands);
  const reach::Reachability paper(world.reach.vehicle, reach::Method::paper, reach::Loop::continuous);
  flight.paper = sim::method_tube(world, paper, start, route.previous, route.commands);
  return flight;
}

}  // namespace backwash::report
