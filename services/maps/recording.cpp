// SPDX-License-Identifier: BSD-3-Clause
// Clouds with poses from a recording of ROS 2 (rosbag2's MCAP): sensor_msgs/PointCloud2, placed by tf2_msgs/TFMessage
// and nav_msgs/Odometry.
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "core/log/mcap/mcap_reader.hpp"
#include "core/log/mcap/mcap_walk.hpp"
#include "core/log/octets.hpp"
#include "services/maps/frame_tree.hpp"
#include "services/maps/geometry.hpp"
#include "services/maps/scalars.hpp"
#include "services/maps/unpack.hpp"

namespace backwash::maps {
namespace {

using log::Octets;

struct Header {
  std::int64_t stamp_ns;
  std::string frame;
};

Header header(Octets& cdr) {
  const auto s = cdr.number<std::int32_t>();
  const auto ns = cdr.number<std::uint32_t>();
  return {std::int64_t{s} * 1'000'000'000 + ns, std::string(cdr.text())};
}

Vec3 vector(Octets& cdr) {
  Vec3 v;
  for (double& x : v) x = cdr.number<double>();
  return v;
}

/// A place and a turn, as Pose and Transform have them; nothing where it is none.
std::optional<Pose> pose(Octets& cdr) {
  constexpr double kUnit = 1e-3;
  Pose pose;
  pose.place = vector(cdr);
  const Vec3 xyz = vector(cdr);
  pose.turn = Eigen::Quaterniond(cdr.number<double>(), xyz.x(), xyz.y(), xyz.z());
  if (!pose.place.allFinite() || !(std::abs(pose.turn.norm() - 1) < kUnit)) return std::nullopt;
  pose.turn.normalize();
  return pose;
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

class Recording {
 public:
  explicit Recording(std::string topic) : topic_(std::move(topic)) {}

  /// What is wrong with a message, or nothing.
  std::string take(const log::McapChannel& m, std::string_view data) {
    const bool cloud = m.type == "sensor_msgs/msg/PointCloud2", odometry = m.type == "nav_msgs/msg/Odometry";
    if (m.encoding == "ros1")
      return "is of ROS 1; convert the bag for ROS 2 first: rosbags-convert --src FILE.bag --dst FOLDER";
    if (!cloud && !odometry && m.type != "tf2_msgs/msg/TFMessage") return "";
    constexpr std::size_t kHead = 4;  // its representation
    if (m.encoding != "cdr" || data.size() < kHead || data[0] != 0 || (data[1] & ~1) != 0)
      return "needs messages of ROS 2 as they are on the wire, in plain CDR";
    Octets cdr(data.substr(kHead), true, data[1] == 0);
    const auto wrong = cloud ? take_cloud(m.topic, cdr) : odometry ? take_odometry(cdr) : take_transforms(m.topic, cdr);
    return cdr.good || !wrong.empty() ? wrong : "a message that ends before its members";
  }

  /// Everything placed in one frame.
  Read placed(const std::string& path) {
    for (const auto& one : odometry_)
      if (!transforms_.contains(one.child))
        if (auto why = tree_.add(one.parent, one.child, one.stamp_ns, one.pose, false); !why.empty())
          return corrupt(path, ": " + why);
    tree_.sort();
    if (topics_.empty()) return corrupt(path, ": holds no sensor_msgs/msg/PointCloud2" + of_topic());
    if (topics_.size() > 1) return corrupt(path, ": holds clouds of " + names() + "; choose one by --topic");
    for (const Cloud& cloud : clouds_)
      if (auto why = place(cloud); !why.empty()) return corrupt(path, ": " + why);
    if (left_out_ == clouds_.size())
      return corrupt(path, ": none of its " + std::to_string(left_out_) + " clouds has a pose at its time: frame " +
                               shown(clouds_[0].frame) + needs());
    return finished();
  }

 private:
  struct Cloud {
    std::int64_t stamp_ns;
    std::string frame;
    std::size_t first, count;  // of points_
    bool single;
  };
  struct Placed {
    std::string parent, child;
    std::int64_t stamp_ns;
    Pose pose;
  };

  std::string of_topic() const { return topic_.empty() ? "" : " on " + topic_; }
  std::string names() const {
    std::string all;
    for (const auto& name : topics_) all += (all.empty() ? "" : " and ") + name;
    return all;
  }
  static std::string needs() {
    return " needs TFMessage or Odometry within 0.1 s before the first or after the last, or 0.5 s apart around it";
  }

  std::string take_cloud(std::string_view topic, Octets& cdr) {
    if (!topic_.empty() && topic != topic_) return "";
    topics_.emplace(topic);
    if (topics_.size() > 1) return "";  // is refused
    const auto [stamp_ns, frame] = header(cdr);
    Layout layout;
    layout.height = cdr.number<std::uint32_t>();
    layout.width = cdr.number<std::uint32_t>();
    if (auto why = take_fields(cdr, layout); !why.empty()) return why;
    layout.order = cdr.number<std::uint8_t>() != 0 ? std::endian::big : std::endian::little;
    layout.point_bytes = cdr.number<std::uint32_t>();
    layout.row_bytes = cdr.number<std::uint32_t>();
    const auto data = cdr.take(cdr.number<std::uint32_t>());
    if (!cdr.good) return "";
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (std::uint64_t{layout.offset[axis]} + layout.type[axis].bytes > layout.point_bytes)
        return "a point_step of " + std::to_string(layout.point_bytes) + " bytes does not hold x, y and z";
    if (std::uint64_t{layout.width} * layout.point_bytes > layout.row_bytes ||
        std::uint64_t{layout.height} * layout.row_bytes > data.size())
      return "a cloud of " + std::to_string(layout.height) + " x " + std::to_string(layout.width) + " points has " +
             std::to_string(data.size()) + " bytes";
    const std::size_t count = std::size_t{layout.height} * layout.width;
    if (points_.size() + count > kMostPoints)
      return "more than " + std::to_string(kMostPoints) + " points so far; record fewer, or thin the clouds";
    clouds_.push_back({stamp_ns, frame, points_.size(), count, layout.type[0].bytes < 8});
    take_points(data, layout);
    return "";
  }

  void take_points(std::string_view data, const Layout& layout) {
    for (std::size_t row = 0; row < layout.height; ++row)
      for (std::size_t n = 0; n < layout.width; ++n) {
        const auto point = data.substr(row * layout.row_bytes + n * layout.point_bytes, layout.point_bytes);
        Vec3 p;
        for (std::size_t axis = 0; axis < 3; ++axis)
          p[static_cast<int>(axis)] =
              value_of(layout.type[axis], point.substr(layout.offset[axis], layout.type[axis].bytes), layout.order);
        points_.push_back(p);
      }
  }

  std::string take_odometry(Octets& cdr) {
    const auto [stamp_ns, parent] = header(cdr);
    const std::string child(cdr.text());
    const auto at = pose(cdr);
    if (cdr.good && at) odometry_.push_back({parent, child, stamp_ns, *at});
    bad_poses_ += cdr.good && !at;
    return "";
  }

  std::string take_transforms(std::string_view topic, Octets& cdr) {
    for (auto count = cdr.number<std::uint32_t>(); count > 0 && cdr.good; --count) {
      const auto [stamp_ns, parent] = header(cdr);
      const std::string child(cdr.text());
      const auto at = pose(cdr);
      if (!cdr.good) break;
      bad_poses_ += !at;
      if (!at) continue;
      transforms_.insert(child);
      if (auto why = tree_.add(parent, child, stamp_ns, *at, topic.ends_with("tf_static")); !why.empty()) return why;
    }
    return "";
  }

  /// The body whose odometry it is, for clouds that somebody placed already.
  std::string seen_by() const {
    std::set<std::string> bodies;
    for (const auto& one : odometry_) bodies.insert(one.child);
    return bodies.size() == 1 ? *bodies.begin() : "";
  }

  std::string place(const Cloud& cloud) {
    const auto root = tree_.root_of(cloud.frame);
    if (root.empty()) return "the parents of frame " + shown(cloud.frame) + " lead in a circle";
    if (!root_.empty() && root != root_)
      return "clouds are in " + shown(root_) + " and in " + shown(root) + ", and no transform joins them";
    root_ = root;
    const bool moved = tree_.has(cloud.frame);
    const std::string seer = moved ? cloud.frame : seen_by();
    const auto frame = tree_.pose(cloud.frame, cloud.stamp_ns);
    const bool knows = !seer.empty() && tree_.root_of(seer) == root;
    const auto sensor = knows ? tree_.pose(seer, cloud.stamp_ns) : std::nullopt;
    if (!frame || (knows && !sensor)) {
      ++left_out_;
      return "";
    }
    rays_ = rays_ && knows;
    out_.single = out_.single || (cloud.single && !moved);
    for (std::size_t n = cloud.first; n < cloud.first + cloud.count; ++n) {
      out_.points.push_back(*frame * points_[n]);
      out_.sensors.push_back(sensor ? sensor->place : Vec3::Zero());
    }
    return "";
  }

  Geometry finished() {
    if (!rays_) {
      out_.sensors.clear();
      out_.notes.push_back("the clouds are in " + shown(root_) +
                           " and nothing says where they were seen from: no ray frees anything");
    }
    if (left_out_ > 0)
      out_.notes.push_back(std::to_string(left_out_) + " of " + std::to_string(clouds_.size()) +
                           " clouds have no pose at their time and were left out");
    if (bad_poses_ > 0)
      out_.notes.push_back(std::to_string(bad_poses_) + " poses that are no place or no rotation were left out");
    out_.notes.push_back(std::to_string(clouds_.size() - left_out_) + " clouds of " + names() + " in frame " +
                         shown(root_));
    return std::move(out_);
  }

  std::string topic_;
  std::set<std::string> topics_;  // of clouds
  std::vector<Cloud> clouds_;
  std::vector<Vec3> points_;  // each in its cloud's frame
  FrameTree tree_;
  std::set<std::string> transforms_;  // frames that a TFMessage places
  std::vector<Placed> odometry_;
  std::string root_;
  std::size_t left_out_ = 0, bad_poses_ = 0;
  bool rays_ = true;
  Geometry out_;
};

}  // namespace

Read read_recording(const std::string& path, std::string_view content, const std::string& topic) {
  if (!log::is_mcap({reinterpret_cast<const std::uint8_t*>(content.data()), content.size()}))
    return corrupt(path, ": does not begin as an MCAP file");
  Recording recording(topic);
  log::McapListener listener;
  listener.message = [&](const log::McapChannel& channel, std::string_view data, std::uint64_t) {
    const auto why = recording.take(channel, data);
    return why.empty() ? why : channel.topic + ": " + why;
  };
  listener.unpack = unpacked;
  const auto end = log::walk_mcap(content, listener);
  const auto at = "byte " + std::to_string(end.at) + ": ";
  if (!end.wrong.empty()) return corrupt(path, ": " + at + end.wrong);
  auto geometry = recording.placed(path);
  if (geometry && !end.whole) geometry->notes.push_back("it was cut short at " + at + "what is before is used");
  return geometry;
}

}  // namespace backwash::maps
