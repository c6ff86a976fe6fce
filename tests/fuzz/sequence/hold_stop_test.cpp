// SPDX-License-Identifier: BSD-3-Clause
// HOLD and STOP at random times, one soon after another, in flights that nothing else disturbs, by each emulated real
// autopilot. How many ticks it was outside its sets is told, not judged: both profiles leave them now and then with the
// vehicle of the rig.
//   BACKWASH_FUZZ_HOLDS   sequences of each autopilot (4)
//   BACKWASH_FUZZ_SEED    of the first one (1)
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <random>

#include "backwash_msgs.h"
#include "tests/fuzz/sequence/daemon_rig.hpp"

namespace backwash::fuzz {
namespace {

constexpr int kAirborne = 1000;                   // ticks: both have taken off
constexpr int kEnd = 6000;                        // ticks: two minutes
constexpr int kStop = 1, kHold = 15, kNext = 90;  // draws of Event::Kind::operate

/// Enable and take off, then again and again a flight with one to three orders to hold or stop it.
std::vector<Event> orders(std::uint64_t seed) {
  std::mt19937_64 draws(seed);
  const auto draw = [&draws](int below) { return static_cast<int>(draws() % static_cast<std::uint64_t>(below)); };
  const auto share = [&draws] { return static_cast<double>(draws() >> 11) * 0x1p-53; };
  std::vector<Event> events;
  for (int tick = 62; tick < kAirborne; tick += 60)
    events.push_back({tick, Event::Kind::operate, kNext, 0.5, 0.5, 0.5});
  for (int tick = kAirborne; tick < kEnd;) {
    events.push_back({tick, Event::Kind::command, backwash_msgs_msg_dds__COMMAND_GOTO, share(), share(), share()});
    tick += draw(150);
    for (int n = 1 + draw(3); n > 0; --n) {
      events.push_back({tick, Event::Kind::operate, draw(2) ? kStop : kHold});
      tick += draw(70);
    }
    tick += 250;
  }
  return events;
}

unsigned long number(const char* name, unsigned long otherwise) {
  const char* text = std::getenv(name);
  return text ? std::strtoul(text, nullptr, 10) : otherwise;
}

struct Flown {
  std::string name;
  MakeAutopilot* make;
};

class HoldAndStop : public testing::TestWithParam<Flown> {
 protected:
  void SetUp() override { spdlog::set_level(spdlog::level::off); }
  void TearDown() override { spdlog::set_level(spdlog::level::info); }
};

TEST_P(HoldAndStop, AreFlownWithoutAStepOfTheSetPoint) {
  const unsigned long first = number("BACKWASH_FUZZ_SEED", 1), count = number("BACKWASH_FUZZ_HOLDS", 4);
  long plans = 0, ticks = 0;
  unsigned long failed = 0, outside = 0;
  for (unsigned long seed = first; seed < first + count; ++seed) {
    DaemonRig rig(orders(seed), daemon::test::Medium::udp, GetParam().make);
    rig.operated_only();
    const auto violation = rig.run(kEnd);
    failed += violation.has_value();
    EXPECT_FALSE(violation) << "sequence " << seed << ", tick " << violation->tick << ": " << violation->what;
    EXPECT_GT(rig.plans(), 10) << "sequence " << seed << " hardly flew";
    plans += rig.plans();
    ticks += rig.ticks();
    outside += rig.outside();
  }
  std::printf("%lu of %lu sequences failed, %ld segments flown, %lu of %ld ticks outside\n", failed, count, plans,
              outside, ticks);
}
INSTANTIATE_TEST_SUITE_P(Autopilots, HoldAndStop,
                         testing::Values(Flown{"ArduCopter", bench::make_arducopter}, Flown{"Px4", bench::make_px4}),
                         [](const auto& of) { return of.param.name; });

}  // namespace
}  // namespace backwash::fuzz
