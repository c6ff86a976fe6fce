// SPDX-License-Identifier: BSD-3-Clause
// The daemon's rt/tf in the hands of tf2 itself: Debian's tf2::BufferCore, fed with what a Fast DDS reader takes from
// the wire, for tests/system/daemon_tf2.sh.
//   tf2_peer DOMAIN SECONDS
// Sends the odometry of a vehicle that moves, rolls, pitches and turns, in frame odom, and where odom is in the map.
// Asks the buffer at the stamp of each odom > base_link for map > base_link, and for the way back, and holds both
// against what was sent, composed by Eigen. Prints how many were asked for and the largest errors; 1 where one is above
// 1e-9.
#include <geometry_msgs/TransformStamped.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/fastdds_local.hpp"

namespace {

using Pose = Eigen::Isometry3d;
using Transforms = std::vector<geometry_msgs::TransformStamped>;
constexpr double kRound = 1e-9;  // m, and rad

Eigen::Quaterniond turned(double roll, double pitch, double yaw) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

Pose pose_of(const Eigen::Vector3d& t, const Eigen::Quaterniond& q) {
  Pose pose = Pose::Identity();
  pose.linear() = q.toRotationMatrix();
  pose.translation() = t;
  return pose;
}

const Pose kMapFromOdom = pose_of({-2, 0.5, 0.25}, turned(0, 0, 2));

struct Sample {
  std::string frame, child;
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v_B = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  bool twist = false;
};

/// At time t: never twice at one place within the test.
Sample odometry_at(double t) {
  Sample s{"odom", "base_link", {0.3 * t, 0.4 * std::sin(t), 1 + 0.1 * std::cos(t)}, {}, {}, true};
  s.q = turned(0.1 * std::sin(1.1 * t), 0.08 * std::cos(1.3 * t), 0.5 + 0.4 * std::sin(0.7 * t));
  s.v_B = s.q.conjugate() * Eigen::Vector3d(0.3, 0.4 * std::cos(t), -0.1 * std::sin(t));
  return s;
}

class SentType : public Type {
 public:
  explicit SentType(const char* name) : Type(name, 1024) {}
  bool serialize(void* sample, Payload* payload) override {
    const auto& s = *static_cast<Sample*>(sample);
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    payload->encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    const double t = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    cdr << static_cast<std::int32_t>(t) << static_cast<std::uint32_t>((t - std::floor(t)) * 1e9) << s.frame << s.child;
    for (const double v : {s.p.x(), s.p.y(), s.p.z(), s.q.x(), s.q.y(), s.q.z(), s.q.w()}) cdr << v;
    if (s.twist) {
      for (int n = 0; n < 36; ++n) cdr << 0.0;
      for (const double v : {s.v_B.x(), s.v_B.y(), s.v_B.z()}) cdr << v;
      for (int n = 0; n < 3 + 36; ++n) cdr << 0.0;
    }
    payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
    return true;
  }
  bool deserialize(Payload*, void*) override { return false; }
  void* createData() override { return new Sample; }
  void deleteData(void* data) override { delete static_cast<Sample*>(data); }
};

class TfType : public Type {
 public:
  TfType() : Type("tf2_msgs::msg::dds_::TFMessage_", 4096) {}
  bool serialize(void*, Payload*) override { return false; }
  bool deserialize(Payload* payload, void* data) override {
    auto& all = *static_cast<Transforms*>(data);
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    std::uint32_t count = 0;
    cdr >> count;
    all.clear();
    for (; count > 0; --count) {
      std::int32_t s = 0;
      std::uint32_t ns = 0;
      geometry_msgs::TransformStamped t;
      auto& [p, q] = t.transform;
      cdr >> s >> ns >> t.header.frame_id >> t.child_frame_id >> p.x >> p.y >> p.z >> q.x >> q.y >> q.z >> q.w;
      t.header.stamp = ros::Time(static_cast<std::uint32_t>(s), ns);
      all.push_back(t);
    }
    return true;
  }
  void* createData() override { return new Transforms; }
  void deleteData(void* data) override { delete static_cast<Transforms*>(data); }
};

Pose pose_of(const geometry_msgs::Transform& t) {
  const auto& [p, q] = t;
  return pose_of({p.x, p.y, p.z}, Eigen::Quaterniond(q.w, q.x, q.y, q.z));
}

/// Metres and radians between two poses.
std::pair<double, double> apart(const Pose& a, const Pose& b) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(a.linear()).conjugate() * Eigen::Quaterniond(b.linear()));
  return {(a.translation() - b.translation()).norm(), std::abs(turn.angle())};
}

struct Judged {
  int asked = 0;
  double metres = 0, radians = 0;
  void take(const Pose& seen, const Pose& wanted) {
    const auto [m, r] = apart(seen, wanted);
    ++asked;
    metres = std::max(metres, m);
    radians = std::max(radians, r);
  }
};

/// What the buffer says at these stamps of the vehicle, against the sample that was sent from that place.
Judged judge(const tf2::BufferCore& buffer, const Transforms& vehicle, const std::vector<Sample>& sent) {
  Judged judged;
  for (const auto& t : vehicle) {
    const double x = t.transform.translation.x;
    const auto nearest = std::min_element(sent.begin(), sent.end(), [&](const Sample& a, const Sample& b) {
      return std::abs(a.p.x() - x) < std::abs(b.p.x() - x);
    });
    const Pose wanted = kMapFromOdom * pose_of(nearest->p, nearest->q);
    if (!buffer.canTransform("map", "base_link", t.header.stamp))
      continue;  // before the first or after the last map > odom
    judged.take(pose_of(buffer.lookupTransform("map", "base_link", t.header.stamp).transform), wanted);
    judged.take(pose_of(buffer.lookupTransform("base_link", "map", t.header.stamp).transform), wanted.inverse());
  }
  return judged;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 64;
  const auto domain = static_cast<unsigned>(std::atoi(argv[1]));
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(domain, local_only(domain));
  if (!participant) return 70;
  const auto topic = [&](fast::TopicDataType* made, const char* name) {
    fast::TypeSupport type(made);
    type.register_type(participant);
    return participant->create_topic(name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  };
  auto* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  fast::DataWriterQos best_effort, kept;
  best_effort.reliability().kind = fast::BEST_EFFORT_RELIABILITY_QOS;
  kept.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  kept.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  auto* odometry = publisher->create_datawriter(
      topic(new SentType("nav_msgs::msg::dds_::Odometry_"), "rt/backwash/odometry"), best_effort);
  auto* closure = publisher->create_datawriter(
      topic(new SentType("geometry_msgs::msg::dds_::TransformStamped_"), "rt/backwash/loop_closure"), kept);
  fast::DataReaderQos tf_qos;
  tf_qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  tf_qos.history().depth = 100;
  auto* tf = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
                 ->create_datareader(topic(new TfType, "rt/tf"), tf_qos);

  Sample place{"map", "odom", kMapFromOdom.translation(), {}, Eigen::Quaterniond(kMapFromOdom.linear()), false};
  closure->write(&place);
  tf2::BufferCore buffer(ros::Duration(1000));
  std::vector<Sample> sent;
  Transforms vehicle;
  auto due = std::chrono::steady_clock::now();
  for (int n = 0; n < 100 * std::atoi(argv[2]); ++n) {
    sent.push_back(odometry_at(0.01 * n));
    odometry->write(&sent.back());
    Transforms message;
    fast::SampleInfo info;
    while (tf->take_next_sample(&message, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
      for (const auto& t : message) {
        if (!buffer.setTransform(t, "backwashd")) std::printf("tf2 refuses %s\n", t.child_frame_id.c_str());
        if (t.child_frame_id == "base_link") vehicle.push_back(t);
      }
    due += std::chrono::milliseconds(10);
    std::this_thread::sleep_until(due);
  }
  const Judged judged = judge(buffer, vehicle, sent);
  std::printf("%zu transforms of the vehicle, %d lookups by tf2, off by at most %.1e m and %.1e rad\n%s",
              vehicle.size(), judged.asked, judged.metres, judged.radians, buffer.allFramesAsString().c_str());
  return judged.asked > 40 && judged.metres <= kRound && judged.radians <= kRound ? 0 : 1;
}
