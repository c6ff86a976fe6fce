// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/scan_placement.hpp"

#include <Eigen/Geometry>

#include <algorithm>

#include "services/backwashd/in/localization.hpp"
#include "services/backwashd/map/map_change.hpp"

namespace backwash::daemon {
namespace {

constexpr std::int64_t kHistory_ns = 1'000'000'000, kSlack_ns = 50'000'000;
constexpr std::size_t kMostPoses = 2048;  // of a flood

Eigen::Quaterniond quaternion(const std::array<double, 4>& q) { return {q[0], q[1], q[2], q[3]}; }

}  // namespace

void ScanPlacement::add(const OdometrySample& s) {
  if (s.closures != closures_ && closures_ > 0) {
    const track::RigidShift D = s.map_from_odom * history_from_odom_.inverse();
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(D.yaw, Vec3::UnitZ()));
    for (Pose& pose : history_) {
      const Eigen::Quaterniond turned = turn * quaternion(pose.q);
      pose = {pose.stamp_ns, D.point(pose.p), {turned.w(), turned.x(), turned.y(), turned.z()}};
    }
  }
  closures_ = s.closures;
  history_from_odom_ = s.map_from_odom;
  if (!history_.empty() && s.stamp_ns < history_.back().stamp_ns) history_.clear();
  if (!history_.empty() && s.stamp_ns == history_.back().stamp_ns) history_.pop_back();
  history_.push_back({s.stamp_ns, s.state.p_W, s.q});
  while (history_.front().stamp_ns < s.stamp_ns - kHistory_ns || history_.size() > kMostPoses) history_.pop_front();
}

std::optional<ScanPlacement::Pose> ScanPlacement::pose_at(std::int64_t stamp_ns) const {
  if (history_.empty() || stamp_ns < history_.front().stamp_ns - kSlack_ns ||
      stamp_ns > history_.back().stamp_ns + kSlack_ns)
    return std::nullopt;
  const auto after = std::ranges::lower_bound(history_, stamp_ns, {}, &Pose::stamp_ns);
  if (after == history_.end()) return history_.back();
  if (after == history_.begin()) return *after;
  const Pose &a = *std::prev(after), &b = *after;
  if (b.stamp_ns - a.stamp_ns > most_apart_ns_) return std::nullopt;  // what was between is not known
  const double share = static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns);
  const Eigen::Quaterniond q = quaternion(a.q).slerp(share, quaternion(b.q));
  return Pose{stamp_ns, a.p + share * (b.p - a.p), {q.w(), q.x(), q.y(), q.z()}};
}

tl::expected<Scan, std::string> ScanPlacement::scan(const dds::PointCloud& m, std::int64_t received_ns) const {
  const std::string frame = m.header.frame_id ? m.header.frame_id : "";
  if (frame != frames_.body && frame != frames_.map && frame != frames_.odometry)
    return wrong_frame("the point cloud", frame,
                       "'" + frames_.body + "', '" + frames_.odometry + "' or '" + frames_.map + "'");
  auto cloud = decode_cloud(m);
  if (!cloud) return tl::unexpected(std::move(cloud.error()));
  const auto pose = pose_at(dds::nanoseconds(m.header.stamp));
  if (!pose) return tl::unexpected(std::string("a point cloud whose stamp is not within that of the odometry"));
  if (frame == frames_.odometry && !map_from_odom_)
    return tl::unexpected<std::string>("a point cloud in frame '" + frame + "' before the first loop closure");
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  if (frame == frames_.body) {
    place = Eigen::Translation3d(pose->p) * quaternion(pose->q).normalized();
  } else if (frame == frames_.odometry) {
    place = Eigen::Translation3d(map_from_odom_->t) * Eigen::AngleAxisd(map_from_odom_->yaw, Vec3::UnitZ());
  }
  Scan scan{std::move(cloud->points), cloud->viewpoint ? place * *cloud->viewpoint : pose->p, received_ns, closures_};
  for (Vec3& p : scan.points_W) p = place * p;
  scan.own = std::erase_if(scan.points_W, [&](const Vec3& p) { return (p - pose->p).norm() < body_radius_; });
  return scan;
}

NewVoxels new_voxels(const map::OccupancyGrid& known, const Scan& scan, double max_range) {
  std::vector<Index3> voxels;
  for (const Vec3& p : scan.points_W)
    if ((p - scan.sensor_W).norm() <= max_range) voxels.push_back(known.index(p));
  return news(known, voxels, scan.received_ns);
}

}  // namespace backwash::daemon
