// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/localization.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "services/backwashd/text.hpp"

namespace backwash::daemon {
namespace {

constexpr double kUnit = 1e-2;  // of a quaternion's norm
// What no map and no vehicle indoors reaches. A float, as it goes on the wire, resolves 1 mm at 10 km.
constexpr double kFarthest = 10'000, kFastest = 100;       // m, m/s
constexpr double kMaxTilt = 1.0 * 3.14159265358979 / 180;  // rad

std::int64_t nanoseconds(const builtin_interfaces_msg_dds__Time_& t) {
  return std::int64_t{t.sec} * 1'000'000'000 + t.nanosec;
}

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

}  // namespace

tl::unexpected<std::string> wrong_frame(const std::string& what, const std::string& frame, const std::string& right) {
  return tl::unexpected(what + " is in frame '" + printable(frame, 128) + "', expected " + right +
                        "; see [frames] of the configuration");
}

tl::expected<OdometrySample, std::string> Localization::odometry(const dds::Odometry& m, std::int64_t received_ns) {
  const std::string frame = text(m.header.frame_id), child = text(m.child_frame_id);
  if (child != frames_.body) return wrong_frame("the twist of the odometry", child, "'" + frames_.body + "'");
  if (frame != frames_.map && frame != frames_.odometry)
    return wrong_frame("the odometry", frame, "'" + frames_.map + "' or '" + frames_.odometry + "'");
  if (frame == frames_.odometry && !map_from_odom_)
    return tl::unexpected<std::string>("odometry in frame '" + frame + "' before the first loop_closure from it to '" +
                                       frames_.map + "'");
  const double* covariance = m.pose.covariance;
  if (covariance[0] != 0 && covariance[0] != -1) {
    const double worst = std::max({covariance[0], covariance[7], covariance[14]});
    if (!(covariance[0] >= 0 && covariance[7] >= 0 && covariance[14] >= 0 && worst <= max_sigma_ * max_sigma_))
      return tl::unexpected<std::string>(
          "the odometry's own position error is above the vehicle's estimation.position of " +
          std::to_string(max_sigma_) + " m");
  }
  const auto& p = m.pose.pose.position;
  const auto& q = m.pose.pose.orientation;
  const auto& v = m.twist.twist.linear;
  OdometrySample s;
  s.received_ns = received_ns;
  s.stamp_ns = nanoseconds(m.header.stamp);
  s.position_variance = variances(m.pose.covariance, 0);
  s.attitude_variance = variances(m.pose.covariance, 3);
  s.velocity_variance = variances(m.twist.covariance, 0);
  // nav_msgs/Odometry: the twist is in the child (body) frame.
  Eigen::Quaterniond attitude(q.w, q.x, q.y, q.z);
  s.state = {{p.x, p.y, p.z}, attitude * Vec3(v.x, v.y, v.z)};
  // The gate would reject what is refused here too, but here it takes no good sample's place, and places no scan.
  if (!(std::abs(attitude.norm() - 1) < kUnit))
    return tl::unexpected<std::string>("the odometry's quaternion is not of unit length");
  if (frame == frames_.odometry) {
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
  if (map_from_odom_ && map_from_odom_->yaw == newest.yaw && map_from_odom_->t == newest.t) return {};
  map_from_odom_ = newest;
  ++closures_;
  return {};
}

}  // namespace backwash::daemon
