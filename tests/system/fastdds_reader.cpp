// SPDX-License-Identifier: BSD-3-Clause
// Who reads the daemon's topics through Fast DDS as it comes: a participant with every setting at its default.
//   fastdds_reader DOMAIN SECONDS (TOPIC TYPE sensor|default|latched) …
// By ROS 2's names: sensor is best effort, default reliable and volatile, latched reliable and transient local. Listens
// for so long from when all are matched, for which it waits three times as long. Prints a line for each, "TOPIC QOS:
// matched M, N samples, R a second, user data TEXT": R by their writer's stamps, the text as it said it in discovery.
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/fastdds_local.hpp"

namespace {

/// Any type by name: what is in a sample is not looked at.
class AnyType : public Type {
 public:
  explicit AnyType(const char* name) : Type(name, 1 << 20) {}
  bool serialize(void*, Payload*) override { return false; }
  bool deserialize(Payload*, void*) override { return true; }
  void* createData() override { return new char; }
  void deleteData(void* data) override { delete static_cast<char*>(data); }
};

/// What discovery says of the writers of each topic.
class Writers : public fast::DomainParticipantListener {
 public:
  void on_publisher_discovery(fast::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& writer) override {
    const std::lock_guard lock(mutex_);
    const auto& said = writer.info.m_qos.m_userData;
    if (!said.empty()) user_data_[writer.info.topicName().to_string()].assign(said.begin(), said.end());
  }
  std::string user_data(const std::string& topic) {
    const std::lock_guard lock(mutex_);
    return user_data_[topic];
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::string> user_data_;
};

struct Asked {
  std::string topic, qos;
  fast::DataReader* reader;
  int samples = 0;
  double begun = 0, ended = 0;  // s, stamps of the first and the last

  bool matched() const {
    fast::SubscriptionMatchedStatus status;
    reader->get_subscription_matched_status(status);
    return status.current_count > 0;
  }
  double rate() const { return samples > 1 ? (samples - 1) / (ended - begun) : 0; }
};

fast::DataReaderQos quality(const std::string& name) {
  fast::DataReaderQos qos;
  qos.reliability().kind = name == "sensor" ? fast::BEST_EFFORT_RELIABILITY_QOS : fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = name == "latched" ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  qos.history().depth = 10;
  return qos;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6 || argc % 3 != 0) return 64;
  Writers writers;
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<unsigned>(std::atoi(argv[1])), fast::PARTICIPANT_QOS_DEFAULT, &writers, fast::StatusMask::none());
  if (!participant) return 70;
  auto* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  std::vector<Asked> all;
  std::map<std::string, fast::Topic*> topics;
  for (int n = 3; n < argc; n += 3) {
    fast::TypeSupport type(new AnyType(argv[n + 1]));
    type.register_type(participant);
    auto*& topic = topics[argv[n]];
    if (!topic) topic = participant->create_topic(argv[n], type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    all.push_back({argv[n], argv[n + 2], subscriber->create_datareader(topic, quality(argv[n + 2]))});
  }
  const auto wanted = std::chrono::seconds(std::atoi(argv[2]));
  const auto begun = std::chrono::steady_clock::now();
  auto end = begun + wanted;
  for (auto now = begun; now < end; now = std::chrono::steady_clock::now()) {
    if (now < begun + 3 * wanted && !std::ranges::all_of(all, &Asked::matched)) end = now + wanted;
    char sample;
    fast::SampleInfo info;
    for (Asked& a : all)
      while (a.reader->take_next_sample(&sample, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
        if (info.valid_data) {
          a.ended = 1e-9 * static_cast<double>(info.source_timestamp.to_ns());
          if (a.samples++ == 0) a.begun = a.ended;
        }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  for (const Asked& a : all) {
    fast::SubscriptionMatchedStatus matched;
    a.reader->get_subscription_matched_status(matched);
    std::printf("%s %s: matched %d, %d samples, %.2f a second, user data %s\n", a.topic.c_str(), a.qos.c_str(),
                matched.current_count, a.samples, a.rate(), writers.user_data(a.topic).c_str());
  }
  std::fflush(stdout);
  std::_Exit(0);  // what discovery still tells is not listened to
}
