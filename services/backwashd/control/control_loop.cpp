// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/control/control_loop.hpp"

#include <sys/resource.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/log/raw/air_log.hpp"
#include "core/log/raw/tick_log.hpp"
#include "services/backwashd/channels.hpp"

namespace backwash::daemon {
namespace {

constexpr float kGpsGlobalOrigin = 49, kAutopilotVersion = 148;
constexpr std::int64_t kEnableWish_ns = 3'000'000'000;  // in which the autopilot is asked what enabling needs
constexpr std::uint8_t kNotice = 5, kWarning = 4;       // severities of STATUSTEXT

firmware_bridge::Time time_of(std::int64_t ns) noexcept { return firmware_bridge::Time(std::chrono::nanoseconds(ns)); }
std::int64_t ns_of(firmware_bridge::Time t) noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(t.time_since_epoch()).count();
}

std::uint64_t page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return static_cast<std::uint64_t>(usage.ru_minflt + usage.ru_majflt);
}

firmware_bridge::Signal signal_of(Mode mode) noexcept {
  using firmware_bridge::Signal;
  if (mode == Mode::quiet) return Signal::fault;
  return mode == Mode::passive ? Signal::idle : Signal::commanding;
}

}  // namespace

ControlLoop::ControlLoop(Channels& channels, firmware_bridge::AutopilotLink& link, const Vehicle& vehicle,
                         double battery_land, const MapSettings& map, const OdometryTiming& timing,
                         const std::optional<adapt::InFlightConstants>& air)
    : channels_(channels),
      link_(link),
      flight_(vehicle, battery_land, timing),
      lookout_(channels, channels, vehicle, map),
      line_allowed_(firmware_bridge::line_allowed(vehicle, link.untold_delay())) {
  link_.tap(&ControlLoop::on_frame, this);
  const auto constants = log::constants(vehicle, battery_land, timing);
  record(log::RecordKind::constants, now_ns(), &constants, sizeof constants);
  if (!air) return;
  air_.emplace(*air);
  view_.air.emplace().factors = air_->factors();
  const auto start = log::constants(*air);
  record(log::RecordKind::air_constants, now_ns(), &start, air->calmest < 1 ? sizeof start : sizeof start.constants);
}

void ControlLoop::record(log::RecordKind kind, std::int64_t t_ns, const void* bytes, std::size_t size) noexcept {
  ControlRecord r;
  r.header = {t_ns, kind, static_cast<std::uint32_t>(std::min(size, r.bytes.size()))};
  std::memcpy(r.bytes.data(), bytes, r.header.size);
  channels_.control_log.push_or_count(r);
}

void ControlLoop::on_frame(void* loop, bool outgoing, std::span<const std::uint8_t> frame) noexcept {
  auto& self = *static_cast<ControlLoop*>(loop);
  self.record(outgoing ? log::RecordKind::frame_out : log::RecordKind::frame_in, self.now_ns_, frame.data(),
              frame.size());
}

void ControlLoop::listen(std::int64_t now_ns) noexcept {
  now_ns_ = now_ns;
  (void)link_.poll(time_of(now_ns));  // a port that is lost says so in the next tick too
}

// What has arrived on the port. A lost one is replaced as soon as the link watch has opened it again: the modes stay as
// they are, so that nothing is resumed.
void ControlLoop::poll(std::int64_t now_ns) noexcept {
  if (const FreshPort* fresh = channels_.ports.take()) {
    fresh->port = link_.reconnect(std::move(fresh->port), time_of(now_ns));
    channels_.ports.give_back(fresh);
    port_open_ = true;
    requests_.forget();
  }
  const bool open = link_.poll(time_of(now_ns)).has_value();
  if (std::exchange(port_open_, open) && !open) channels_.port_losses.fetch_add(1, std::memory_order_relaxed);
  channels_.link_fault.store(link_.fault(time_of(now_ns)), std::memory_order_relaxed);
}

track::AutopilotFacts ControlLoop::autopilot(std::int64_t now_ns) const noexcept {
  const auto& telemetry = link_.telemetry();
  const firmware_bridge::Time now = time_of(now_ns);
  track::AutopilotFacts facts;
  facts.port_open = port_open_;
  facts.transmit_failed = link_.transmit_stalled(now);
  const auto status = telemetry.status.at(now);
  facts.armed = !status || status->value.armed;
  facts.offboard = status && status->value.follows_setpoints;
  using firmware_bridge::LandedState;
  if (const auto said = telemetry.landed_state.at(now); said && said->value != LandedState::undefined) {
    facts.landed = said->value == LandedState::on_ground;
    facts.in_air = said->value == LandedState::in_air;
  }
  facts.lifts_itself = status && status->value.autopilot->lifts_itself;
  const auto taken = telemetry.result_of(firmware_bridge::kCommandTakeoff);
  facts.takeoff_taken =
      takeoff_asked_ns_ && taken && taken->value.result == 0 && ns_of(taken->at) >= *takeoff_asked_ns_;
  if (const auto age = link_.heartbeat_age(now)) facts.heartbeat_age = std::chrono::duration<double>(*age).count();
  const auto position = telemetry.local_state.at(now);
  const auto attitude = telemetry.attitude.at(now);
  if (position && attitude) {
    const auto& [q, omega_B] = attitude->value;
    facts.pose = {ns_of(position->at), position->value, {q.w(), q.x(), q.y(), q.z()}, ns_of(attitude->at), omega_B};
  }
  if (const auto said = telemetry.reset_counter.at(now)) facts.reset_counter = said->value;
  if (const auto said = telemetry.battery.at(now)) facts.battery = said->value.remaining;
  return facts;
}

// The way back shows itself at once, in the stamps of poses: each of 0.3 s is older than both ways may take. A question
// shows both, within 2 s.
bool ControlLoop::line_slow(const track::AutopilotFacts& autopilot, std::int64_t now_ns) noexcept {
  constexpr int kSlowTicks = 15;
  const double age = autopilot.pose_age(now_ns);
  slow_ = age > line_allowed_ && age < track::Supervisor::kPoseSilent ? slow_ + 1 : 0;
  const auto trip = link_.round_trip(time_of(now_ns));
  return slow_ >= kSlowTicks || (trip && seconds(*trip) > line_allowed_);
}

track::TickInput ControlLoop::gather(std::int64_t now_ns, int missed) noexcept {
  track::TickInput in;
  in.now_ns = now_ns;
  in.missed_periods = missed;
  in.odometry = channels_.odometry.read_new();
  while (const auto order = channels_.orders.pop()) orders_.add(*order);
  const track::Order order = orders_.next();
  view_.stop_switch = SwitchReaction::read(channels_.stop_switch, now_ns);
  in.request = switch_.request(view_.stop_switch, flight_.mode(), order.request, now_ns);
  in.request = pilot_.request(flight_.mode(), link_.telemetry().status.at(time_of(now_ns)), in.request);
  in.order = order.number;
  // Beside a switch that says STOP no segment is taken; the STOP ends the epoch of one that waits meanwhile.
  if (may_fly(view_.stop_switch)) in.segment = channels_.segments.take();
  // A new way that was verified in calmer air than is known by now (docs/faults.md row 54). What slows down or leads
  // back what flies by such sets is no worse than that.
  if (in.segment && in.segment->continues == 0 && air_ && !covers(in.segment->air, air_->factors())) {
    view_.refused_segment = in.segment->id;
    channels_.segments.give_back(std::exchange(in.segment, nullptr));
  }
  in.autopilot = autopilot(now_ns);
  in.autopilot.line_slow = line_slow(in.autopilot, now_ns);
  in.surroundings = lookout_.look(flight_, now_ns);
  const auto said = link_.telemetry().position_sigma.at(time_of(now_ns));
  if (in.odometry && in.odometry->position_variance) vio_sigma_ = std::sqrt(in.odometry->position_variance->maxCoeff());
  if (said && vio_sigma_) in.position_sigma = static_cast<float>(std::hypot(said->value, *vio_sigma_));
  return in;
}

void ControlLoop::forward_odometry(std::uint8_t resets) noexcept {
  // As the VIO said it: a loop closure moves the map and must not move the controller's frame.
  const OdometrySample& s = *flight_.odometry();
  const track::RigidShift odom_from_map = s.map_from_odom.inverse();
  const Eigen::Quaterniond attitude(s.q[0], s.q[1], s.q[2], s.q[3]);
  firmware_bridge::VioSample vio{};
  vio.time_us = static_cast<std::uint64_t>(sender_clock_.taken_ns(s.stamp_ns, s.received_ns) / 1000);
  vio.p_O = odom_from_map.point(s.state.p_W);
  vio.q_OB = Eigen::Quaterniond(Eigen::AngleAxisd(odom_from_map.yaw, Vec3::UnitZ())) * attitude;
  vio.v_B = attitude.conjugate() * s.state.v_W;
  vio.position_variance_O = s.position_variance;
  vio.attitude_variance_O = s.attitude_variance;
  vio.velocity_variance_B = s.velocity_variance;
  vio.reset_counter = resets;
  if (link_.send_odometry(vio)) row_.sent |= 4;
}

void ControlLoop::ask_for_messages(std::int64_t now_ns) noexcept {
  const firmware_bridge::Time now = time_of(now_ns);
  const auto& answer = link_.telemetry().result_of(firmware_bridge::kCommandInterval);
  const auto& telemetry = link_.telemetry();
  auto stream = requests_.late(telemetry, now);
  if (!stream) stream = requests_.next(telemetry.autopilot(), answer, now);
  if (stream) link_.send_message_interval(stream->id, stream->rate_hz);
}

// One that arms only with a home has none without GPS until it is told an origin. One that it has stays.
void ControlLoop::give_origin(const track::AutopilotFacts& autopilot) noexcept {
  constexpr int kAsked = 2;  // times without an answer
  if (!link_.telemetry().autopilot().needs_origin || autopilot.armed || link_.telemetry().has_origin) {
    origin_asked_ = 0;
    return;
  }
  if (origin_asked_ >= kAsked && flight_.odometry()) link_.send_origin();
  link_.send_command(firmware_bridge::kCommandMessage, {kGpsGlobalOrigin});
  ++origin_asked_;
}

void ControlLoop::send(const track::TickInput& in, const track::TickOutput& out) noexcept {
  const auto& s = out.supervisor;
  if (s.changed && s.mode == Mode::quiet) link_.discard_unsent();
  if (s.send_setpoint && link_.send_setpoint(out.command_local, time_of(in.now_ns))) {
    row_.sent |= 1;
    ++view_.shown.setpoints_sent;
    if (out.fresh) {
      const double us = static_cast<double>(daemon::now_ns() - in.odometry->received_ns) * 1e-3;
      view_.odometry_to_wire.add(us);
      row_.odometry_to_wire_us = static_cast<float>(us);
    }
  }
  if (s.send_heartbeat && view_.ticks % kTicksPerSecond == 0 && link_.send_heartbeat()) row_.sent |= 2;
  if (out.forward_odometry) forward_odometry(out.odometry_resets);
  if (s.request_offboard) link_.send_follow_setpoints();
  if (s.request_land) link_.send_land();
  if (out.arm) link_.send_arm(true);
  if (out.disarm) link_.send_arm(false);
  if (s.mode != Mode::lifting) takeoff_asked_ns_.reset();
  if (out.takeoff && link_.send_takeoff(*out.takeoff) && !takeoff_asked_ns_) takeoff_asked_ns_ = in.now_ns;
  if (s.changed && s.send_heartbeat && s.reason != Reason::started)
    link_.send_statustext(s.mode == Mode::hold || s.mode == Mode::land ? kWarning : kNotice, to_string(s.reason));
  // Only while nothing depends on the line's time. Quiet, and silence to an armed vehicle, end by an operator's wish
  // alone: the autopilot, or we, may have restarted since.
  const bool passive = s.mode == Mode::passive && s.send_heartbeat;
  const std::optional<std::int64_t> asked_ns = channels_.enable_asked_ns.load();
  const bool wished =
      (s.mode == Mode::quiet || s.mode == Mode::passive) && asked_ns && in.now_ns - *asked_ns < kEnableWish_ns;
  parameters_.step(link_, time_of(in.now_ns), passive || wished, passive, view_);
  const auto age = link_.heartbeat_age(time_of(in.now_ns));
  const bool silent = !age || *age > firmware_bridge::kHeartbeatTimeout;
  if (silent) requests_.forget();  // what comes back may be another one
  if (!s.send_heartbeat && !wished) return;
  if (view_.ticks % (kTicksPerSecond / 2) == 13) link_.send_timesync(time_of(in.now_ns));
  if (!silent) ask_for_messages(in.now_ns);
  if (view_.ticks % (2 * kTicksPerSecond) == 1) give_origin(in.autopilot);
  if (view_.ticks % (2 * kTicksPerSecond) == 51 && !link_.telemetry().version)
    link_.send_command(firmware_bridge::kCommandMessage, {kAutopilotVersion});
}

// Transitions, missed deadlines and page faults, each to the operator; the tick itself to the raw log.
void ControlLoop::report(const track::TickInput& in, const track::TickOutput& out) noexcept {
  const auto tell = [&](ControlEvent::Kind kind, std::uint64_t count) {
    channels_.events.push_or_count({kind, in.now_ns, view_.mode, view_.reason, count});
  };
  if (out.supervisor.changed) tell(ControlEvent::Kind::transition, 0);
  if (in.missed_periods > 0) tell(ControlEvent::Kind::missed_deadline, static_cast<std::uint64_t>(in.missed_periods));
  const std::uint64_t faults = page_faults();
  if (view_.ticks > 1 && faults > view_.shown.page_faults)
    tell(ControlEvent::Kind::page_fault, faults - view_.shown.page_faults);
  view_.shown.page_faults = faults;

  row_.tick = view_.ticks;
  row_.missed_periods = static_cast<std::uint32_t>(in.missed_periods);
  row_.page_faults = static_cast<std::uint32_t>(faults);
  log::decided(flight_, out, row_);
  record(log::RecordKind::tick, in.now_ns, &row_, sizeof row_);
  channels_.view_mission.write(view_);
  channels_.view_planner.write(view_);
  channels_.view_status.write(view_);
  if (out.fresh) channels_.vehicle_W.write(view_.state.p_W);
}

void ControlLoop::tick(std::int64_t now_ns, int missed, double lateness_us) noexcept {
  now_ns_ = now_ns;
  row_ = {};
  row_.odometry_to_wire_us = -1;
  row_.compute_us = static_cast<float>(compute_us_);
  row_.lateness_us = static_cast<float>(lateness_us);
  if (view_.ticks > 0) view_.tick.add(compute_us_);
  view_.lateness.add(lateness_us);

  poll(now_ns);
  const track::TickInput in = gather(now_ns, missed);
  if (in.odometry) {
    const auto& s = *in.odometry;
    log::OdometryRecord r{};
    r.stamp_ns = s.stamp_ns;
    std::copy_n(s.state.p_W.data(), 3, r.p);
    std::copy_n(s.state.v_W.data(), 3, r.v);
    std::copy_n(s.q.data(), 4, r.q);
    record(log::RecordKind::odometry, s.received_ns, &r, sizeof r);
  }
  const auto logged = log::encode(in);
  record(log::RecordKind::tick_input, now_ns, &logged, sizeof logged);
  const track::TickOutput out = flight_.step(in);
  send(in, out);
  learn(in, out);
  publish(in, out);
  report(in, out);
  for (const auto* segment : out.released) channels_.segments.give_back(segment);
  if (link_.signing()) channels_.signing_time.store(link_.signing()->time());
  ++view_.ticks;
  channels_.pulse.signal.store(signal_of(view_.mode), std::memory_order_relaxed);
  channels_.pulse.ticks.store(view_.ticks, std::memory_order_relaxed);
}

// What this tick says of the air, after its decision: nothing of it is decided by this before a world is made of it.
void ControlLoop::learn(const track::TickInput& in, const track::TickOutput& out) noexcept {
  if (!air_) return;
  while (const auto order = channels_.air_orders.pop()) carry_out(*order, in);
  const AirFactors before = air_->factors();
  if (log::ended(*air_, in)) tell_of_air(before, in);
  if (!log::flown(in, out) || !flight_.odometry()) return;
  const plan::AirPlace place = lookout_.air_at(flight_.odometry()->state.p_W);
  log::AirRecord r{};
  r.tick = view_.ticks;
  std::copy_n(place.sigma.data(), 3, r.sigma);
  r.air = static_cast<std::uint32_t>(place.air);
  const bool changed = log::learn(*air_, in, flight_, out, r);
  record(log::RecordKind::air, in.now_ns, &r, sizeof r);
  const auto here = static_cast<std::size_t>(place.air);
  view_.air->here = place.air;
  view_.air->ln_evidence[here] = r.ln_evidence;
  view_.air->seconds[here] = r.seconds;
  view_.air->causes[here] = air_->cause(place.air);
  if (changed) tell_of_air(before, in);
}

// A restart knows what outlives flights: neither calmer air, which was shown elsewhere, nor a load that is gone.
void ControlLoop::hand_over_air() noexcept {
  view_.air->factors = air_->factors();
  channels_.air.write({air_->factors(), air_falls_});
  channels_.air_kept.write(air_->kept());
}

void ControlLoop::tell_of_air(const AirFactors& before, const track::TickInput& in) noexcept {
  const AirFactors& now = air_->factors();
  bool fell = false;
  for (std::size_t k = 0; k < kAirClasses; ++k) {
    if (now[k] == before[k]) continue;
    fell = fell || now[k] < before[k];
    channels_.events.push_or_count({now[k] < before[k] ? ControlEvent::Kind::calmer : ControlEvent::Kind::rougher,
                                    in.now_ns, view_.mode, view_.reason, 0, static_cast<AirClass>(k), now[k],
                                    view_.air->ln_evidence[k], air_->cause(static_cast<AirClass>(k))});
  }
  air_falls_ += fell;
  hand_over_air();
}

// What an operator asks of it; the mission has judged it by what it was shown, which may be a moment old.
void ControlLoop::carry_out(adapt::AirOrder order, const track::TickInput& in) noexcept {
  log::AirOrderRecord r{};
  r.tick = view_.ticks, r.order = static_cast<std::uint32_t>(order);
  const bool changed = log::carry_out(*air_, in, r);
  record(log::RecordKind::air_order, in.now_ns, &r, sizeof r);
  if (r.done == 0)
    channels_.events.push_or_count({ControlEvent::Kind::air_kept, in.now_ns, view_.mode, view_.reason, 0});
  if (order == adapt::AirOrder::reset && r.done != 0) ++air_falls_, view_.air.emplace();
  view_.air->frozen = air_->frozen();
  if (changed) hand_over_air();
}

void ControlLoop::publish(const track::TickInput& in, const track::TickOutput& out) noexcept {
  const firmware_bridge::Time now{std::chrono::nanoseconds(in.now_ns)};
  const auto& telemetry = link_.telemetry();
  const auto& tracker = flight_.tracker();
  view_.t_ns = in.now_ns;
  view_.mode = out.supervisor.mode;
  view_.reason = out.supervisor.reason;
  view_.armed = in.autopilot.armed;
  view_.offboard = in.autopilot.offboard;
  view_.landed = out.landed;
  view_.shown.frames_aligned = flight_.alignment().aligned();
  view_.mismatch = flight_.alignment().mismatch();
  view_.odometry_age = flight_.odometry_age();
  view_.odometry_lost_after = flight_.odometry_lost_after();
  view_.heartbeat_age = in.autopilot.heartbeat_age;
  const auto value_of = [](const auto& said) { return said ? std::optional(said->value) : std::nullopt; };
  view_.clock = value_of(link_.clock(now));
  view_.untold_delay = link_.untold_delay();
  const auto trip = link_.round_trip(now);
  view_.round_trip = trip ? std::optional(seconds(*trip)) : std::nullopt;
  view_.loss = link_.loss();
  view_.estimator_follows = value_of(telemetry.estimator_follows.at(now));
  view_.would_arm = value_of(telemetry.would_arm.at(now));
  view_.pose_age = in.autopilot.pose_age(in.now_ns);
  if (flight_.odometry()) view_.state = flight_.odometry()->state;
  view_.command = out.command;
  view_.epoch = flight_.epoch();
  view_.segment = tracker.segment();
  view_.index = tracker.index();
  view_.finished = tracker.finished();
  view_.braking = tracker.braking();
  view_.stop_branch = tracker.stop_branch();
  view_.closures = tracker.closures();
  view_.shift = tracker.shift();
  if (out.refused) view_.refused_segment = in.segment->id;
  view_.shown.odometry_received += in.odometry.has_value();
  view_.shown.odometry_rejected += in.odometry && !out.fresh;
  if (out.inside.judged) ++(out.inside.inside ? view_.shown.samples_inside : view_.shown.samples_outside);
  view_.shown.ticks_missed += static_cast<std::uint64_t>(in.missed_periods);
  view_.shown.frames_bad = link_.received().bad_crc;
  if (link_.signing()) view_.shown.frames_refused = link_.signing()->counters().refused();
  constexpr std::uint8_t kWorstNotice = 4;  // severity: 4 is a warning
  if (telemetry.text && telemetry.text->value.severity <= kWorstNotice) view_.warning = telemetry.text;
  const auto battery = telemetry.battery.at(now);
  if (view_.battery && view_.battery->value.remaining && !(battery && battery->value.remaining))
    channels_.events.push_or_count({ControlEvent::Kind::battery_silent, in.now_ns, view_.mode, view_.reason, 0});
  view_.battery = battery;
  view_.residual_m = flight_.alignment().position_residual();
  view_.shown.frame_residual_rad = flight_.alignment().yaw_residual();
}

}  // namespace backwash::daemon
