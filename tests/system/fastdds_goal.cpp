// SPDX-License-Identifier: BSD-3-Clause
// RViz's "2D Goal Pose" as a foreign peer: a Fast DDS participant with its own hand-written type sends one pose,
// reliably, as soon as somebody listens, for tests/system/daemon_goals.sh.
//   fastdds_goal DOMAIN TOPIC FRAME AGE_S X Y Z QX QY QZ QW
// AGE_S: of its stamp; "none" leaves it 0. 1 if nobody listened or took it within 10 s.
#include "tests/system/fastdds_local.hpp"

#include <array>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

namespace {

struct Pose {
  std::int64_t stamp_ns = 0;
  std::string frame;
  std::array<double, 7> values{};  // position, orientation x y z w
};

/// Members in the order of the .msg files of common_interfaces.
class PoseType : public Type {
 public:
  PoseType() : Type("geometry_msgs::msg::dds_::PoseStamped_", 1024) {}
  bool serialize(void* data, Payload* payload) override {
    const auto& pose = *static_cast<Pose*>(data);
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    payload->encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    cdr << static_cast<std::int32_t>(pose.stamp_ns / 1'000'000'000)
        << static_cast<std::uint32_t>(pose.stamp_ns % 1'000'000'000) << pose.frame;
    for (const double v : pose.values) cdr << v;
    payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
    return true;
  }
  bool deserialize(Payload*, void*) override { return false; }
  void* createData() override { return new Pose; }
  void deleteData(void* data) override { delete static_cast<Pose*>(data); }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 12) return 64;
  const auto domain = static_cast<unsigned>(std::atoi(argv[1]));
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(domain, local_only(domain));
  if (!participant) return 70;
  fast::TypeSupport type(new PoseType);
  type.register_type(participant);
  auto* topic = participant->create_topic(argv[2], type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  fast::DataWriterQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  auto* writer = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, qos);
  fast::PublicationMatchedStatus matched;
  for (int n = 0; n < 200 && matched.current_count == 0; ++n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    writer->get_publication_matched_status(matched);
  }
  // The reader matches a little later; what is written before that is acknowledged as history, and not delivered.
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  Pose pose;
  pose.frame = argv[3];
  if (std::string(argv[4]) != "none") {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    pose.stamp_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count() -
                    static_cast<std::int64_t>(1e9 * std::atof(argv[4]));
  }
  for (std::size_t n = 0; n < pose.values.size(); ++n) pose.values[n] = std::atof(argv[5 + n]);
  writer->write(&pose);
  const bool taken = writer->wait_for_acknowledgments({10, 0}) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
  return matched.current_count > 0 && taken ? 0 : 1;
}
