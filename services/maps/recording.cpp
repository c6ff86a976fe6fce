// SPDX-License-Identifier: BSD-3-Clause
// Clouds with poses from a recording of ROS 2 (rosbag2's MCAP), placed by its transforms, odometry and poses.
#include <algorithm>
#include <set>
#include <utility>

#include "core/log/mcap/mcap_reader.hpp"
#include "core/log/mcap/mcap_walk.hpp"
#include "services/maps/geometry.hpp"
#include "services/maps/messages.hpp"
#include "services/maps/scalars.hpp"
#include "services/maps/unpack.hpp"

namespace backwash::maps {
namespace {

/// Frames that stand still by their names: REP 105, and what odometries of lidars and cameras call theirs.
constexpr std::string_view kFixed[] = {"map", "odom", "earth", "world", "camera_init"};

class Recording {
 public:
  Recording(std::string topic, double body_radius) : topic_(std::move(topic)), body_radius_(body_radius) {}

  /// What is wrong with a message, or nothing.
  std::string take(const log::McapChannel& m, std::string_view data) {
    if (m.encoding == "ros1")
      return "is of ROS 1; convert the bag for ROS 2 first: rosbags-convert --src FILE.bag --dst FOLDER";
    constexpr std::size_t kHead = 4;  // its representation
    const bool plain = m.encoding == "cdr" && data.size() >= kHead && data[0] == 0 && (data[1] & ~1) == 0;
    log::Octets cdr(plain ? data.substr(kHead) : std::string_view(), true, plain && data[1] == 0);
    auto cloud = read_cloud(m.type, cdr);
    const auto poses = cloud ? std::nullopt : read_poses(m.type, cdr);
    if (!cloud && !poses) return "";
    if (!plain) return "needs messages of ROS 2 as they are on the wire, in plain CDR";
    if (cloud && !*cloud) return cloud->error();
    if (!cdr.good) return "a message that ends before its members";
    return cloud ? take_cloud(m.topic, std::move(**cloud)) : take_poses(m, *poses);
  }

  /// Everything placed in one frame.
  Read placed(const std::string& path) {
    for (const auto& [body, one] : bodies_)
      if (!transforms_.contains(body))
        if (auto why = tree_.add(one.parent, body, one.stamp_ns, *one.pose, false); !why.empty())
          return corrupt(path, ": " + why);
    if (topics_.empty()) return corrupt(path, ": holds no sensor_msgs/msg/PointCloud2" + of_topic());
    if (topics_.size() > 1) return corrupt(path, ": holds clouds of " + names() + "; choose one by --topic");
    for (const CloudMessage& cloud : clouds_)
      if (auto why = carry(tree_.root_of(cloud.frame)); !why.empty()) return corrupt(path, ": " + why);
    tree_.sort();
    for (const CloudMessage& cloud : clouds_)
      if (auto why = place(cloud); !why.empty()) return corrupt(path, ": " + why);
    if (left_out_ == clouds_.size())
      return corrupt(path, ": none of its " + std::to_string(left_out_) + " clouds has a pose at its time: frame " +
                               shown(clouds_[0].frame) + needs());
    return finished();
  }

 private:
  std::string of_topic() const { return topic_.empty() ? "" : " on " + topic_; }
  std::string names() const {
    std::string all;
    for (const auto& name : topics_) all += (all.empty() ? "" : " and ") + name;
    return all;
  }
  static std::string needs() {
    return " needs TFMessage or Odometry within 0.1 s before the first or after the last, or 0.5 s apart around it";
  }

  std::string take_cloud(const std::string& topic, CloudMessage cloud) {
    if (!topic_.empty() && topic != topic_) return "";
    topics_.emplace(topic);
    if (topics_.size() > 1) return "";  // is refused
    count_ += cloud.points.size();
    if (count_ > kMostPoints)
      return "more than " + std::to_string(kMostPoints) + " points so far; record fewer, or thin the clouds";
    clouds_.push_back(std::move(cloud));
    return "";
  }

  std::string take_poses(const log::McapChannel& m, const std::vector<PoseMessage>& poses) {
    for (const auto& one : poses) {
      bad_poses_ += !one.pose;
      if (!one.pose) continue;
      const bool always = m.topic.ends_with("tf_static");
      if (!always) parents_.insert(one.parent);
      if (m.type != "tf2_msgs/msg/TFMessage") {
        const bool named = !one.child.empty();
        (named ? named_ : nameless_).insert(named ? one.child : m.topic);
        bodies_.emplace_back(named ? one.child : m.topic, one);
        continue;
      }
      transforms_.insert(one.child);
      if (auto why = tree_.add(one.parent, one.child, one.stamp_ns, *one.pose, always); !why.empty()) return why;
    }
    return "";
  }

  /// The body whose odometry it is, for clouds that somebody placed already.
  std::string seen_by() const {
    const auto& bodies = named_.empty() ? nameless_ : named_;
    return bodies.size() == 1 ? *bodies.begin() : "";
  }

  /// A frame that nothing places goes along with the body that has no name; what is wrong, or nothing. Clouds of one
  /// that may have moved would lie on each other.
  std::string carry(const std::string& root) {
    const auto name = root.substr(root.rfind('/') + 1);  // without the vehicle's
    const bool body_frame = name.starts_with("base_");   // REP 105's, whatever joint moves in it
    const bool fixed = std::ranges::count(kFixed, name) > 0 || (parents_.contains(root) && !body_frame);
    if (root.empty() || fixed || clouds_.size() < 2) return "";
    if (nameless_.size() != 1)
      return "nothing says where frame " + shown(root) +
             " was: its clouds would lie on each other; record TFMessage, Odometry or one PoseStamped" +
             (nameless_.empty() ? "" : ", and not several");
    const std::string body = *nameless_.begin();
    out_.notes.push_back("the poses of " + body + ", which name no body, are those of frame " + shown(root));
    return tree_.add(body, root, 0, {}, true);
  }

  std::string place(const CloudMessage& cloud) {
    const auto root = tree_.root_of(cloud.frame);
    if (root.empty()) return "the parents of frame " + shown(cloud.frame) + " lead in a circle";
    if (!root_.empty() && root != root_)
      return "clouds are in " + shown(root_) + " and in " + shown(root) + ", and no transform joins them";
    root_ = root;
    const bool moved = tree_.has(cloud.frame);
    const std::string body = seen_by(), seer = moved ? cloud.frame : body;
    const auto known = [&](const std::string& name) { return !name.empty() && tree_.root_of(name) == root; };
    const auto frame = tree_.pose(cloud.frame, cloud.stamp_ns);
    const bool knows = known(seer);
    const auto sensor = knows ? tree_.pose(seer, cloud.stamp_ns) : std::nullopt;
    if (!frame || (knows && !sensor)) {
      ++left_out_;
      out_.taken += cloud.points.size();  // and told
      return "";
    }
    rays_ = rays_ && knows;
    out_.single = out_.single || (cloud.single && !moved);
    const auto center = known(body) ? tree_.pose(body, cloud.stamp_ns) : sensor;
    for (const Vec3& seen : cloud.points) {
      const Vec3 p = *frame * seen;
      const bool own = center && (p - center->place).norm() < body_radius_;
      out_.no_returns += seen.isZero(0);
      own_ += own && !seen.isZero(0);
      if (own || seen.isZero(0)) continue;
      out_.points.push_back(p);
      out_.sensors.push_back(sensor ? sensor->place : Vec3::Zero());
    }
    return "";
  }

  Geometry finished() {
    out_.stated = count_;
    out_.taken += out_.points.size() + out_.no_returns + own_;
    if (!rays_) {
      out_.sensors.clear();
      out_.notes.push_back(
          "the clouds are in " + shown(root_) +
          " and nothing says where they were seen from: no ray frees anything, no point is the vehicle's");
    }
    if (left_out_ > 0)
      out_.notes.push_back(std::to_string(left_out_) + " of " + std::to_string(clouds_.size()) +
                           " clouds have no pose at their time and were left out");
    if (own_ > 0) out_.notes.push_back(std::to_string(own_) + " points on the vehicle itself were left out");
    if (bad_poses_ > 0)
      out_.notes.push_back(std::to_string(bad_poses_) + " poses that are no place or no rotation were left out");
    out_.notes.push_back(std::to_string(clouds_.size() - left_out_) + " clouds of " + names() + " in frame " +
                         shown(root_));
    return std::move(out_);
  }

  std::string topic_;
  double body_radius_;
  std::set<std::string> topics_;  // of clouds
  std::vector<CloudMessage> clouds_;
  std::size_t count_ = 0;  // of their points
  FrameTree tree_;
  std::set<std::string> transforms_, parents_;               // frames that a TFMessage places; that others are in
  std::vector<std::pair<std::string, PoseMessage>> bodies_;  // by the body's frame, or its topic where it has none
  std::set<std::string> named_, nameless_;                   // of them
  std::string root_;
  std::size_t left_out_ = 0, bad_poses_ = 0, own_ = 0;
  bool rays_ = true;
  Geometry out_;
};

}  // namespace

Read read_recording(const std::string& path, std::string_view content, const std::string& topic, double body_radius) {
  if (!log::is_mcap({reinterpret_cast<const std::uint8_t*>(content.data()), content.size()}))
    return corrupt(path, ": does not begin as an MCAP file");
  Recording recording(topic, body_radius);
  log::McapListener listener;
  listener.message = [&](const log::McapChannel& channel, std::string_view data, std::uint64_t) {
    const auto why = recording.take(channel, data);
    return why.empty() ? why : channel.topic + ": " + why;
  };
  listener.unpack = unpacked;
  listener.over_damage = true;
  const auto end = log::walk_mcap(content, listener);
  const auto at = "byte " + std::to_string(end.at) + ": ";
  if (!end.wrong.empty()) return corrupt(path, ": " + at + end.wrong);
  auto geometry = recording.placed(path);
  if (const auto loss = end.loss(content.size()); geometry && !loss.empty()) geometry->notes.push_back(loss);
  if (geometry && !end.whole) geometry->notes.push_back("it was cut short at " + at + "what is before is used");
  return geometry;
}

}  // namespace backwash::maps
