// SPDX-License-Identifier: BSD-3-Clause
// What each event does to the daemon.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/map/octomap/octomap_message.hpp"
#include "firmware_bridge/mavlink/frames.hpp"
#include "services/backwashd/map/scan_placement.hpp"
#include "tests/fuzz/sequence/daemon_rig.hpp"

namespace backwash::fuzz {
namespace {

using Kind = Event::Kind;

const Vec3 kRoomLow(-2.4, -1.2, 0.7), kRoomHigh(2.4, 1.2, 1.7);  // where an operator sends the vehicle
constexpr int kMostFlights = 6;                                  // that he asks for: a plan costs 10 ms and more

Vec3 place(const Event& e) { return kRoomLow + Vec3(e.a, e.b, e.c).cwiseProduct(kRoomHigh - kRoomLow); }

const std::string kMap = "map", kOdom = "odom", kBody = "base_link";

builtin_interfaces_msg_dds__Time_ stamp(std::int64_t ns) {
  return {static_cast<std::int32_t>(ns / 1'000'000'000), static_cast<std::uint32_t>(ns % 1'000'000'000)};
}

Eigen::Quaterniond about_z(double yaw) { return Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vec3::UnitZ())); }

}  // namespace

void DaemonRig::apply(const Event& e) {
  switch (e.kind) {
    case Kind::operate:
      return operate(e);
    case Kind::command:
      return send(static_cast<std::uint8_t>(e.n), e);
    case Kind::foreign: {
      auto other = last_command_;
      std::snprintf(other.station.data(), other.station.size(), "another");
      other.writer[0] = 2;
      other.session = 1'000'000;
      other.verb = static_cast<std::uint8_t>(e.n);
      other.position = place(e);
      other.sequence = sequence_ + 1;
      lock_.channels->commands.push_or_count(other);
      return;
    }
    case Kind::repeated:
      lock_.channels->commands.push_or_count(last_command_);
      return;
    case Kind::departed: {
      daemon::CommandMessage gone;
      gone.departed = true;
      gone.writer[0] = static_cast<std::uint8_t>(e.n % 3);
      lock_.channels->commands.push_or_count(gone);
      return;
    }
    case Kind::old_number: {
      auto old = last_command_;
      old.sequence -= std::min<std::uint32_t>(old.sequence, 1 + sequence_ / 2);
      old.verb = static_cast<std::uint8_t>(e.n);
      lock_.channels->commands.push_or_count(old);
      return;
    }
    case Kind::new_session:
      ++session_;
      return send(static_cast<std::uint8_t>(e.n), e);
    case Kind::missed:
      missed_ = e.n;
      return;
    case Kind::restart:
      restarts_ = true;
      lock_.channels->stop = true;  // the planner returns
      return;
    case Kind::hang_up:
      return lock_.hang_up();
    case Kind::plug_in:
      return lock_.plug_in();
    default:
      break;
  }
  if (e.kind >= Kind::closure && e.kind <= Kind::scan_box) return apply_to_map(e);
  if (e.kind == Kind::vio_freeze) frozen_.reset();
  if (e.kind == Kind::vio_drift) drifted_ = Vec3::Zero();
  lasting_[e.kind] = e;
  lasting_[e.kind].tick = tick_;
  if (e.kind >= Kind::noise && e.kind <= Kind::parameter) apply_to_line(e);
}

void DaemonRig::send(std::uint8_t verb, const Event& e) {
  daemon::CommandMessage c;
  std::snprintf(c.station.data(), c.station.size(), "station");
  c.writer[0] = 1;
  c.session = session_;
  c.sequence = ++sequence_;
  c.verb = verb;
  c.position = place(e);
  c.yaw = 6 * e.a - 3;
  c.waypoints = 2;
  c.waypoint[0] = {c.position.x(), c.position.y(), c.position.z()};
  c.waypoint[1] = {-c.position.x(), -c.position.y(), 1.2};
  last_command_ = c;
  lock_.channels->commands.push_or_count(c);
}

// An operator who wants to fly: enables, takes off, flies, now and then stops, holds or lands.
void DaemonRig::operate(const Event& e) {
  const auto& view = lock_.view();
  if (view.mode == Mode::passive || view.mode == Mode::quiet) return send(backwash_msgs_msg_dds__COMMAND_ENABLE, e);
  if (e.n < 12) return send(backwash_msgs_msg_dds__COMMAND_STOP, e);
  if (view.mode != Mode::tracking && view.mode != Mode::hold) return;
  if (e.n < 18) return send(backwash_msgs_msg_dds__COMMAND_HOLD, e);
  if (e.n < 22) return send(backwash_msgs_msg_dds__COMMAND_LAND, e);
  if (!view.finished || plans_ >= kMostFlights) return;
  if (view.landed.value_or(true)) return send(backwash_msgs_msg_dds__COMMAND_TAKEOFF, e);
  send(e.n < 40 ? backwash_msgs_msg_dds__COMMAND_FOLLOW : backwash_msgs_msg_dds__COMMAND_GOTO, e);
}

// The daemon's end of DDS: the sample as a message, spoiled, through what reads it.
std::optional<track::OdometrySample> DaemonRig::read(const track::OdometrySample& sample) {
  if (lasting(Kind::vio_off)) return std::nullopt;
  track::OdometrySample s = sample;
  if (const auto* e = lasting(Kind::vio_shift)) s.state.p_W += Vec3(e->a, e->b, e->c);
  if (const auto* e = lasting(Kind::vio_drift)) s.state.p_W += drifted_ += 0.02 * Vec3(e->a, e->b, e->c);
  if (const auto* e = lasting(Kind::vio_scale)) {
    s.state.p_W *= 1 + e->a;
    s.state.v_W *= 1 + e->a;
  }
  Eigen::Quaterniond q(s.q[0], s.q[1], s.q[2], s.q[3]);
  if (const auto* e = lasting(Kind::vio_turn)) {
    q = about_z(e->a) * q;
    s.state = {about_z(e->a) * s.state.p_W, about_z(e->a) * s.state.v_W};
  }
  if (lasting(Kind::vio_freeze)) {
    if (!frozen_) frozen_ = s;
    s.state = frozen_->state;
    q = {frozen_->q[0], frozen_->q[1], frozen_->q[2], frozen_->q[3]};
  }
  if (const auto* e = lasting(Kind::vio_late)) {
    s.stamp_ns -= static_cast<std::int64_t>(std::abs(e->a) * 1e9);
    s.state.p_W -= std::abs(e->a) * s.state.v_W;
  }
  if (const auto* e = lasting(Kind::vio_stamp)) s.stamp_ns += static_cast<std::int64_t>(e->a * 1e9);
  if (lasting(Kind::vio_repeat)) s.stamp_ns = repeated_ns_;
  repeated_ns_ = s.stamp_ns;

  const Vec3 v_B = q.conjugate() * s.state.v_W;
  std::array<double, 10> m{s.state.p_W.x(), s.state.p_W.y(), s.state.p_W.z(), v_B.x(), v_B.y(),
                           v_B.z(),         q.w(),           q.x(),           q.y(),   q.z()};
  if (const auto* e = lasting(Kind::vio_nan))
    m[static_cast<std::size_t>(e->b)] = std::numeric_limits<double>::quiet_NaN();
  if (const auto* e = lasting(Kind::vio_huge)) m[static_cast<std::size_t>(e->b)] = e->a;
  dds::Odometry message{};
  message.header.stamp = stamp(std::max<std::int64_t>(0, s.stamp_ns));
  message.header.frame_id = dds::c_string(threads_->localization.closures() > 0 ? kOdom : kMap);
  message.child_frame_id = dds::c_string(kBody);
  message.pose.pose.position = {m[0], m[1], m[2]};
  message.pose.pose.orientation = {m[7], m[8], m[9], m[6]};
  message.twist.twist.linear = {m[3], m[4], m[5]};
  const auto taken = threads_->localization.odometry(message, s.received_ns);
  return taken ? std::optional(*taken) : std::nullopt;
}

void DaemonRig::offer_map(const map::OccupancyGrid& grid, std::vector<std::int8_t> data) {
  lock_.channels->maps.offer(std::make_unique<const daemon::MapMessage>(
      daemon::MapMessage{std::move(data), grid.resolution(), true, "OcTree", lock_.now_ns()}));
  threads_->map.step();
}

void DaemonRig::apply_to_map(const Event& e) {
  map::OccupancyGrid grid = lock_.world().grid;
  switch (e.kind) {
    case Kind::closure: {
      dds::TransformStamped m{};
      m.header.frame_id = dds::c_string(kMap);
      m.child_frame_id = dds::c_string(kOdom);
      closure_ = track::RigidShift{e.d, Vec3(e.a, e.b, e.c / 4)} * closure_;
      const auto turned = about_z(closure_.yaw);
      m.transform.translation = {closure_.t.x(), closure_.t.y(), closure_.t.z()};
      m.transform.rotation = {turned.x(), turned.y(), turned.z(), turned.w()};
      (void)threads_->localization.loop_closure(m);
      return;
    }
    case Kind::map_same:
      return offer_map(grid, map::encode_octomap(grid));
    case Kind::map_box: {
      const Index3 at = grid.index(place(e));
      for (int k = -1; k <= 1; ++k) grid.set(at + Index3(k, 0, 0), map::Cell::occupied);
      return offer_map(grid, map::encode_octomap(grid));
    }
    case Kind::map_elsewhere: {
      const Vec3 corner(std::round(50 * e.a), std::round(50 * e.b), std::round(50 * e.c));
      const map::OccupancyGrid other(0.2 * corner, 0.2, {10, 10, 10}, map::Cell::free);
      return offer_map(other, map::encode_octomap(other));
    }
    case Kind::map_damaged: {
      auto data = map::encode_octomap(grid);
      for (int n = 0; n < e.n; ++n) data[static_cast<std::size_t>(n * 7919 + tick_) % data.size()] ^= 0x55;
      return offer_map(grid, std::move(data));
    }
    case Kind::map_resolution: {
      const map::OccupancyGrid other({0, 0, 0}, 0.1, {10, 10, 10}, map::Cell::free);
      return offer_map(other, map::encode_octomap(other));
    }
    default:
      return scan_box(place(e));
  }
}

// As services/backwashd/map/map_front.cpp takes a scan, but for the message around it.
void DaemonRig::scan_box(const Vec3& at) {
  std::vector<Vec3> points;
  for (int i = -2; i <= 2; ++i)
    for (int j = -2; j <= 2; ++j) points.push_back(at + 0.05 * Vec3(i, j, 0));
  auto scan = std::make_unique<daemon::Scan>(daemon::Scan{points, lock_.view().state.p_W, lock_.now_ns()});
  look();
  if (threads_->known) {
    const auto voxels = daemon::new_voxels(threads_->known->grid, *scan, 8);
    if (voxels.count > 0) lock_.channels->scan_voxels.push_or_count(voxels);
  }
  if (lock_.channels->scans.push(scan.get())) scan.release();
  threads_->map.step();
}

void DaemonRig::spoil_bytes(std::vector<std::uint8_t>& bytes) {
  if (const auto* e = lasting(Kind::damage)) {
    const auto every = static_cast<std::size_t>(2 + std::abs(e->a));
    for (std::size_t n = static_cast<std::size_t>(tick_) % every; n < bytes.size(); n += every) bytes[n] ^= 0x5a;
  }
  if (lasting(Kind::swap) && bytes.size() > 20)
    std::rotate(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), bytes.end());
  if (!lasting(Kind::deaf)) return;
  // Only what is not about the motion passes.
  std::vector<std::uint8_t> left;
  mavlink::Parser parser;
  parser.feed(bytes, [&](const mavlink::Frame& f) {
    if (f.id == mavlink::LocalPositionNed::kId || f.id == mavlink::AttitudeQuaternion::kId) return;
    left.insert(left.end(), f.bytes.begin(), f.bytes.end());
  });
  bytes = left;
}

void DaemonRig::apply_to_line(const Event& e) {
  using namespace mavlink;
  const auto value = static_cast<float>(e.a);
  switch (e.kind) {
    case Kind::noise:
      for (int n = 0; n < e.n; ++n)
        lock_.inject_.push_back(n % 17 == 0 ? 0xFD : static_cast<std::uint8_t>(n * 31 + tick_ * 7));
      return;
    case Kind::heartbeat:
      return lock_.say(Heartbeat{.custom_mode = (e.n & 2 ? 6u : 1u) << 16,
                                 .type = 2,
                                 .autopilot = 12,
                                 .base_mode = static_cast<std::uint8_t>(1 | (e.n & 1 ? 128 : 0)),
                                 .system_status = 4,
                                 .mavlink_version = 3});
    case Kind::take_over:
      return lock_.in_hand().take_over();
    case Kind::disarm:
      return lock_.in_hand().disarm();
    case Kind::ack:
      return lock_.say(
          CommandAck{.command = static_cast<std::uint16_t>(e.n), .result = static_cast<std::uint8_t>(e.b)});
    case Kind::position: {
      watch_.frame_moved(tick_);
      std::array<float, 6> m{5, -3, 0, 0, 0, 0};
      m[static_cast<std::size_t>(e.b) % 6] = e.c > 0 ? std::numeric_limits<float>::quiet_NaN() : value;
      return lock_.say(LocalPositionNed{static_cast<std::uint32_t>(20 * tick_), m[0], m[1], m[2], m[3], m[4], m[5]});
    }
    case Kind::attitude:
      watch_.frame_moved(tick_);
      return lock_.say(AttitudeQuaternion{.q1 = value, .q2 = value, .q3 = 0, .q4 = 1});
    case Kind::battery:
      lock_.autopilot->battery = std::clamp(std::abs(e.a), 0.0, 1.0);
      return;
    case Kind::timesync:
      return lock_.say(Timesync{0, 20'000'000LL * (tick_ + 1), 1, firmware_bridge::kOnboardComputer});
    case Kind::reset:
      lock_.local_frame.origin += Vec3(e.a, e.b, e.c);
      lock_.local_frame.yaw += e.d;
      lock_.in_hand().reset_estimator(lock_.local_frame);
      return watch_.frame_moved(tick_);
    case Kind::reset_counter:
      watch_.frame_moved(tick_);
      return lock_.say(Odometry{.q = {1, 0, 0, 0}, .reset_counter = static_cast<std::uint8_t>(e.n)});
    case Kind::parameter:
      return lock_.say(
          ParamValue{.param_value = value, .param_count = 1, .param_id = {'C', 'O', 'M'}, .param_type = 9});
    default:
      return;
  }
}

}  // namespace backwash::fuzz
