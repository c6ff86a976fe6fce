// SPDX-License-Identifier: BSD-3-Clause
// ROS 2's default middleware as a foreign peer: a Fast DDS participant with its own hand-written types sends odometry
// of a vehicle at rest and reads the daemon's status, for tests/system/daemon_fastdds.sh.
//   fastdds_peer DOMAIN ODOMETRY_TOPIC STATUS_TOPIC X Y Z SECONDS [cut]
// With `cut` its odometry breaks off after the stamp: bytes that are no sample of the type they claim to be.
// Prints the last status that it read: "vehicle state"; 1 if there was none.
#include <fastcdr/Cdr.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

namespace fast = eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;
using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;

namespace {

struct Odometry {
  double x = 0, y = 0, z = 0;
  bool cut = false;
};

struct Status {
  std::string vehicle, state;
};

std::chrono::nanoseconds monotonic() { return std::chrono::steady_clock::now().time_since_epoch(); }

/// What the two types share. XCDR1 as ROS 2 uses it.
class Type : public fast::TopicDataType {
 public:
  Type(const char* name, std::uint32_t size) {
    setName(name);
    m_typeSize = size;
    m_isGetKeyDefined = false;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [this] { return m_typeSize; };
  }
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

class OdometryType : public Type {
 public:
  OdometryType() : Type("nav_msgs::msg::dds_::Odometry_", 1024) {}
  bool serialize(void* data, Payload* payload) override {
    const auto& o = *static_cast<Odometry*>(data);
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    payload->encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    const auto now = monotonic().count();
    cdr << static_cast<std::int32_t>(now / 1'000'000'000) << static_cast<std::uint32_t>(now % 1'000'000'000);
    if (!o.cut) {
      cdr << std::string("map") << std::string("base_link");
      for (const double v : {o.x, o.y, o.z, 0.0, 0.0, 0.0, 1.0}) cdr << v;
      for (int n = 0; n < 36 + 6 + 36; ++n) cdr << 0.0;
    }
    payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
    return true;
  }
  bool deserialize(Payload*, void*) override { return false; }
  void* createData() override { return new Odometry; }
  void deleteData(void* data) override { delete static_cast<Odometry*>(data); }
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

/// Over UDP on the loopback interface, which has no multicast: others are looked for by their ports.
fast::DomainParticipantQos local_only(unsigned domain) {
  fast::DomainParticipantQos qos;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  for (unsigned index = 0; index < 10; ++index) {
    eprosima::fastrtps::rtps::Locator_t peer;
    peer.kind = LOCATOR_KIND_UDPv4;
    eprosima::fastrtps::rtps::IPLocator::setIPv4(peer, "127.0.0.1");
    peer.port = 7410 + 250 * domain + 2 * index;
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
  }
  return qos;
}

}  // namespace

int main(int argc, char** argv) {
  const bool cut = argc == 9 && std::string(argv[8]) == "cut";
  if (argc != 8 && !cut) return 64;
  const auto domain = static_cast<unsigned>(std::atoi(argv[1]));
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(domain, local_only(domain));
  if (!participant) return 70;
  fast::TypeSupport odometry_type(new OdometryType), status_type(new StatusType);
  odometry_type.register_type(participant);
  status_type.register_type(participant);
  auto* odometry_topic = participant->create_topic(argv[2], odometry_type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  auto* status_topic = participant->create_topic(argv[3], status_type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  fast::DataWriterQos writer_qos;
  writer_qos.reliability().kind = fast::BEST_EFFORT_RELIABILITY_QOS;
  auto* writer =
      participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(odometry_topic, writer_qos);
  fast::DataReaderQos reader_qos;
  reader_qos.reliability().kind = fast::BEST_EFFORT_RELIABILITY_QOS;
  auto* reader =
      participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)->create_datareader(status_topic, reader_qos);
  Odometry odometry{std::atof(argv[4]), std::atof(argv[5]), std::atof(argv[6]), cut};
  Status status;
  fast::SampleInfo info;
  const int samples = 100 * std::atoi(argv[7]);
  auto due = std::chrono::steady_clock::now();
  for (int n = 0; n < samples; ++n) {
    writer->write(&odometry);
    while (reader->take_next_sample(&status, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
    }
    due += std::chrono::milliseconds(10);
    std::this_thread::sleep_until(due);
  }
  std::printf("%s %s\n", status.vehicle.c_str(), status.state.c_str());
  return status.state.empty() ? 1 : 0;
}
