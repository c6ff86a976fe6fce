// SPDX-License-Identifier: BSD-3-Clause
// A ground station that does what backwashctl never would, for the scripts beside it (docs/faults.md rows 28, 46, 48).
//   station_probe DOMAIN NAMESPACE script               one writer; each line of standard input is a command,
//                                                       STATION SESSION SEQUENCE VERB [X Y Z]; prints RESULT REASON of
//                                                       its answer, or `silence` after 2 s
//   station_probe DOMAIN NAMESPACE answers SECONDS      asks for nothing 20 times a second; prints the time of the
//                                                       question (s, monotonic) and until its answer (s)
//   station_probe DOMAIN NAMESPACE stops N X            to and fro between -X and X, stopped on the way N times; prints
//                                                       when each STOP was sent (s, monotonic)
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <thread>

#include "services/dds/topics.hpp"

namespace dds = backwash::dds;
using namespace std::chrono_literals;

namespace {

using Clock = std::chrono::steady_clock;

double now() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

struct Answer {
  int result;
  std::string reason;
};

class Station {
 public:
  Station(std::uint32_t domain, const std::string& name_space)
      : participant_(domain, "lo"),
        commands_(dds::make_writer<dds::Command>(participant_, name_space)),
        acks_(dds::make_reader<dds::Ack>(participant_, name_space)),
        statuses_(dds::make_reader<dds::Status>(participant_, name_space)),
        waitset_(participant_) {
    waitset_.add(acks_);
    for (int n = 0; n < 500 && commands_.matched() == 0; ++n) std::this_thread::sleep_for(10ms);
    std::this_thread::sleep_for(200ms);  // the answers' way back
  }

  std::optional<Answer> ask(dds::Command command, const std::string& station, double patience_s = 2) {
    command.station = dds::c_string(station);
    const double begun = now();
    commands_.write(command);
    std::optional<Answer> answer;
    while (!answer && now() - begun < patience_s) {
      waitset_.wait(0.01);
      acks_.take([&](const dds::Ack& ack) {
        if (std::ranges::equal(ack.writer, commands_.guid()) && ack.session == command.session &&
            ack.sequence_number == command.sequence_number)
          answer = Answer{ack.result, ack.reason};
      });
    }
    return answer;
  }

  /// False after a minute.
  bool wait(const std::function<bool(const dds::Status&)>& holds) {
    for (const double begun = now(); now() - begun < 60; std::this_thread::sleep_for(5ms)) {
      bool held = false;
      statuses_.take([&](const dds::Status& s) { held = holds(s); });
      if (held) return true;
    }
    return false;
  }

 private:
  dds::Participant participant_;
  dds::Writer<dds::Command> commands_;
  dds::Reader<dds::Ack> acks_;
  dds::Reader<dds::Status> statuses_;
  dds::WaitSet waitset_;
};

int script(Station& station) {
  std::string line;
  while (std::getline(std::cin, line) && line != "end") {
    std::istringstream words(line);
    std::string name;
    unsigned verb = 0;
    dds::Command c{};
    words >> name >> c.session >> c.sequence_number >> verb >> c.position.x >> c.position.y >> c.position.z;
    c.verb = static_cast<std::uint8_t>(verb);
    const auto answer = station.ask(c, name);
    if (answer)
      std::printf("%d %s\n", answer->result, answer->reason.c_str());
    else
      std::puts("silence");
  }
  return 0;
}

int answers(Station& station, double seconds) {
  dds::Command c{};
  c.session = 77;
  auto due = Clock::now();
  for (const double end = now() + seconds; now() < end;) {
    ++c.sequence_number;
    const double asked = now();
    if (station.ask(c, "nobody", 1)) std::printf("%.6f %.6f\n", asked, now() - asked);
    std::fflush(stdout);  // it may be ended before
    due += 50ms;
    std::this_thread::sleep_until(due);
  }
  return 0;
}

int stops(Station& station, int count, double x) {
  std::mt19937 random(1);
  dds::Command c{};
  c.session = std::random_device{}();
  double goal = x;
  for (int n = 0; n < count; ++n, goal = -goal) {
    c.verb = backwash_msgs_msg_dds__COMMAND_GOTO;
    c.position = {goal, 0, 1.2};
    ++c.sequence_number;
    const auto accepted = station.ask(c, "stops");
    if (!accepted || accepted->result != 0) {
      std::fprintf(stderr, "goto: %s\n", accepted ? accepted->reason.c_str() : "silence");
      return 1;
    }
    const bool flies = station.wait([&](const dds::Status& s) {
      return s.moving && std::string(s.state) == "tracking" && std::abs(s.setpoint.x - goal) < 2 * x - 0.4;
    });
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 400'000));
    c.verb = backwash_msgs_msg_dds__COMMAND_STOP;
    ++c.sequence_number;
    const double sent = now();
    const auto stopped = station.ask(c, "stops");
    const bool rests = station.wait([](const dds::Status& s) { return !s.moving && std::string(s.state) == "hold"; });
    if (!flies || !stopped || stopped->result != 0 || !rests) {
      std::fprintf(stderr, "stop %d: flies %d, %s, rests %d\n", n, flies, stopped ? stopped->reason.c_str() : "silence",
                   rests);
      return 1;
    }
    std::printf("%.6f\n", sent);
    std::this_thread::sleep_for(300ms);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 3 ? argv[3] : "";
  if (argc < 4) return 64;
  std::setvbuf(stdout, nullptr, _IOLBF, 1 << 12);  // whole lines, whenever it is ended
  Station station(static_cast<std::uint32_t>(std::atoi(argv[1])), argv[2]);
  if (what == "script") return script(station);
  if (what == "answers" && argc == 5) return answers(station, std::atof(argv[4]));
  if (what == "stops" && argc == 6) return stops(station, std::atoi(argv[4]), std::atof(argv[5]));
  return 64;
}
