// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/localization.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/types/angle.hpp"
#include "services/backwashd/text.hpp"

namespace backwash::daemon {
namespace {

constexpr double kUnit = 1e-2;  // of a quaternion's norm
// What no map and no vehicle indoors reaches. A float, as it goes on the wire, resolves 1 mm at 10 km.
constexpr double kFarthest = 10'000, kFastest = 100;  // m, m/s
constexpr double kMaxTilt = 1.0 * kDegree;            // rad

// Written so that what is no number is not within.
bool within(const Vec3& v, double most) { return v.norm() <= most; }

std::string text(const char* s) { return s ? s : ""; }

/// Three of the diagonal of a row-major 6 × 6 covariance; nothing where it is not known.
std::optional<Vec3> variances(const double* covariance, std::size_t first) {
  const auto at = [&](std::size_t n) { return covariance[7 * (first + n)]; };
  const Vec3 v(at(0), at(1), at(2));
  if (!v.cast<float>().allFinite() || !(v.minCoeff() > 0)) return std::nullopt;
  return v;
}

/// When it is of and how well it is known; no pose yet.
OdometrySample told_with(const dds::Odometry& m, std::int64_t received_ns) {
  OdometrySample s;
  s.received_ns = received_ns;
  s.stamp_ns = dds::nanoseconds(m.header.stamp);
  s.position_variance = variances(m.pose.covariance, 0);
  s.attitude_variance = variances(m.pose.covariance, 3);
  s.velocity_variance = variances(m.twist.covariance, 0);
  return s;
}

/// Whose odometry has these frames; empty: nobody's that is known.
std::string looks_like(const std::string& frame, const std::string& child) {
  for (const auto& p : config::odometry_profiles())
    if (p.frame == frame && p.child == child)
      return " (this looks like " + std::string(p.told) + ": odometry.profile = \"" + std::string(p.name) + "\")";
  return "";
}

}  // namespace

tl::unexpected<std::string> wrong_frame(const std::string& what, const std::string& frame, const std::string& right) {
  return tl::unexpected(what + " is in frame '" + printable(frame, 128) + "', expected " + right +
                        "; see [frames] of the configuration");
}

Localization::Localization(const config::Daemon& config, double max_sigma)
    : frames_(config.frames),
      told_(config.odometry),
      body_from_sensor_(Eigen::AngleAxisd(told_.sensor_turned.z(), Vec3::UnitZ()) *
                        Eigen::AngleAxisd(told_.sensor_turned.y(), Vec3::UnitY()) *
                        Eigen::AngleAxisd(told_.sensor_turned.x(), Vec3::UnitX())),
      max_sigma_(max_sigma) {
  if (told_.child.empty()) told_.child = frames_.body;
}

/// Why a message in these frames cannot be placed, or holds its own position for too uncertain; empty: neither.
std::string Localization::unusable(const dds::Odometry& m) const {
  const std::string frame = text(m.header.frame_id), child = text(m.child_frame_id);
  if (child != told_.child)
    return wrong_frame("the twist of the odometry", child, "'" + told_.child + "'" + looks_like(frame, child)).value();
  if (frame != frames_.map && frame != frames_.odometry)
    return wrong_frame("the odometry", frame,
                       "'" + frames_.map + "' or '" + frames_.odometry + "'" +
                           (told_.message == config::PoseMessage::odometry ? looks_like(frame, child) : ""))
        .value();
  if (frame == frames_.odometry && !map_from_odom_)
    return "odometry in frame '" + frame + "' before the first loop_closure from it to '" + frames_.map + "'";
  const double* covariance = m.pose.covariance;
  const bool unknown = covariance[0] == -1 || (covariance[0] == 0 && covariance[7] == 0 && covariance[14] == 0);
  const double worst = std::max({covariance[0], covariance[7], covariance[14]});
  if (!unknown &&
      !(covariance[0] >= 0 && covariance[7] >= 0 && covariance[14] >= 0 && worst <= max_sigma_ * max_sigma_))
    return "the odometry's own position error is above the vehicle's estimation.position of " +
           std::to_string(max_sigma_) + " m";
  return {};
}

/// The body's velocity in the frame of the pose. `attitude`: the sensor's; `lever`: from the body to the sensor.
/// Nothing: it comes from poses, of which too few are known yet.
std::optional<Vec3> Localization::velocity(const dds::Odometry& m, std::int64_t stamp_ns, const Vec3& p_W,
                                           const Eigen::Quaterniond& attitude, const Vec3& lever) {
  if (told_.twist == config::Twist::none) {
    const bool of_odometry = text(m.header.frame_id) == frames_.odometry;
    // Between poses in different frames lies no way that was flown.
    if (std::exchange(velocity_of_odometry_, of_odometry) != of_odometry) velocity_ = {};
    return within(p_W, kFarthest) ? velocity_.add(stamp_ns, p_W) : Vec3::Zero();
  }
  const auto& v = m.twist.twist.linear;
  const auto& w = m.twist.twist.angular;
  const bool in_body = told_.twist == config::Twist::body;
  const Vec3 linear(v.x, v.y, v.z), angular(w.x, w.y, w.z);
  Vec3 v_W = in_body ? attitude * linear : linear;
  if (!lever.isZero(0)) v_W -= (in_body ? attitude * angular : angular).cross(lever);
  return v_W;
}

tl::expected<OdometrySample, std::string> Localization::odometry(const dds::Odometry& m, std::int64_t received_ns) {
  if (std::string why = unusable(m); !why.empty()) return tl::unexpected<std::string>(std::move(why));
  const auto& p = m.pose.pose.position;
  const auto& q = m.pose.pose.orientation;
  OdometrySample s = told_with(m, received_ns);
  const Eigen::Quaterniond sensor(q.w, q.x, q.y, q.z);
  // The gate would reject what is refused here too, but here it takes no good sample's place, and places no scan.
  if (!(std::abs(sensor.norm() - 1) < kUnit))
    return tl::unexpected<std::string>("the odometry's quaternion is not of unit length");
  Eigen::Quaterniond attitude = sensor * body_from_sensor_.conjugate();
  const Vec3 lever = attitude * told_.sensor_B;
  s.state.p_W = Vec3(p.x, p.y, p.z) - lever;
  const auto v_W = velocity(m, s.stamp_ns, s.state.p_W, sensor, lever);
  if (!v_W)
    return tl::unexpected<std::string>("the velocity is not known yet: it comes from the poses of the last 0.2 s");
  s.state.v_W = *v_W;
  if (text(m.header.frame_id) == frames_.odometry) {
    p_O_ = s.state.p_W;
    settle();
    s.map_from_odom = *map_from_odom_;
    s.closures = closures_;
    s.state = map_from_odom_->state(s.state);
    attitude = Eigen::Quaterniond(Eigen::AngleAxisd(map_from_odom_->yaw, Vec3::UnitZ())) * attitude;
  }
  if (!within(s.state.p_W, kFarthest) || !within(s.state.v_W, kFastest))
    return tl::unexpected<std::string>("the odometry is not finite, further than 10 km or faster than 100 m/s");
  s.q = {attitude.w(), attitude.x(), attitude.y(), attitude.z()};
  return s;
}

/// The newest transform is in use unless it is no closure where the vehicle is now: far on it may be one.
void Localization::settle() {
  if (!newest_ || (map_from_odom_ && p_O_ && step_to(*newest_) <= max_sigma_)) return;
  const bool repeats = map_from_odom_ && map_from_odom_->yaw == newest_->yaw && map_from_odom_->t == newest_->t;
  if (!repeats) {
    map_from_odom_ = *newest_;
    ++closures_;
  }
  newest_.reset();
}

/// By how much a transform moves the vehicle, and what is a metre away from it: obstacles beyond count for nothing.
double Localization::step_to(const track::RigidShift& newest) const {
  const track::RigidShift step = map_from_odom_->inverse() * newest;
  return (step.point(*p_O_) - *p_O_).norm() + std::abs(wrap_angle(step.yaw)) * 1.0;
}

tl::expected<void, std::string> Localization::loop_closure(const dds::TransformStamped& m) {
  const std::string frame = text(m.header.frame_id), child = text(m.child_frame_id);
  if (frame != frames_.map || child != frames_.odometry)
    return wrong_frame("the loop closure", child + "' in '" + frame,
                       "'" + frames_.odometry + "' in '" + frames_.map + "'");
  const auto& t = m.transform.translation;
  const auto& r = m.transform.rotation;
  const Eigen::Quaterniond q(r.w, r.x, r.y, r.z);
  const Vec3 translation(t.x, t.y, t.z);
  if (!within(translation, kFarthest) || !(std::abs(q.norm() - 1) < kUnit))
    return tl::unexpected<std::string>("the loop closure is not a transform within 10 km with a unit quaternion");
  if (!((q * Vec3::UnitZ()).z() >= std::cos(kMaxTilt)))
    return tl::unexpected<std::string>(
        "the loop closure tilts the vertical by more than 1 degree; both frames must be z-up");
  const track::RigidShift newest{
      std::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z())), translation};
  newest_ = newest;
  settle();
  return {};
}

}  // namespace backwash::daemon
