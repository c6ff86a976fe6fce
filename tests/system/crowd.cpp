// SPDX-License-Identifier: BSD-3-Clause
// A large ROS 2 system beside the vehicle, as Cyclone DDS announces it: nothing of services/dds is in it.
//   crowd DOMAIN PARTICIPANTS ENDPOINTS SECONDS
// PARTICIPANTS of one process with ENDPOINTS writers each of other topics, and, made last, one reader of the vehicle's
// status. Says "begun" when all are made, and at the end how many of those readers heard something.
#include <dds/dds.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "backwash_msgs.h"

int main(int argc, char** argv) {
  if (argc != 5) return 64;
  const auto number = [&](int n) { return std::atoi(argv[n]); };
  const dds_topic_descriptor_t* const type = &backwash_msgs_msg_dds__Status__desc;
  std::vector<dds_entity_t> readers;
  for (int of = 0; of < number(2); ++of) {
    const dds_entity_t participant = dds_create_participant(static_cast<dds_domainid_t>(number(1)), nullptr, nullptr);
    const auto topic = [&](const std::string& name) {
      return dds_create_topic(participant, type, name.c_str(), nullptr, nullptr);
    };
    for (int n = 0; n < number(3); ++n)
      if (dds_create_writer(participant, topic("rt/robot/node_" + std::to_string(n) + "/event"), nullptr, nullptr) < 0)
        return 70;
    readers.push_back(dds_create_reader(participant, topic("rt/backwash/status"), nullptr, nullptr));
    if (readers.back() < 0) return 70;
  }
  std::puts("begun");
  std::fflush(stdout);
  std::vector<bool> heard(readers.size());
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(number(4));
  while (std::chrono::steady_clock::now() < end) {
    for (std::size_t n = 0; n < readers.size(); ++n) {
      void* sample = nullptr;
      dds_sample_info_t info;
      if (dds_take(readers[n], &sample, &info, 1, 1) != 1) continue;
      heard[n] = true;
      dds_return_loan(readers[n], &sample, 1);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::printf("%td of %zu readers heard the status\n", std::ranges::count(heard, true), heard.size());
  return 0;
}
