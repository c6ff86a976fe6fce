// SPDX-License-Identifier: BSD-3-Clause
// Who reads the daemon's topics through Cyclone DDS as it comes: its own library and settings, nothing of services/dds.
//   cyclone_reader DOMAIN SECONDS (TOPIC TYPE sensor|default|latched) …
// As fastdds_reader; the types are those of idl/.
#include <dds/dds.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "type_hashes.hpp"

namespace {

struct Asked {
  std::string topic, qos;
  dds_entity_t reader;
  int samples = 0;
  double begun = 0, ended = 0;  // s, stamps of the first and the last

  std::uint32_t matched() const {
    dds_subscription_matched_status_t status{};
    dds_get_subscription_matched_status(reader, &status);
    return status.current_count;
  }
  double rate() const { return samples > 1 ? (samples - 1) / (ended - begun) : 0; }
};

dds_entity_t make_reader(dds_entity_t participant, dds_entity_t topic, const std::string& name) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, name == "sensor" ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, name == "latched" ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  return reader;
}

/// What discovery says of the writers of each topic.
std::map<std::string, std::string> user_data(dds_entity_t publications) {
  std::map<std::string, std::string> all;
  void* sample = nullptr;
  dds_sample_info_t info;
  while (dds_take(publications, &sample, &info, 1, 1) == 1) {
    const auto& writer = *static_cast<const dds_builtintopic_endpoint_t*>(sample);
    void* said = nullptr;
    std::size_t size = 0;
    if (info.valid_data && dds_qget_userdata(writer.qos, &said, &size) && size > 0)
      all[writer.topic_name].assign(static_cast<const char*>(said), size);
    dds_free(said);
    dds_return_loan(publications, &sample, 1);
    sample = nullptr;
  }
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6 || argc % 3 != 0) return 64;
  const dds_entity_t participant =
      dds_create_participant(static_cast<dds_domainid_t>(std::atoi(argv[1])), nullptr, nullptr);
  if (participant < 0) return 70;
  const dds_entity_t publications = dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
  std::vector<Asked> all;
  for (int n = 3; n < argc; n += 3) {
    const auto* const* type = std::ranges::find_if(
        backwash::dds::kDescriptors, [&](const auto* t) { return std::string(t->m_typename) == argv[n + 1]; });
    if (type == std::end(backwash::dds::kDescriptors)) return 64;
    const dds_entity_t topic = dds_create_topic(participant, *type, argv[n], nullptr, nullptr);
    all.push_back({argv[n], argv[n + 2], make_reader(participant, topic, argv[n + 2])});
  }
  const auto wanted = std::chrono::seconds(std::atoi(argv[2]));
  const auto begun = std::chrono::steady_clock::now();
  auto end = begun + wanted;
  for (auto now = begun; now < end; now = std::chrono::steady_clock::now()) {
    if (now < begun + 3 * wanted && !std::ranges::all_of(all, &Asked::matched)) end = now + wanted;
    for (Asked& a : all) {
      void* sample = nullptr;
      dds_sample_info_t info;
      while (dds_take(a.reader, &sample, &info, 1, 1) == 1) {
        if (info.valid_data) {
          a.ended = 1e-9 * static_cast<double>(info.source_timestamp);
          if (a.samples++ == 0) a.begun = a.ended;
        }
        dds_return_loan(a.reader, &sample, 1);
        sample = nullptr;
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const auto said = user_data(publications);
  for (const Asked& a : all)
    std::printf("%s %s: matched %u, %d samples, %.2f a second, user data %s\n", a.topic.c_str(), a.qos.c_str(),
                a.matched(), a.samples, a.rate(), said.contains(a.topic) ? said.at(a.topic).c_str() : "");
  dds_delete(participant);
  return 0;
}
