// SPDX-License-Identifier: BSD-3-Clause
#include "services/maps/messages.hpp"

#include <array>
#include <cmath>

#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

using log::Octets;
using Cloud = tl::expected<CloudMessage, std::string>;

std::int64_t stamp(Octets& cdr) {
  const auto s = cdr.number<std::int32_t>();
  return std::int64_t{s} * 1'000'000'000 + cdr.number<std::uint32_t>();
}

template <typename Real>
Vec3 vector(Octets& cdr) {
  Vec3 v;
  for (double& x : v) x = static_cast<double>(cdr.number<Real>());
  return v;
}

/// Nothing where it is no pose.
std::optional<Pose> checked(Pose pose) {
  constexpr double kUnit = 1e-3;
  if (!pose.place.allFinite() || !(std::abs(pose.turn.norm() - 1) < kUnit)) return std::nullopt;
  pose.turn.normalize();
  return pose;
}

/// A place and a turn, as Pose and Transform have them.
std::optional<Pose> pose(Octets& cdr) {
  Pose pose;
  pose.place = vector<double>(cdr);
  const auto xyz = vector<double>(cdr);
  pose.turn = Eigen::Quaterniond(cdr.number<double>(), xyz.x(), xyz.y(), xyz.z());
  return checked(pose);
}

/// How a PointCloud2 holds its points.
struct Layout {
  std::array<std::uint32_t, 3> offset{};  // of x, y, z in a point
  std::array<Scalar, 3> type{};
  std::uint32_t height = 0, width = 0, point_bytes = 0, row_bytes = 0;
  std::endian order = std::endian::little;
};

/// Takes the fields; what is wrong, or nothing.
std::string take_fields(Octets& cdr, Layout& layout) {
  constexpr std::uint8_t kFloat32 = 7, kFloat64 = 8;
  std::array<bool, 3> found{};
  for (auto count = cdr.number<std::uint32_t>(); count > 0 && cdr.good; --count) {
    const auto name = cdr.text();
    const auto offset = cdr.number<std::uint32_t>();
    const auto type = cdr.number<std::uint8_t>();
    cdr.number<std::uint32_t>();
    if (name.size() != 1 || name[0] < 'x' || name[0] > 'z') continue;
    if (type != kFloat32 && type != kFloat64)
      return "field " + shown(name) + " has the datatype " + std::to_string(type) +
             "; 7 (FLOAT32) or 8 (FLOAT64) is read";
    const auto axis = static_cast<std::size_t>(name[0] - 'x');
    found[axis] = true;
    layout.offset[axis] = offset;
    layout.type[axis] = {Scalar::Kind::floating, type == kFloat32 ? 4U : 8U};
  }
  return !cdr.good || (found[0] && found[1] && found[2]) ? "" : "a cloud without fields x, y and z";
}

Cloud point_cloud(Octets& cdr, CloudMessage cloud) {
  Layout layout;
  layout.height = cdr.number<std::uint32_t>();
  layout.width = cdr.number<std::uint32_t>();
  if (auto why = take_fields(cdr, layout); !why.empty()) return tl::make_unexpected(why);
  layout.order = cdr.number<std::uint8_t>() != 0 ? std::endian::big : std::endian::little;
  layout.point_bytes = cdr.number<std::uint32_t>();
  layout.row_bytes = cdr.number<std::uint32_t>();
  const auto data = cdr.take(cdr.number<std::uint32_t>());
  if (!cdr.good) return cloud;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (std::uint64_t{layout.offset[axis]} + layout.type[axis].bytes > layout.point_bytes)
      return tl::make_unexpected("a point_step of " + std::to_string(layout.point_bytes) +
                                 " bytes does not hold x, y and z");
  if (std::uint64_t{layout.width} * layout.point_bytes > layout.row_bytes ||
      std::uint64_t{layout.height} * layout.row_bytes > data.size())
    return tl::make_unexpected("a cloud of " + std::to_string(layout.height) + " x " + std::to_string(layout.width) +
                               " points has " + std::to_string(data.size()) + " bytes");
  cloud.single = layout.type[0].bytes < 8;
  cloud.points.reserve(std::size_t{layout.height} * layout.width);
  for (std::size_t row = 0; row < layout.height; ++row)
    for (std::size_t n = 0; n < layout.width; ++n) {
      const auto point = data.substr(row * layout.row_bytes + n * layout.point_bytes, layout.point_bytes);
      auto& p = cloud.points.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis)
        p[static_cast<int>(axis)] =
            value_of(layout.type[axis], point.substr(layout.offset[axis], layout.type[axis].bytes), layout.order);
    }
  return cloud;
}

/// livox_ros_driver2/msg/CustomMsg.msg and CustomPoint.msg.
Cloud livox_cloud(Octets& cdr, CloudMessage cloud) {
  constexpr std::size_t kPoint = 19;  // bytes: time since the first, x, y, z, reflectivity, tag, line
  cdr.number<std::uint64_t>();        // time of the first point
  const auto stated = cdr.number<std::uint32_t>();
  cdr.take(4);  // the lidar, and three reserved
  const auto count = cdr.number<std::uint32_t>();
  if (cdr.good && count != stated)
    return tl::make_unexpected("says " + std::to_string(stated) + " points and has " + std::to_string(count));
  if (cdr.good && cdr.rest().size() / kPoint < count)
    return tl::make_unexpected("a message that ends before its points");
  cloud.single = true;
  for (std::size_t n = 0; n < count && cdr.good; ++n) {
    cdr.number<std::uint32_t>();
    cloud.points.push_back(vector<float>(cdr));
    cdr.take(3);
  }
  return cloud;
}

/// px4_msgs/msg/VehicleOdometry.msg since PX4 1.14: µs, north, east, down and forward, right, down.
PoseMessage px4_pose(Octets& cdr) {
  constexpr std::uint8_t kNed = 1;
  cdr.number<std::uint64_t>();
  PoseMessage message{"px4_local", "", static_cast<std::int64_t>(cdr.number<std::uint64_t>()) * 1000, {}};
  const bool ned = cdr.number<std::uint8_t>() == kNed;
  const auto p = vector<float>(cdr);
  const double w = static_cast<double>(cdr.number<float>());
  const auto q = vector<float>(cdr);
  if (ned) message.pose = checked({Eigen::Quaterniond(w, q.x(), -q.y(), -q.z()), {p.x(), -p.y(), -p.z()}});
  return message;
}

}  // namespace

std::optional<Cloud> read_cloud(const std::string& type, Octets& cdr) {
  const bool livox = type == "livox_ros_driver2/msg/CustomMsg" || type == "livox_ros_driver/msg/CustomMsg";
  if (!livox && type != "sensor_msgs/msg/PointCloud2") return std::nullopt;
  CloudMessage cloud;
  cloud.stamp_ns = stamp(cdr);
  cloud.frame = cdr.text();
  return livox ? livox_cloud(cdr, std::move(cloud)) : point_cloud(cdr, std::move(cloud));
}

std::optional<std::vector<PoseMessage>> read_poses(const std::string& type, Octets& cdr) {
  const bool named = type == "nav_msgs/msg/Odometry", transforms = type == "tf2_msgs/msg/TFMessage";
  if (type == "px4_msgs/msg/VehicleOdometry") return std::vector{px4_pose(cdr)};
  if (!named && !transforms && type != "geometry_msgs/msg/PoseStamped") return std::nullopt;
  std::vector<PoseMessage> poses;
  for (auto count = transforms ? cdr.number<std::uint32_t>() : 1; count > 0 && cdr.good; --count) {
    PoseMessage one;
    one.stamp_ns = stamp(cdr);
    one.parent = cdr.text();
    if (named || transforms) one.child = cdr.text();
    if (named && one.child == one.parent) one.child = "";
    one.pose = pose(cdr);
    if (cdr.good) poses.push_back(std::move(one));
  }
  return poses;
}

}  // namespace backwash::maps
