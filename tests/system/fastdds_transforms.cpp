// SPDX-License-Identifier: BSD-3-Clause
// An estimator and a tf2 listener in one, through Fast DDS with types written by hand, for
// tests/system/daemon_transforms.sh.
//   fastdds_transforms DOMAIN map|odom SECONDS FOUND
// Sends the pose of a vehicle at rest for so long from the first transform on, for which it waits FOUND s: in frame
// map, or in frame odom, whose place in the map is on rt/backwash/loop_closure. After it has ended it listens for as
// long as kAfter. Of each transform on rt/tf, reliable and volatile as tf2 asks for it, a line: "FRAME > CHILD: X Y Z
// yaw ANGLE, N a second, M after it, NEWEST to OLDEST s old"; N by the stamps, from the first to the last.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/fastdds_local.hpp"

namespace {

constexpr int kAfter = 2;  // s
// Of the vehicle in what the estimator calls its frame, and of odom in the map: x, y, z in m, yaw in rad.
struct Place {
  double x, y, z, yaw;
};
constexpr Place kVehicle{1, 2, 0.16, 0.5}, kClosure{-2, 0.5, 0.25, 2};

struct Transform {
  std::string frame, child;
  Place at;
  double stamp, age;  // s, by the wall clock, and at its arrival
};

double now(auto clock) { return std::chrono::duration<double>(decltype(clock)::now().time_since_epoch()).count(); }

void header(Cdr& cdr, const std::string& frame) {
  const double t = now(std::chrono::steady_clock());
  cdr << static_cast<std::int32_t>(t) << static_cast<std::uint32_t>((t - std::floor(t)) * 1e9) << frame;
}
void pose(Cdr& cdr, const Place& p) {
  for (const double v : {p.x, p.y, p.z, 0.0, 0.0, std::sin(p.yaw / 2), std::cos(p.yaw / 2)}) cdr << v;
}

class SentType : public Type {
 public:
  explicit SentType(bool odometry)
      : Type(odometry ? "nav_msgs::msg::dds_::Odometry_" : "geometry_msgs::msg::dds_::TransformStamped_", 1024),
        odometry_(odometry) {}
  bool serialize(void* frame, Payload* payload) override {
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    payload->encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    header(cdr, *static_cast<std::string*>(frame));
    cdr << std::string(odometry_ ? "base_link" : "odom");
    pose(cdr, odometry_ ? kVehicle : kClosure);
    for (int n = 0; odometry_ && n < 36 + 6 + 36; ++n) cdr << 0.0;
    payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
    return true;
  }
  bool deserialize(Payload*, void*) override { return false; }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }

 private:
  bool odometry_;
};

class TfType : public Type {
 public:
  TfType() : Type("tf2_msgs::msg::dds_::TFMessage_", 4096) {}
  bool serialize(void*, Payload*) override { return false; }
  bool deserialize(Payload* payload, void* data) override {
    auto& all = *static_cast<std::vector<Transform>*>(data);
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    std::uint32_t count = 0;
    cdr >> count;
    all.clear();
    for (; count > 0; --count) {
      std::int32_t s = 0;
      std::uint32_t ns = 0;
      Transform t{};
      double qx = 0, qy = 0, qz = 0, qw = 0;
      cdr >> s >> ns >> t.frame >> t.child >> t.at.x >> t.at.y >> t.at.z >> qx >> qy >> qz >> qw;
      t.stamp = s + 1e-9 * ns;
      t.age = now(std::chrono::system_clock()) - t.stamp;
      t.at.yaw = 2 * std::atan2(qz, qw);
      if (std::hypot(qx, qy) > 1e-9) t.frame += " (tilted)";
      all.push_back(t);
    }
    return true;
  }
  void* createData() override { return new std::vector<Transform>; }
  void deleteData(void* data) override { delete static_cast<std::vector<Transform>*>(data); }
};

struct Seen {
  Transform last;
  double begun = 0, ended = 0;  // s, stamps while that was sent
  int during = 0, after = 0;
  double oldest = -1e9, newest = 1e9;  // s

  double rate() const { return during > 1 ? (during - 1) / (ended - begun) : 0; }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 64;
  const auto domain = static_cast<unsigned>(std::atoi(argv[1]));
  std::string what = argv[2], map = "map";
  const int seconds = std::atoi(argv[3]), found = std::atoi(argv[4]);
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
  auto* odometry = publisher->create_datawriter(topic(new SentType(true), "rt/backwash/odometry"), best_effort);
  auto* closure = publisher->create_datawriter(topic(new SentType(false), "rt/backwash/loop_closure"), kept);
  fast::DataReaderQos tf_qos;
  tf_qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  tf_qos.history().depth = 100;
  auto* tf = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
                 ->create_datareader(topic(new TfType, "rt/tf"), tf_qos);
  if (what != "map") closure->write(&map);
  std::map<std::string, Seen> seen;
  auto due = std::chrono::steady_clock::now();
  int last = 100 * found;
  for (int n = 0; n < last + 100 * kAfter; ++n) {
    const bool during = n < last;
    if (during) odometry->write(&what);
    std::vector<Transform> message;
    fast::SampleInfo info;
    while (tf->take_next_sample(&message, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
      for (const Transform& t : message) {
        if (seen.empty() && during) last = n + 100 * seconds;
        Seen& s = seen[t.frame + " > " + t.child];
        s.last = t;
        if (during && s.during == 0) s.begun = t.stamp;
        if (during) s.ended = t.stamp;
        ++(during ? s.during : s.after);
        s.oldest = std::max(s.oldest, t.age);
        s.newest = std::min(s.newest, t.age);
      }
    due += std::chrono::milliseconds(10);
    std::this_thread::sleep_until(due);
  }
  for (const auto& [name, s] : seen)
    std::printf("%s: %.3f %.3f %.3f yaw %.3f, %.1f a second, %d after it, %.1f to %.1f s old\n", name.c_str(),
                s.last.at.x, s.last.at.y, s.last.at.z, s.last.at.yaw, s.rate(), s.after, s.newest, s.oldest);
  return 0;
}
