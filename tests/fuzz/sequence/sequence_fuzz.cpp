// SPDX-License-Identifier: BSD-3-Clause
// Sequences of whatever may happen to the daemon, in lockstep, against what must hold at every tick (watch.hpp). Each
// sequence follows from its seed. One that breaks a promise is cut down to the events that are needed for it, and
// printed as a regression test would hold it.
//   BACKWASH_FUZZ_TICKS   ticks in all (1,000,000)
//   BACKWASH_FUZZ_SEED    of the first sequence (1); the next ones follow
//   BACKWASH_FUZZ_VIOLATIONS  sequences that may break a promise until the search ends (1)
//   BACKWASH_FUZZ_SHORTEN     0: they are named only
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "tests/fuzz/sequence/daemon_rig.hpp"

namespace backwash::fuzz {
namespace {

using daemon::test::Medium;
using Events = std::vector<Event>;

constexpr int kTicks = 3000;          // of a sequence: a minute
constexpr int kShards = 4;            // of the whole, so that ctest can run them side by side
constexpr int kReplayEvery = 8;       // sequences
constexpr int kMostRuns = 200;        // to cut a sequence down
constexpr unsigned kPatience = 1200;  // s for a sequence, beside whatever else runs: else it hangs

double number(const char* name, double otherwise) {
  const char* text = std::getenv(name);
  return text ? std::strtod(text, nullptr) : otherwise;
}

/// A crash or a hang names its sequence, with nothing but a system call.
std::atomic<std::uint64_t> running{0};  // free of locks: a signal may come at any time
char crash_line[64];
void say_seed(int signal) {
  const int size =
      std::snprintf(crash_line, sizeof crash_line, "signal %d in sequence %" PRIu64 "\n", signal, running.load());
  [[maybe_unused]] const auto n = ::write(STDERR_FILENO, crash_line, static_cast<std::size_t>(size));
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}
void watch_for_crashes() {
  for (const int s : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL, SIGALRM}) std::signal(s, say_seed);
}

std::optional<Violation> run(const Events& events, int ticks, Medium medium = Medium::udp) {
  DaemonRig rig(events, medium);
  return rig.run(ticks);
}

std::string kind_of(const std::string& what) {  // without its numbers
  std::string kind;
  for (const char c : what)
    if (!(c >= '0' && c <= '9')) kind += c;
  return kind;
}

/// The fewest events, by leaving out ever smaller pieces, that break the same promise.
Events least(Events events, Violation& violation) {
  int runs = 0;
  std::erase_if(events, [&](const Event& e) { return e.tick > violation.tick; });
  for (std::size_t piece = std::max<std::size_t>(1, events.size() / 2); runs < kMostRuns;) {
    bool shorter = false;
    for (std::size_t at = 0; at < events.size() && runs < kMostRuns;) {
      Events without = events;
      const auto from = without.begin() + static_cast<std::ptrdiff_t>(at);
      without.erase(from, from + static_cast<std::ptrdiff_t>(std::min(piece, without.size() - at)));
      ++runs;
      const auto broken = run(without, kTicks);
      if (!broken || kind_of(broken->what) != kind_of(violation.what)) {
        at += piece;
        continue;
      }
      events = std::move(without);
      violation = *broken;
      shorter = true;
    }
    if (piece > 1)
      piece = (piece + 1) / 2;
    else if (!shorter)
      break;
  }
  return events;
}

std::string told(std::uint64_t seed, Violation violation) {
  const auto first = violation;
  if (number("BACKWASH_FUZZ_SHORTEN", 1) == 0)
    return "sequence " + std::to_string(seed) + ", tick " + std::to_string(first.tick) + ": " + first.what;
  const Events events = least(sequence(seed, kTicks), violation);
  std::string text = "sequence " + std::to_string(seed) + ", tick " + std::to_string(first.tick) + ": " + first.what +
                     "; with these alone tick " + std::to_string(violation.tick) + ": " + violation.what + "\n";
  for (const Event& e : events) text += "  " + describe(e) + "\n";
  return text;
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

class SequenceFuzz : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    watch_for_crashes();
    spdlog::set_level(spdlog::level::off);
  }
  void TearDown() override {
    ::alarm(0);
    spdlog::set_level(spdlog::level::info);
  }

  void fuzz(double ticks, std::uint64_t first, Medium medium) {
    const double begun = cpu_seconds();
    const int most = static_cast<int>(number("BACKWASH_FUZZ_VIOLATIONS", 1));
    std::array<long, kModes> spent{};
    long done = 0, sequences = 0, plans = 0, replays = 0;
    int violations = 0;
    for (std::uint64_t seed = first; static_cast<double>(done) < ticks; ++seed, ++sequences) {
      running = seed;
      ::alarm(kPatience);
      DaemonRig rig(sequence(seed, kTicks), medium);
      const auto violation = rig.run(kTicks);
      done += rig.ticks();
      plans += rig.plans();
      for (std::size_t m = 0; m < spent.size(); ++m) spent[m] += rig.spent()[m];
      if (violation) {
        ::alarm(kPatience * 10);
        ADD_FAILURE() << told(seed, *violation);
        if (++violations >= most) break;
      } else if (sequences % kReplayEvery == 0) {
        const auto differs = rig.replayed();
        EXPECT_FALSE(differs) << "sequence " << seed << ": " << *differs;
        ++replays;
      }
    }
    std::printf("%ld ticks in %ld sequences from %llu, %ld segments, %ld replays, %.1f s of processor time;", done,
                sequences, static_cast<unsigned long long>(first), plans, replays, cpu_seconds() - begun);
    for (std::size_t m = 0; m < spent.size(); ++m)
      std::printf(" %s %.0f %%", to_string(static_cast<Mode>(m)),
                  100.0 * static_cast<double>(spent[m]) / static_cast<double>(std::max(1L, done)));
    std::printf("\n");
  }
};

TEST_P(SequenceFuzz, BreaksNoPromise) {
  const auto seed = static_cast<std::uint64_t>(number("BACKWASH_FUZZ_SEED", 1));
  fuzz(number("BACKWASH_FUZZ_TICKS", 1e6) / kShards, seed + 1'000'000 * static_cast<std::uint64_t>(GetParam()),
       Medium::udp);
}
INSTANTIATE_TEST_SUITE_P(Shard, SequenceFuzz, testing::Range(0, kShards));

class SerialLine : public SequenceFuzz {};
TEST_P(SerialLine, BreaksNoPromiseEither) { fuzz(number("BACKWASH_FUZZ_TICKS", 1e6) / 50, 9'000'000, Medium::serial); }
INSTANTIATE_TEST_SUITE_P(Once, SerialLine, testing::Values(0));

}  // namespace
}  // namespace backwash::fuzz
