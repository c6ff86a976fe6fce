// SPDX-License-Identifier: BSD-3-Clause
// ROS 2's default middleware as a foreign peer: a Fast DDS participant with its own hand-written types sends the poses
// of a vehicle at rest and reads the daemon's status, for tests/system/daemon_fastdds.sh.
//   fastdds_peer DOMAIN ODOMETRY_TOPIC STATUS_TOPIC X Y Z SECONDS odometry|pose|pose_with_covariance|tf|cut
// With `cut` its odometry breaks off after the stamp: bytes that are no sample of the type they claim to be.
// Prints the last status that it read: "vehicle state"; 1 if there was none.
#include "tests/system/fastdds_local.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <string>
#include <thread>

namespace {

struct Poses {
  double x = 0, y = 0, z = 0;
};

/// Of which the message is, and what it is said in.
struct Kind {
  const char *name, *type;
};
constexpr Kind kKinds[] = {{"odometry", "nav_msgs::msg::dds_::Odometry_"},
                           {"pose", "geometry_msgs::msg::dds_::PoseStamped_"},
                           {"pose_with_covariance", "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"},
                           {"tf", "tf2_msgs::msg::dds_::TFMessage_"},
                           {"cut", "nav_msgs::msg::dds_::Odometry_"}};

struct Status {
  std::string vehicle, state;
};

std::chrono::nanoseconds monotonic() { return std::chrono::steady_clock::now().time_since_epoch(); }

/// Members in the order of the .msg files of common_interfaces and geometry2.
class PosesType : public Type {
 public:
  explicit PosesType(const Kind& kind) : Type(kind.type, 1024), kind_(kind.name) {}
  bool serialize(void* data, Payload* payload) override {
    const auto& at = *static_cast<Poses*>(data);
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    payload->encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    if (kind_ == "tf") {  // a joint's transform, where the odometry began, and the vehicle's
      cdr << std::uint32_t{3};
      transform(cdr, "base_link", "camera", {0.1, 0, 0});
      transform(cdr, "map", "odom", {1, 0, 0});
      transform(cdr, "odom", "base_link", {at.x - 1, at.y, at.z});
    } else {
      header(cdr, kind_ == "cut" ? nullptr : "map");
    }
    if (kind_ == "odometry") cdr << std::string("base_link");
    if (kind_ != "cut" && kind_ != "tf") pose(cdr, at);
    const int covariances = kind_ == "pose_with_covariance" ? 36 : kind_ == "odometry" ? 36 + 6 + 36 : 0;
    for (int n = 0; n < covariances; ++n) cdr << 0.0;
    payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
    return true;
  }
  bool deserialize(Payload*, void*) override { return false; }
  void* createData() override { return new Poses; }
  void deleteData(void* data) override { delete static_cast<Poses*>(data); }

 private:
  static void header(Cdr& cdr, const char* frame) {
    const auto now = monotonic().count();
    cdr << static_cast<std::int32_t>(now / 1'000'000'000) << static_cast<std::uint32_t>(now % 1'000'000'000);
    if (frame) cdr << std::string(frame);
  }
  static void pose(Cdr& cdr, const Poses& at) {
    for (const double v : {at.x, at.y, at.z, 0.0, 0.0, 0.0, 1.0}) cdr << v;
  }
  static void transform(Cdr& cdr, const char* frame, const char* child, const Poses& at) {
    header(cdr, frame);
    cdr << std::string(child);
    pose(cdr, at);
  }
  std::string kind_;
};

class StatusType : public Type {
 public:
  StatusType() : Type("backwash_msgs::msg::dds_::Status_", 4096) {}
  bool serialize(void*, Payload*) override { return false; }
  bool deserialize(Payload* payload, void* data) override {
    auto& s = *static_cast<Status*>(data);
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    std::int32_t seconds = 0;
    std::uint32_t nanoseconds = 0;
    cdr >> seconds >> nanoseconds >> s.vehicle >> s.state;
    return true;
  }
  void* createData() override { return new Status; }
  void deleteData(void* data) override { delete static_cast<Status*>(data); }
};

}  // namespace

int main(int argc, char** argv) {
  const auto* kind = argc == 9 ? std::find_if(std::begin(kKinds), std::end(kKinds),
                                              [&](const Kind& k) { return std::string(argv[8]) == k.name; })
                               : std::end(kKinds);
  if (kind == std::end(kKinds)) return 64;
  const auto domain = static_cast<unsigned>(std::atoi(argv[1]));
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(domain, local_only(domain));
  if (!participant) return 70;
  fast::TypeSupport poses_type(new PosesType(*kind)), status_type(new StatusType);
  poses_type.register_type(participant);
  status_type.register_type(participant);
  auto* poses_topic = participant->create_topic(argv[2], poses_type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  auto* status_topic = participant->create_topic(argv[3], status_type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  fast::DataWriterQos writer_qos;
  writer_qos.reliability().kind = fast::BEST_EFFORT_RELIABILITY_QOS;
  auto* writer = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(poses_topic, writer_qos);
  fast::DataReaderQos reader_qos;
  reader_qos.reliability().kind = fast::BEST_EFFORT_RELIABILITY_QOS;
  auto* reader =
      participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)->create_datareader(status_topic, reader_qos);
  Poses poses{std::atof(argv[4]), std::atof(argv[5]), std::atof(argv[6])};
  Status status;
  fast::SampleInfo info;
  const int samples = 100 * std::atoi(argv[7]);
  auto due = std::chrono::steady_clock::now();
  for (int n = 0; n < samples; ++n) {
    writer->write(&poses);
    while (reader->take_next_sample(&status, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
    }
    due += std::chrono::milliseconds(10);
    std::this_thread::sleep_until(due);
  }
  std::printf("%s %s\n", status.vehicle.c_str(), status.state.c_str());
  return status.state.empty() ? 1 : 0;
}
