// SPDX-License-Identifier: BSD-3-Clause
#include "tests/daemon/lockstep/lockstep.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <Eigen/Geometry>
#include <fstream>

#include "core/config/config.hpp"
#include "core/log/raw/tick_log.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/rest.hpp"
#include "core/sim/flight.hpp"
#include "core/types/minimum_jerk.hpp"
#include "firmware_bridge/mavlink/frames.hpp"
#include "services/backwashd/channels.hpp"
#include "tests/daemon/lockstep/lockstep_line.hpp"
#include "tests/daemon/lockstep/traps.hpp"

namespace backwash::daemon::test {
namespace {

constexpr std::int64_t kTick_ns = 20'000'000, kStep_ns = 1'000'000;
constexpr double kBatteryLand = 0.15;
const Vec3 kStart(-2, 0, 1.2), kGoal(2, 0, 1.2);

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

/// Every float of every message is a number, but for the one NaN by which MAVLink's ODOMETRY marks unknown rates, and a
/// block of variances.
template <typename Message>
void expect_finite(const Message& message) {
  constexpr bool kOdometry = std::is_same_v<Message, mavlink::Odometry>;
  const auto number = [](std::string_view name, float v, bool may_be_unknown) {
    EXPECT_TRUE(std::isfinite(v) || (may_be_unknown && std::isnan(v))) << Message::kName << '.' << name << " is " << v;
  };
  const auto field = [&](const auto& f) {
    const auto& value = message.*f.member;
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, float>) {
      number(f.name, value, kOdometry && (f.name == "rollspeed" || f.name == "pitchspeed" || f.name == "yawspeed"));
    } else if constexpr (requires { value.size(); }) {
      if constexpr (std::is_same_v<typename Value::value_type, float>)
        for (const float v : value)
          number(f.name, v, kOdometry && (f.name == "pose_covariance" || f.name == "velocity_covariance"));
    }
  };
  std::apply([&](const auto&... f) { (field(f), ...); }, Message::fields());
}

}  // namespace

Vehicle vehicle_5in() { return config::load_vehicle("builtin:quad-5in").value(); }

std::shared_ptr<const plan::World> corridor() {
  static const auto world = plan::build_world(map::builtin_scene("parallel-walls-4m").value(), Model{}, vehicle_5in());
  return world;
}

bool Wire::commanded(std::uint16_t command) const {
  for (const auto& c : commands)
    if (c.command == command) return true;
  return false;
}

Lockstep::Lockstep(const bench::LocalFrame& local, Medium medium, std::shared_ptr<const plan::World> world,
                   const OdometryTiming& timing)
    : local_frame(local),
      world_(std::move(world)),
      vehicle_(vehicle_5in()),
      vio_(0.75 * vehicle_.estimation.position, 2),
      medium_(medium),
      timing_(timing) {
  const Vec3 ground(kStart.x(), kStart.y(), vehicle_.body.radius);
  autopilot = std::make_unique<HandledAutopilot>(world_->grid, vehicle_, ground, local_frame, 1, 1);
  restart();
}

Lockstep::~Lockstep() {
  loop_.reset();
  channels->ports.collect();
}

void Lockstep::restart(bool with_map) {
  loop_.reset();
  link_.reset();
  line_ = make_line();
  void* memory = ::mmap(nullptr, sizeof(Channels), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  channels.reset(new (memory) Channels);
  link_ = std::make_unique<firmware_bridge::AutopilotLink>(line_->open(), std::uint8_t{1},
                                                           firmware_bridge::Time(std::chrono::nanoseconds(now_ns_)));
  loop_ = std::make_unique<ControlLoop>(*channels, *link_, vehicle_, kBatteryLand, map_settings, timing_, air);
  if (with_map) channels->worlds.offer({world_, now_ns_});
  log.clear();
}

void Lockstep::Unmap::operator()(Channels* c) const {
  c->~Channels();
  ::munmap(c, sizeof(Channels));
}

void Lockstep::forget_pages() { ASSERT_EQ(::madvise(channels.get(), sizeof(Channels), MADV_DONTNEED), 0); }

void Lockstep::hang_up() { line_.reset(); }

void Lockstep::plug_in() {
  line_ = make_line();
  channels->ports.offer(std::make_unique<const FreshPort>(line_->open()));
}

void Lockstep::hand_over(const std::vector<std::uint8_t>& bytes) {
  if (line_ && !bytes.empty()) line_->write(bytes);
}

void Lockstep::drain_log() {
  channels->segments.collect();
  channels->ports.collect();
  while (const auto r = recorded ? channels->control_log.pop() : std::nullopt)
    log.push_back({r->header, {r->bytes.begin(), r->bytes.begin() + r->header.size}});
}

void Lockstep::slow_line(double baud, bool thinned) {
  baud_ = baud;
  if (thinned) link_->pace(firmware_bridge::serial_line(baud, firmware_bridge::kSerialShare, false));
}

// What was sent in this tick leaves with the next ones: a line that has nothing to carry gathers no credit.
void Lockstep::carry(std::vector<std::uint8_t>& bytes) {
  constexpr double kBitsPerByte = 10;
  credit_ = under_way_.empty() ? 0 : credit_ + baud_ * kControlPeriod;
  const auto carried = std::min(under_way_.size(), static_cast<std::size_t>(credit_ / kBitsPerByte));
  credit_ -= kBitsPerByte * static_cast<double>(carried);
  const auto end = under_way_.begin() + static_cast<std::ptrdiff_t>(carried);
  std::vector<std::uint8_t> arrived(under_way_.begin(), end);
  under_way_.erase(under_way_.begin(), end);
  under_way_.insert(under_way_.end(), bytes.begin(), bytes.end());
  bytes = std::move(arrived);
}

void Lockstep::read_wire(std::size_t expected) {
  wire_ = {};
  if (!line_ || unread) return;
  std::vector<std::uint8_t> bytes = line_->read(expected);
  if (recorded) {
    ASSERT_EQ(bytes.size(), expected) << "what is on the wire is not what was logged";
  }
  if (baud_ > 0) carry(bytes);
  wire_.bytes = bytes.size();
  parser_.feed(bytes, [&](const mavlink::Frame& f) {
    mavlink::decode_and_visit(f.id, f.payload, [&](const auto& message) {
      using M = std::decay_t<decltype(message)>;
      expect_finite(message);
      if constexpr (std::is_same_v<M, SetPositionTargetLocalNed>) wire_.setpoints.push_back(message);
      if constexpr (std::is_same_v<M, CommandLong>) wire_.commands.push_back(message);
      if constexpr (std::is_same_v<M, mavlink::Heartbeat>) ++wire_.heartbeats;
      if constexpr (std::is_same_v<M, mavlink::Odometry>) {
        ++wire_.odometry;
        wire_.odometry_us = message.time_usec;
      }
      if constexpr (std::is_same_v<M, mavlink::Statustext>)
        wire_.texts.emplace_back(message.text.data(), ::strnlen(message.text.data(), message.text.size()));
    });
  });
  autopilot->receive(bytes, static_cast<double>(now_ns_) * 1e-9);
}

const Wire& Lockstep::tick(int missed) {
  std::vector<std::uint8_t> out;
  const int steps = 20 * (1 + missed);
  for (int step = 1; step <= steps; ++step) {
    now_ns_ += kStep_ns;
    const double t = static_cast<double>(now_ns_) * 1e-9;
    autopilot->step(t, out);
    if (!vio_on || step != steps - vio_age_steps) continue;
    OdometrySample sample;
    sample.received_ns = sample.stamp_ns = now_ns_;
    sample.state = vio_.estimate(autopilot->truth(), t);
    const auto q = autopilot->attitude();
    sample.q = {q.w(), q.x(), q.y(), q.z()};
    if (spoil) spoil(sample);
    const auto taken = reader ? reader(sample) : std::optional(sample);
    if (taken) channels->odometry.write(*taken);
  }
  out.insert(out.end(), inject_.begin(), inject_.end());
  inject_.clear();
  if (noise) noise(out);
  hand_over(out);

  const auto before = backwash::test::trapped();
  const long faults = page_faults();  // the rig's own, between ticks, do not count
  {
    const backwash::test::Watched watched;
    loop_->tick(now_ns_, missed, 0);
  }
  if (view().ticks > 3) page_faults_in_flight += page_faults() - faults;
  loop_->took(0);
  const auto after = backwash::test::trapped();
  EXPECT_EQ(after.allocations - before.allocations, 0) << "the tick allocated";
  EXPECT_EQ(after.locks - before.locks, 0) << "the tick took a lock";
  EXPECT_EQ(after.wall_clock - before.wall_clock, 0) << "the tick read the wall clock";

  std::size_t sent = 0;
  const std::size_t from = log.size();
  drain_log();
  for (std::size_t i = from; i < log.size(); ++i)
    if (log[i].header.kind == log::RecordKind::frame_out) sent += log[i].header.size;
  read_wire(sent);
  return wire_;
}

void Lockstep::ticks(int count) {
  for (int n = 0; n < count; ++n) tick();
}

int Lockstep::ticks_until(Mode wanted, int most) {
  for (int n = 1; n <= most; ++n) {
    tick();
    if (mode() == wanted) return n;
  }
  return -1;
}

std::uint64_t Lockstep::offer(std::vector<Setpoint> commands, bool with_stops, bool arms) {
  auto segment = std::make_unique<track::AcceptedSegment>();
  segment->id = ++last_segment_;
  segment->closures = view().closures;
  segment->epoch = view().epoch;
  segment->arms = arms;
  segment->seen_ns = now_ns_;
  const Setpoint& here = view().command;
  if (!arms) commands.insert(commands.begin(), timing_.lead(), {here.p_W, Vec3::Zero(), Vec3::Zero(), here.yaw});
  const State start = view().state;
  segment->air = sets_of;
  segment->tube = plan::tube_to_rest(*world_, start, view().command, commands);
  if (with_stops)
    segment->stops = plan::verified_stops(*world_, start, view().command, commands, 0, 10,
                                          [&](const auto& tube) { return plan::lateral_clearance(*world_, tube); });
  segment->commands = std::move(commands);
  const auto bytes = log::encode(*segment);
  log.push_back({{now_ns_, log::RecordKind::offer, static_cast<std::uint32_t>(bytes.size())}, bytes});
  channels->segments.offer(std::move(segment));
  return last_segment_;
}

void Lockstep::take_off() {
  ticks(60);
  channels->orders.push_or_count({track::Request::enable});
  ASSERT_GT(ticks_until(Mode::tracking, 250), 0) << to_string(reason());
  offer(rise(), true, true);
  ASSERT_EQ(ticks_until(Mode::lifting, 3) > 0, true) << to_string(reason());
  ASSERT_GT(ticks_until(Mode::tracking, 500), 0) << to_string(reason());
  auto commands = rise();
  const auto count = static_cast<int>(commands.size());
  offer(std::move(commands));
  ticks(count + static_cast<int>(timing_.lead()) + 5);
  ASSERT_EQ(mode(), Mode::tracking) << to_string(reason());
  ASSERT_TRUE(view().finished);
  ASSERT_LT((autopilot->truth().p_W - kStart).norm(), 0.2);
}

std::vector<Setpoint> Lockstep::rise() const {
  const auto& limits = vehicle_.limits;
  auto commands = rest_to_rest(view().command.p_W, kStart, limits.v_max, limits.a_max);
  plan::hold_until_settled(world_->reach, commands);
  for (auto& c : commands) c.yaw = view().command.yaw;
  return commands;
}

void Lockstep::start_route(double seconds) {
  plan::PlanOptions options{};
  options.v_max = vehicle_.limits.v_max;
  options.a_max = vehicle_.limits.a_max;
  const auto planned = plan::plan(*world_, {view().state, view().command}, kGoal, options);
  ASSERT_EQ(planned.status, plan::PlanStatus::ok) << planned.message;
  route_ = planned.commands;
  route_.insert(route_.end(), 100, Setpoint(route_.back()));  // 2 s
  const auto id = offer(route_);
  ticks(static_cast<int>(seconds / kControlPeriod));
  ASSERT_EQ(view().segment, id);
  ASSERT_EQ(mode(), Mode::tracking) << to_string(reason());
}

Setpoint Lockstep::in_map(const SetPositionTargetLocalNed& m) const {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(-local_frame.yaw, Vec3::UnitZ()).toRotationMatrix();
  return {R * (mavlink::swap_ned({m.x, m.y, m.z}) - local_frame.origin), R * mavlink::swap_ned({m.vx, m.vy, m.vz}),
          R * mavlink::swap_ned({m.afx, m.afy, m.afz}), mavlink::swap_yaw(m.yaw) - local_frame.yaw};
}

void Lockstep::save(const std::string& path) const {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << log::kRawLogMagic;
  for (const auto& r : log) {
    out.write(reinterpret_cast<const char*>(&r.header), sizeof r.header);
    out.write(reinterpret_cast<const char*>(r.bytes.data()), static_cast<std::streamsize>(r.bytes.size()));
  }
}

}  // namespace backwash::daemon::test
