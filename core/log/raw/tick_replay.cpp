// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <utility>

#include "core/log/raw/replayed_air.hpp"

namespace backwash::log {
namespace {

tl::unexpected<LogError> bad(const std::string& what) {
  return tl::make_unexpected(LogError{LogError::Kind::bad_data, what});
}

// An offer is doubles only: head (id, continues, branch, closures, epoch, arms, commands, sets, stops), commands of 10,
// sets of 16, then each stop: branch, commands, sets, and its rows. Whole numbers up to 2^53 are exact.
constexpr std::size_t kCommand = 10, kSet = 16;

class TickRows {
 public:
  void add(double value) { values_.push_back(value); }
  void add(const Vec3& v) { values_.insert(values_.end(), v.data(), v.data() + 3); }
  void add(const std::vector<Setpoint>& commands) {
    for (const Setpoint& c : commands) {
      add(c.p_W);
      add(c.v_W);
      add(c.a_W);
      add(c.yaw);
    }
  }
  void add(const reach::ReachTube& tube) {
    for (const reach::TubeStep& s : tube) {
      add(s.center.p_W);
      add(s.center.v_W);
      for (const auto& h : {s.half_widths, s.half_widths_interval}) values_.insert(values_.end(), h.begin(), h.end());
    }
  }
  std::vector<std::uint8_t> bytes() const {
    std::vector<std::uint8_t> bytes(values_.size() * sizeof(double));
    std::memcpy(bytes.data(), values_.data(), bytes.size());
    return bytes;
  }

 private:
  std::vector<double> values_;
};

/// Takes an offer apart; `good` is false once something was asked for that is not there.
class Cursor {
 public:
  explicit Cursor(std::span<const std::uint8_t> bytes) : left_(bytes) {}
  bool good = true;
  double number() {
    double value = 0;
    good = good && left_.size() >= sizeof value;
    if (!good) return 0;
    std::memcpy(&value, left_.data(), sizeof value);
    left_ = left_.subspan(sizeof value);
    return value;
  }
  std::size_t count(std::size_t each) {
    const double value = number();
    good =
        good && value >= 0 && value * static_cast<double>(each * sizeof(double)) <= static_cast<double>(left_.size());
    return good ? static_cast<std::size_t>(value) : 0;
  }
  std::uint64_t whole() {
    const double value = number();
    good = good && value >= 0 && value < 9e15;
    return good ? static_cast<std::uint64_t>(value) : 0;
  }
  Vec3 vec() {
    const double x = number(), y = number(), z = number();
    return {x, y, z};
  }
  std::vector<Setpoint> commands(std::size_t n) {
    std::vector<Setpoint> all;
    for (std::size_t i = 0; i < n && good; ++i) {
      Setpoint c;
      c.p_W = vec();
      c.v_W = vec();
      c.a_W = vec();
      c.yaw = number();
      all.push_back(c);
    }
    return all;
  }
  reach::ReachTube tube(std::size_t n) {
    reach::ReachTube all;
    for (std::size_t i = 0; i < n && good; ++i) {
      reach::TubeStep s{};
      s.center.p_W = vec();
      s.center.v_W = vec();
      for (auto* h : {&s.half_widths, &s.half_widths_interval})
        for (double& width : *h) width = number();
      all.push_back(s);
    }
    return all;
  }
  bool done() const { return good && left_.empty(); }

 private:
  std::span<const std::uint8_t> left_;
};

using Segments = std::map<std::uint64_t, std::unique_ptr<track::AcceptedSegment>>;

std::string at(const std::string& name, const RawRecord& record) {
  return name + ": byte " + std::to_string(record.offset) + ": ";
}

/// The constants of the daemon's start. A log must begin there: a tick's decisions rest on all ticks since then.
tl::expected<const RawRecord*, LogError> constants_of(const RawLog& log, const std::string& name) {
  const bool says = !log.records.empty() && log.records.front().header.kind == RecordKind::part;
  const auto* part = says ? payload<PartRecord>(log.records.front()) : nullptr;
  if (part && part->part != 1)
    return bad(name + ": begins with part " + std::to_string(part->part) +
               " of its log; give all parts from the first on, in their order");
  const auto first = std::ranges::find(log.records, RecordKind::constants, [](const auto& r) { return r.header.kind; });
  if (first == log.records.end() || !payload<ConstantsRecord>(*first))
    return bad(name + ": has no constants record: not a log of backwashd's start");
  return &*first;
}

tl::expected<Segments, LogError> segments_of(const RawLog& log, const std::string& name) {
  Segments segments;
  for (const RawRecord& record : log.records) {
    if (record.header.kind != RecordKind::offer) continue;
    auto segment = decode_offer(record.bytes);
    if (!segment) return bad(at(name, record) + segment.error().message);
    const std::uint64_t id = (*segment)->id;
    segments[id] = std::move(*segment);
  }
  return segments;
}

/// Whether a segment that this tick offers, and that is not in the log, may lie beyond its end: newer than all that are
/// there, and not more than a second of ticks follows.
bool ends_before(const RawLog& log, const RawRecord& tick, const Segments& segments, std::uint64_t offered) {
  if (!segments.empty() && offered <= segments.rbegin()->first) return false;
  const auto left = std::count_if(log.records.begin() + (&tick - log.records.data()), log.records.end(),
                                  [](const RawRecord& r) { return r.header.kind == RecordKind::tick; });
  return static_cast<double>(left) * kControlPeriod <= 1;
}

/// The tick as the daemon started it.
tl::expected<track::FlightTick, LogError> tick_of(const RawLog& log, const std::string& name) {
  const auto first = constants_of(log, name);
  if (!first) return tl::unexpected(first.error());
  const auto* constants = payload<ConstantsRecord>(**first);
  Vehicle vehicle;
  vehicle.limits.v_max = constants->v_max;
  vehicle.estimation.position = constants->estimation_position;
  vehicle.initial_error = {constants->initial_position, constants->initial_velocity};
  const auto* timed = payload<TimedConstantsRecord>(**first);
  const OdometryTiming timing = timed ? OdometryTiming{timed->rate_least, timed->latency} : OdometryTiming{};
  const auto* by = payload<DriftConstantsRecord>(**first);
  const track::DriftLaw law =
      by ? track::DriftLaw{by->ends, by->deviations, by->scale, by->lag, {by->over[0], by->over[1], by->over[2]}}
         : track::kDriftOverASecond;
  // Written so that what is no number is refused: of a damaged record no window or limit is made.
  if (!(timing.rate_least > 0 && timing.latency >= 0)) return bad(at(name, **first) + "is no timing of odometry");
  if (!std::ranges::all_of(law.over, [](double s) { return s > 0; }) || !(law.scale >= 0 && law.lag >= 0))
    return bad(at(name, **first) + "is no law of a pose and its twist");
  return track::FlightTick(vehicle, constants->battery_land, timing, law);
}

}  // namespace

std::vector<std::uint8_t> encode(const track::AcceptedSegment& s) {
  TickRows rows;
  for (const std::uint64_t n : {s.id, s.continues, std::uint64_t{s.branch}, std::uint64_t{s.closures}, s.epoch.order,
                                s.epoch.lapse, std::uint64_t{s.arms}})
    rows.add(static_cast<double>(n));
  for (const std::size_t n : {s.commands.size(), s.tube.size(), s.stops.size()}) rows.add(static_cast<double>(n));
  rows.add(s.commands);
  rows.add(s.tube);
  for (const plan::Stop& stop : s.stops) {
    for (const std::size_t n : {stop.branch, stop.commands.size(), stop.tube.size()}) rows.add(static_cast<double>(n));
    rows.add(stop.commands);
    rows.add(stop.tube);
  }
  if (s.worst != 1) {
    rows.add(s.worst);
    rows.add(s.worst_at_rest);
  }
  return rows.bytes();
}

tl::expected<std::unique_ptr<track::AcceptedSegment>, LogError> decode_offer(std::span<const std::uint8_t> bytes) {
  Cursor in(bytes);
  auto s = std::make_unique<track::AcceptedSegment>();
  s->id = in.whole();
  s->continues = in.whole();
  s->branch = in.whole();
  s->closures = static_cast<std::uint32_t>(in.whole());
  s->epoch = {in.whole(), in.whole()};
  s->arms = in.whole() != 0;
  const std::size_t commands = in.count(kCommand), sets = in.count(kSet), stops = in.count(3);
  s->commands = in.commands(commands);
  s->tube = in.tube(sets);
  for (std::size_t n = 0; n < stops && in.good; ++n) {
    plan::Stop stop;
    stop.branch = in.whole();
    const std::size_t own_commands = in.count(kCommand), own_sets = in.count(kSet);
    stop.commands = in.commands(own_commands);
    stop.tube = in.tube(own_sets);
    in.good = in.good && own_sets == own_commands + 1 && stop.branch <= commands;
    s->stops.push_back(std::move(stop));
  }
  if (!in.done()) {
    s->worst = in.number();
    s->worst_at_rest = in.number();
  }
  if (!in.done() || sets != commands + 1 || !(s->worst >= 1) || !(s->worst_at_rest >= 1))
    return bad("is not an offered segment: its sizes disagree");
  return s;
}

tl::expected<Replay, LogError> replay(const RawLog& log, const std::string& name) {
  auto made = tick_of(log, name);
  if (!made) return tl::unexpected(made.error());
  track::FlightTick& flight = *made;
  const auto segments = segments_of(log, name);
  if (!segments) return tl::unexpected(segments.error());

  Replay result;
  result.segments = segments->size();
  result.state_hash = 0xcbf29ce484222325u;
  const TickInputRecord* input = nullptr;
  const StatedTickInputRecord* stated = nullptr;  // the same, of a newer log
  ReplayedAir air;
  for (const RawRecord& record : log.records) {
    if (record.header.kind == RecordKind::tick_input) {
      input = payload<TickInputRecord>(record);
      stated = payload<StatedTickInputRecord>(record);
      if (!input) return bad(at(name, record) + "is too short for the inputs of a tick");
    }
    if (const auto wrong = air.take(record)) return bad(at(name, record) + *wrong);
    if (record.header.kind != RecordKind::tick) continue;
    const auto* logged = payload<TickRecord>(record);
    if (!logged) return bad(at(name, record) + "is too short for a tick");
    if (!input) {  // the daemon could not write them: the number is counted as missing below
      air.skip();
      continue;
    }
    const track::AcceptedSegment* segment = nullptr;
    if (input->segment != 0) {
      const auto found = segments->find(input->segment);
      if (found == segments->end() && ends_before(log, record, *segments, input->segment)) {
        result.stopped = "from tick " + std::to_string(logged->tick) + " on segment " + std::to_string(input->segment) +
                         " is offered, which lies beyond the end of the log";
        break;
      }
      if (found == segments->end())
        return bad(at(name, record) + "offers segment " + std::to_string(input->segment) + ", which is not in the log");
      segment = found->second.get();
    }
    TickRecord replayed{};
    const track::TickInput in = stated ? decode(*stated, segment) : decode(*input, segment);
    const track::TickOutput out = flight.step(in);
    decided(flight, out, replayed);
    input = nullptr;
    result.ticks_missing += logged->tick - (result.ticks + result.ticks_missing);
    ++result.ticks;
    result.setpoints += (replayed.asked & kAskedSetpoint) != 0;
    auto difference = compare(kDecisions, *logged, replayed, result.state_hash);
    if (difference) difference->offset = record.offset;
    const auto of_air = air.step(in, flight, out, logged->tick, result.state_hash);
    result.differing += difference || of_air;
    if (!result.first) result.first = difference ? difference : of_air;
  }
  return result;
}

}  // namespace backwash::log
