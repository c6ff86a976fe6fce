// SPDX-License-Identifier: BSD-3-Clause
// Row 44 of docs/faults.md: whatever becomes of the terminal, nobody who has something to say waits for it.
#include "services/backwashd/record/log_sink.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spdlog/logger.h>
#include <unistd.h>

#include <chrono>
#include <thread>
#include <utility>

namespace backwash::daemon {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// A pipe and a logger that writes into it.
struct Terminal {
  Terminal() {
    EXPECT_EQ(::pipe(ends), 0);
    ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
    sink = LogSink::start(ends[1]);
    logger = std::make_unique<spdlog::logger>("test", sink);
  }
  ~Terminal() {
    sink->close(0.5);
    for (const int end : ends) ::close(end);
  }
  /// Writes into the pipe until it takes no more.
  void stall() {
    ::fcntl(ends[1], F_SETFL, O_NONBLOCK);
    char full[4096] = {};
    while (::write(ends[1], full, sizeof full) > 0) {
    }
    ::fcntl(ends[1], F_SETFL, 0);
  }
  /// What has come within `most`, up to `wanted`.
  std::string read_until(const std::string& wanted, std::chrono::milliseconds most = 2000ms) {
    std::string text;
    const auto end = std::chrono::steady_clock::now() + most;
    while (std::chrono::steady_clock::now() < end && text.find(wanted) == text.npos) {
      char bytes[4096];
      const ssize_t n = ::read(ends[0], bytes, sizeof bytes);
      if (n > 0)
        text.append(bytes, static_cast<std::size_t>(n));
      else
        std::this_thread::sleep_for(1ms);
    }
    return text;
  }

  int ends[2];
  std::shared_ptr<LogSink> sink;
  std::unique_ptr<spdlog::logger> logger;
};

TEST(LogSink, WritesTimeLevelAndTextInOrder) {
  Terminal t;
  t.logger->info("first {}", 1);
  t.logger->error("second");
  const std::string said = t.read_until("second\n");
  EXPECT_THAT(said, testing::MatchesRegex("\\[....-..-.. ..:..:..\\.[0-9]+\\] \\[info\\] first 1\n.*"));
  EXPECT_THAT(said, HasSubstr("] [error] second\n"));
}

TEST(LogSink, AJournalGetsTheLevelAsItsPriorityAndNoTime) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const auto sink = LogSink::start(ends[1], LogSink::Head::priority);
  spdlog::logger logger("test", sink);
  logger.critical("a");
  logger.error("b");
  logger.warn("c");
  logger.info("d");
  sink->close(2);
  char bytes[64] = {};
  EXPECT_EQ(::read(ends[0], bytes, sizeof bytes), 20);
  EXPECT_STREQ(bytes, "<2>a\n<3>b\n<4>c\n<6>d\n");
  for (const int end : ends) ::close(end);
}

TEST(LogSink, AStalledTerminalDelaysNobodyAndTheLossIsSaidWhenItIsReadAgain) {
  Terminal t;
  t.stall();
  std::thread speaker([&] {
    for (int n = 0; n < 20'000; ++n)
      t.logger->warn(std::string(1, static_cast<char>('a' + n % 26)) +
                     std::string(1, static_cast<char>('a' + n / 26 % 4)) + " of many causes");
  });
  speaker.join();  // would never end
  EXPECT_GT(t.sink->lost(), 0u);
  const std::string said = t.read_until("lines were lost");
  EXPECT_THAT(said, HasSubstr(" of many causes\n"));
  EXPECT_THAT(said, HasSubstr(std::to_string(t.sink->lost()) + " lines were lost"));
  t.logger->info("and on");
  EXPECT_THAT(t.read_until("and on"), HasSubstr("[info] and on"));
}

TEST(LogSink, AStalledTerminalDoesNotKeepTheProcessFromEnding) {
  Terminal t;
  t.stall();
  t.logger->info("never read");
  const auto before = std::chrono::steady_clock::now();
  t.sink->close(0.1);
  EXPECT_LT(std::chrono::steady_clock::now() - before, 5s);
}

TEST(LogSink, APipeThatNobodyReadsAnyMoreCostsItsLines) {
  const auto before = ::signal(SIGPIPE, SIG_IGN);  // as the daemon does
  {
    Terminal t;
    ::close(std::exchange(t.ends[0], -1));
    t.logger->info("into nothing");
    for (int n = 0; n < 2000 && t.sink->lost() == 0; ++n) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(t.sink->lost(), 1u);
  }
  ::signal(SIGPIPE, before);
}

TEST(LogSink, OneCauseCannotCrowdOutTheOthersAndWhatWasHeldBackIsTold) {
  Terminal t;
  for (int n = 0; n < 1000; ++n) t.logger->warn("refused: cloud of {} points from '{}'", n, std::string(5, 'x'));
  t.logger->info("quiet: the pilot took over");
  const std::string said = t.read_until("took over\n");
  EXPECT_THAT(said, HasSubstr("quiet: the pilot took over"));
  std::size_t lines = 0;
  for (std::size_t at = 0; (at = said.find("refused: cloud", at)) != said.npos; ++at) ++lines;
  EXPECT_GE(lines, LogSink::kBurst);
  EXPECT_LE(lines, LogSink::kBurst + 5);  // a slow machine pays for a few more
  EXPECT_EQ(t.sink->lost(), 0u);
  std::this_thread::sleep_for(1500ms / LogSink::kPerSecond);
  t.logger->warn("refused: cloud of {} points", 7);
  EXPECT_THAT(t.read_until("kind)"),
              testing::ContainsRegex("refused: cloud of 7 points \\(and 9[0-9][0-9] more of this kind\\)"));
}

TEST(LogSink, ForeignTextNeitherForgesLinesNorSteersTheTerminalNorGoesOnForEver) {
  Terminal t;
  t.logger->info("station '{}'",
                 "x\n[2026-01-01] [info] forged\x1b[2J\x7f\xc2\x9b"
                 "end");
  t.logger->info("long {}", std::string(10'000, 'y'));
  const std::string said = t.read_until("...\n");
  EXPECT_THAT(said, HasSubstr("station 'x\\x0a[2026-01-01] [info] forged\\x1b[2J\\x7f\\xc2\\x9bend'\n"));
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 2);
  EXPECT_LT(said.size(), 2 * (LogSink::kLongest + 64));
}

TEST(LogSink, TheFlagsOfTheTerminalThatOthersShareStayAsTheyWere) {
  Terminal t;
  t.logger->info("x");
  t.read_until("x\n");
  EXPECT_EQ(::fcntl(t.ends[1], F_GETFL) & O_NONBLOCK, 0);
}

}  // namespace
}  // namespace backwash::daemon
