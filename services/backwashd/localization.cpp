// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/localization.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace backwash::daemon {
namespace {

constexpr std::int64_t kHistory_ns = 1'000'000'000, kSlack_ns = 50'000'000;
constexpr std::size_t kMostPoses = 1000;  // of the history: 1 kHz
constexpr double kUnit = 1e-2;            // of a quaternion's norm
// What no map and no vehicle indoors reaches. A float, as it goes on the wire, resolves 1 mm at 10 km.
constexpr double kFarthest = 10'000, kFastest = 100;       // m, m/s
constexpr double kMaxTilt = 1.0 * 3.14159265358979 / 180;  // rad

std::int64_t nanoseconds(const builtin_interfaces_msg_dds__Time_& t) {
  return std::int64_t{t.sec} * 1'000'000'000 + t.nanosec;
}

// Written so that what is no number is not within.
bool within(const Vec3& v, double most) { return v.norm() <= most; }

std::string text(const char* s) { return s ? s : ""; }

Eigen::Quaterniond quaternion(const std::array<double, 4>& q) { return {q[0], q[1], q[2], q[3]}; }

tl::unexpected<std::string> wrong_frame(const std::string& what, const std::string& frame, const std::string& right) {
  return tl::unexpected(what + " is in frame '" + frame + "', expected " + right +
                        "; see [frames] of the configuration");
}

}  // namespace

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
  // A stamp that stands still, or goes back, brings no history.
  if (!history_.empty() && s.stamp_ns < history_.back().stamp_ns) history_.clear();
  if (!history_.empty() && s.stamp_ns == history_.back().stamp_ns) history_.pop_back();
  if (history_.size() == kMostPoses) history_.pop_front();
  history_.push_back({s.stamp_ns, s.state.p_W, s.q});
  while (history_.front().stamp_ns < s.stamp_ns - kHistory_ns) history_.pop_front();
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
  if (map_from_odom_) {
    const track::RigidShift D = newest * map_from_odom_->inverse();
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(D.yaw, Vec3::UnitZ()));
    for (Pose& pose : history_) {
      const Eigen::Quaterniond turned = turn * quaternion(pose.q);
      pose = {pose.stamp_ns, D.point(pose.p), {turned.w(), turned.x(), turned.y(), turned.z()}};
    }
  }
  map_from_odom_ = newest;
  ++closures_;
  return {};
}

std::optional<Localization::Pose> Localization::pose_at(std::int64_t stamp_ns) const {
  if (history_.empty() || stamp_ns < history_.front().stamp_ns - kSlack_ns ||
      stamp_ns > history_.back().stamp_ns + kSlack_ns)
    return std::nullopt;
  const auto after = std::ranges::lower_bound(history_, stamp_ns, {}, &Pose::stamp_ns);
  if (after == history_.end()) return history_.back();
  if (after == history_.begin()) return *after;
  const Pose &a = *std::prev(after), &b = *after;
  const double share = static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns);
  const Eigen::Quaterniond q = quaternion(a.q).slerp(share, quaternion(b.q));
  return Pose{stamp_ns, a.p + share * (b.p - a.p), {q.w(), q.x(), q.y(), q.z()}};
}

tl::expected<Scan, std::string> Localization::scan(const dds::PointCloud& m, std::int64_t received_ns) const {
  const std::string frame = text(m.header.frame_id);
  if (frame != frames_.body && frame != frames_.map && frame != frames_.odometry)
    return wrong_frame("the point cloud", frame,
                       "'" + frames_.body + "', '" + frames_.odometry + "' or '" + frames_.map + "'");
  auto cloud = decode_cloud(m);
  if (!cloud) return tl::unexpected(std::move(cloud.error()));
  const auto pose = pose_at(nanoseconds(m.header.stamp));
  if (!pose) return tl::unexpected(std::string("a point cloud whose stamp is not within that of the odometry"));
  if (frame == frames_.odometry && !map_from_odom_)
    return tl::unexpected<std::string>("a point cloud in frame '" + frame + "' before the first loop closure");
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  if (frame == frames_.body) {
    place = Eigen::Translation3d(pose->p) * quaternion(pose->q).normalized();
  } else if (frame == frames_.odometry) {
    place = Eigen::Translation3d(map_from_odom_->t) * Eigen::AngleAxisd(map_from_odom_->yaw, Vec3::UnitZ());
  }
  Scan scan{std::move(cloud->points), cloud->viewpoint ? place * *cloud->viewpoint : pose->p, received_ns};
  for (Vec3& p : scan.points_W) p = place * p;
  return scan;
}

NewVoxels new_voxels(const map::OccupancyGrid& known, const Scan& scan, double max_range) {
  std::vector<Index3> voxels;
  for (const Vec3& p : scan.points_W) {
    if ((p - scan.sensor_W).norm() > max_range) continue;
    const Index3 v = known.index(p);
    if (known.inside(v) && !known.occupied(v)) voxels.push_back(v);
  }
  const auto less = [](const Index3& a, const Index3& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  int edge = 1;
  for (;; edge *= 2) {
    std::ranges::sort(voxels, less);
    voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
    if (voxels.size() <= NewVoxels::kMost) break;
    for (Index3& v : voxels) v = v.array() / 2;  // inside the grid: never negative
  }
  NewVoxels result;
  result.received_ns = scan.received_ns;
  result.edge = edge * known.resolution();
  result.count = voxels.size();
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    const Vec3 c = known.origin() + result.edge * (voxels[n].cast<double>() + Vec3::Constant(0.5));
    result.centers[n] = {c.x(), c.y(), c.z()};
  }
  return result;
}

}  // namespace backwash::daemon
