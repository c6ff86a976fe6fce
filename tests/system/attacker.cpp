// SPDX-License-Identifier: BSD-3-Clause
// What an operator in a hurry and a stranger send, for tests/system/attack_*.sh.
//   attacker DOMAIN send STEP …               STEP: VERB[=X,Y,Z] or +MILLISECONDS; no step waits for an answer. Each
//                                             answer is a line: time (s, monotonic), verb, result, reason
//   attacker DOMAIN flood SECONDS             commands of a stranger, as fast as they go
//   attacker DOMAIN receipts SECONDS          answers each part of a map in the daemon's name: the map is in use
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <thread>

#include "services/dds/topics.hpp"

namespace dds = backwash::dds;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

namespace {

const std::string kNamespace = "backwash";
const std::map<std::string, std::uint8_t> kVerbs{
    {"enable", backwash_msgs_msg_dds__COMMAND_ENABLE},   {"disable", backwash_msgs_msg_dds__COMMAND_DISABLE},
    {"takeoff", backwash_msgs_msg_dds__COMMAND_TAKEOFF}, {"goto", backwash_msgs_msg_dds__COMMAND_GOTO},
    {"hold", backwash_msgs_msg_dds__COMMAND_HOLD},       {"land", backwash_msgs_msg_dds__COMMAND_LAND},
    {"stop", backwash_msgs_msg_dds__COMMAND_STOP},       {"release", backwash_msgs_msg_dds__COMMAND_RELEASE}};

double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

/// One station with one session.
class Operator {
 public:
  explicit Operator(const dds::Participant& participant)
      : writer_(dds::make_writer<dds::Command>(participant, kNamespace)),
        acks_(dds::make_reader<dds::Ack>(participant, kNamespace)),
        session_(static_cast<std::uint64_t>(Clock::now().time_since_epoch().count())) {
    // The daemon's answers must find us, too: what was sent before is not repeated to a late reader.
    for (int n = 0; n < 500 && writer_.matched() == 0; ++n) std::this_thread::sleep_for(10ms);
    std::this_thread::sleep_for(300ms);
  }
  bool send(const std::string& step) {
    const auto equals = step.find('=');
    const auto verb = kVerbs.find(step.substr(0, equals));
    if (verb == kVerbs.end()) return false;
    dds::Command c{};
    c.station = station_;
    c.session = session_;
    c.sequence_number = ++sequence_;
    c.verb = verb->second;
    auto& p = c.position;
    if (equals != step.npos && std::sscanf(step.c_str() + equals, "=%lf,%lf,%lf", &p.x, &p.y, &p.z) != 3) return false;
    sent_[sequence_] = verb->first;
    writer_.write(c);
    return true;
  }
  void listen(std::chrono::milliseconds how_long) {
    const auto until = Clock::now() + how_long;
    do {
      acks_.take([&](const dds::Ack& ack) {
        if (ack.session != session_ || !sent_.contains(ack.sequence_number)) return;
        std::printf("%.6f %s %d %s\n", now_s(), sent_[ack.sequence_number].c_str(), ack.result, ack.reason);
        sent_.erase(ack.sequence_number);
      });
      std::this_thread::sleep_for(1ms);
    } while (Clock::now() < until);
  }
  bool all_answered() const { return sent_.empty(); }

 private:
  dds::Writer<dds::Command> writer_;
  dds::Reader<dds::Ack> acks_;
  std::uint64_t session_;
  std::uint32_t sequence_ = 0;
  std::map<std::uint32_t, std::string> sent_;
  char station_[9] = "operator";
};

int send(const dds::Participant& participant, int count, char** steps) {
  Operator station(participant);
  for (int n = 0; n < count; ++n) {
    if (steps[n][0] == '+')
      station.listen(std::chrono::milliseconds(std::atoi(steps[n] + 1)));
    else if (!station.send(steps[n]))
      return 64;
  }
  for (int n = 0; n < 20 && !station.all_answered(); ++n) station.listen(100ms);
  return station.all_answered() ? 0 : 69;
}

/// A stranger that never waits for an answer.
int flood(const dds::Participant& participant, double seconds) {
  auto writer = dds::make_writer<dds::Command>(participant, kNamespace);
  for (int n = 0; n < 500 && writer.matched() == 0; ++n) std::this_thread::sleep_for(10ms);
  char station[] = "stranger";
  dds::Command c{};
  c.station = station;
  c.session = static_cast<std::uint64_t>(Clock::now().time_since_epoch().count());
  c.verb = kVerbs.at("hold");
  for (const double end = now_s() + seconds; now_s() < end; ++c.sequence_number) writer.write(c);
  std::printf("%.6f flood of %u commands\n", now_s(), c.sequence_number);
  return 0;
}

/// Whoever hears a part knows its transfer.
int forge_receipts(const dds::Participant& participant, double seconds) {
  auto writer = dds::make_writer<dds::MapReceipt>(participant, kNamespace);
  auto parts = dds::make_reader<dds::MapPart>(participant, kNamespace);
  unsigned forged = 0;
  for (const double end = now_s() + seconds; now_s() < end; std::this_thread::sleep_for(1ms))
    parts.take([&](const dds::MapPart& part) {
      char nothing[] = "";
      dds::MapReceipt receipt{};
      receipt.transfer = part.transfer;
      receipt.newest = part.sent;
      receipt.state = backwash_msgs_msg_dds__MAPRECEIPT_ACCEPTED;
      receipt.reason = nothing;
      writer.write(receipt);
      ++forged;
    });
  std::printf("%u receipts forged\n", forged);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 64;
  const dds::Participant participant(static_cast<std::uint32_t>(std::atoi(argv[1])), "lo");
  const std::string mode = argv[2];
  if (mode == "send") return send(participant, argc - 3, argv + 3);
  if (mode == "flood" && argc == 4) return flood(participant, std::atof(argv[3]));
  if (mode == "receipts" && argc == 4) return forge_receipts(participant, std::atof(argv[3]));
  return 64;
}
