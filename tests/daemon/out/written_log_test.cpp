// SPDX-License-Identifier: BSD-3-Clause
// Rows 35 and 36 of docs/faults.md: what a kill, a power cut and a full disk leave of the raw log.
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <thread>

#include "core/log/raw/raw_log.hpp"
#include "core/log/raw/tick_log.hpp"
#include "services/backwashd/record/recorder.hpp"
#include "tests/daemon/lockstep/traps.hpp"
#include "tests/daemon/out/recorded_folder.hpp"

namespace backwash::daemon {
namespace {

class WrittenLog : public RecordedFolder {
 protected:
  std::string content() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

TEST_F(WrittenLog, WhatIsRecordedIsOnTheDiskASecondLaterInWhateverMode) {
  if (!backwash::test::traps_work()) GTEST_SKIP() << "sanitizer: it owns fdatasync()";
  Recorder recorder(path_);
  put(1);
  recorder.drain(*channels_);
  for (int second = 0; second < 2; ++second) {
    const int before = backwash::test::disk_syncs();
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
    put(1);
    recorder.drain(*channels_);
    EXPECT_EQ(backwash::test::disk_syncs(), before + 1);
  }
}

TEST_F(WrittenLog, OneThatIsEndedHasItsIndexAndOneThatIsNotIsReadWithoutIt) {
  const std::string magic(log::kMcapMagic.begin(), log::kMcapMagic.end());
  Recorder recorder(path_);
  put(5);
  recorder.drain(*channels_);
  EXPECT_TRUE(content().starts_with(magic));
  EXPECT_FALSE(content().ends_with(magic));
  EXPECT_EQ(log::read_raw_log(path_).value().records.size(), 1 + 5u);
  put(2);
  recorder.run(*channels_, true);
  EXPECT_TRUE(content().ends_with(magic));
  const auto log = log::read_raw_log(path_).value();
  EXPECT_EQ(log.records.size(), 1 + 7u);
  EXPECT_FALSE(log.cut_at);
}

TEST_F(WrittenLog, ADiskKeepsATwentiethForOthers) {
  if (::unshare(CLONE_NEWNS) != 0 || ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=4m") != 0)
    GTEST_SKIP() << "right: a file system cannot be mounted here: " << std::strerror(errno);
  {
    Recorder recorder(path_);
    const std::vector<std::uint8_t> bytes(50'000);
    for (int n = 0; n < 200; ++n) {
      recorder.append(log::RecordKind::map, bytes);
      recorder.drain(*channels_);
    }
    const auto space = std::filesystem::space(folder_);
    EXPECT_GE(space.available, space.capacity / 20);
    EXPECT_LE(space.available, space.capacity / 20 + 2 * bytes.size());
    EXPECT_GT(recorder.lost(), 100u);
  }
  ::umount(folder_.c_str());
}

/// A daemon that flew so many times, a log of its small parts, and the ticks that it recorded.
class LogInParts : public WrittenLog {
 protected:
  static constexpr std::uint64_t kPart = 20'000;  // bytes
  void say(log::RecordKind kind, const void* bytes, std::size_t size) {
    ControlRecord r;
    r.header = {now_ns(), kind, static_cast<std::uint32_t>(size)};
    std::memcpy(r.bytes.data(), bytes, size);
    EXPECT_TRUE(channels_->control_log.push(r));
  }
  void tick(Recorder& recorder, Mode mode) {
    log::TickInputRecord input{};
    log::TickRecord row{};
    row.tick = ticks_++;
    row.mode = static_cast<std::uint32_t>(mode);
    say(log::RecordKind::tick_input, &input, sizeof input);
    say(log::RecordKind::tick, &row, sizeof row);
    recorder.drain(*channels_);
  }
  void fly(int flights) {
    Recorder recorder(path_, kPart);
    const log::ConstantsRecord constants{1, 2, 3, 4, 5};
    say(log::RecordKind::constants, &constants, sizeof constants);
    for (const std::uint32_t accepted : {1u, 0u}) {
      const log::MapRecord map{0.1, 1, accepted};
      std::vector<std::uint8_t> bytes(sizeof map + 1000);
      std::memcpy(bytes.data(), &map, sizeof map);
      recorder.append(log::RecordKind::map, bytes);
    }
    for (int flight = 0; flight < flights; ++flight) {
      for (int n = 0; n < 70; ++n) tick(recorder, Mode::tracking);  // more than a part
      for (int n = 0; n < 3; ++n) tick(recorder, Mode::passive);
    }
  }
  std::string part(int number) const {
    return number == 1 ? path_ : folder_ + "/flight-" + std::to_string(number) + ".bwlog";
  }
  static std::vector<std::uint64_t> ticks_of(const log::RawLog& log) {
    std::vector<std::uint64_t> ticks;
    for (const auto& r : log.records)
      if (r.header.kind == log::RecordKind::tick) ticks.push_back(log::payload<log::TickRecord>(r)->tick);
    return ticks;
  }
  static std::size_t count(const log::RawLog& log, log::RecordKind kind) {
    return static_cast<std::size_t>(
        std::ranges::count_if(log.records, [kind](const auto& r) { return r.header.kind == kind; }));
  }

  std::uint64_t ticks_ = 0;
};

TEST_F(LogInParts, EachPartEndsOnTheGroundAndBeginsWithConstantsAndTheAcceptedMap) {
  fly(3);
  ASSERT_TRUE(std::filesystem::exists(part(3)));
  EXPECT_FALSE(std::filesystem::exists(part(5)));
  for (int number = 1; number <= 3; ++number) {
    const auto log = log::read_raw_log(part(number)).value();
    const auto* said = log::payload<log::PartRecord>(log.records.front());
    EXPECT_EQ(said->part, static_cast<std::uint32_t>(number));
    EXPECT_EQ(said->repeated, number == 1 ? 0u : 2u);
    EXPECT_EQ(count(log, log::RecordKind::constants), 1u);
    EXPECT_EQ(count(log, log::RecordKind::map), number == 1 ? 2u : 1u);  // the refused one was said once
    const auto map = std::ranges::find(log.records, log::RecordKind::map, [](const auto& r) { return r.header.kind; });
    EXPECT_EQ(log::payload<log::MapRecord>(*map)->accepted, 1u);
    const auto& last = log.records.back();
    EXPECT_EQ(log::payload<log::TickRecord>(last)->mode, static_cast<std::uint32_t>(Mode::passive));
    EXPECT_EQ(ticks_of(log).size(), number == 1 ? 71u : 73u);  // the first passive tick ends it
  }
}

TEST_F(LogInParts, ReadTogetherAreTheWholeLogOnce) {
  fly(3);
  const auto whole = log::read_raw_logs(std::vector{part(1), part(2), part(3)}).value();
  std::vector<std::uint64_t> expected(ticks_of(whole).size());
  std::iota(expected.begin(), expected.end(), std::uint64_t{0});
  EXPECT_EQ(ticks_of(whole), expected);
  EXPECT_GE(expected.size(), 71u + 73 + 73);
  EXPECT_EQ(count(whole, log::RecordKind::constants), 1u);
  EXPECT_EQ(count(whole, log::RecordKind::map), 2u);
}

TEST_F(LogInParts, ThatDoNotFollowOneAnotherAreRefusedByName) {
  fly(3);
  const auto refused = [&](const std::vector<std::string>& paths) {
    const auto log = log::read_raw_logs(paths);
    return log ? std::string("taken") : log.error().message;
  };
  EXPECT_NE(refused({part(1), part(3)}).find(part(3) + ":1: is part 3; needs part 2"), std::string::npos)
      << refused({part(1), part(3)});
  EXPECT_NE(refused({part(2), part(1)}).find(part(1)), std::string::npos);
  {
    Recorder other(path_);
    put(1);
    other.drain(*channels_);
    EXPECT_NE(refused({part(1), other.path()}).find("of another log"), std::string::npos);
  }
  std::filesystem::resize_file(part(1), std::filesystem::file_size(part(1)) / 2);
  EXPECT_NE(refused({part(1), part(2)}).find("is cut short"), std::string::npos);
}

TEST_F(LogInParts, ReplayedWithoutTheirFirstAreRefusedByName) {
  fly(2);
  const auto replay = log::replay(log::read_raw_log(part(2)).value(), part(2));
  ASSERT_FALSE(replay);
  EXPECT_NE(replay.error().message.find(part(2) + ": begins with part 2"), std::string::npos) << replay.error().message;
}

TEST_F(LogInParts, OneInFlightIsNotLeftHoweverLargeItGrows) {
  Recorder recorder(path_, kPart);
  for (int n = 0; n < 200; ++n) tick(recorder, Mode::tracking);
  EXPECT_EQ(recorder.path(), path_);
  EXPECT_GT(std::filesystem::file_size(path_), static_cast<std::uintmax_t>(5 * kPart));
  tick(recorder, Mode::passive);
  EXPECT_EQ(recorder.path(), part(2));
}

// A process that is killed at any moment: what it had recorded a second before is there, and the log can be read.
TEST_F(WrittenLog, AKillAtAnyMomentCostsLessThanASecond) {
  std::mt19937 random(20261123);
  for (int kill = 0; kill < 200; ++kill) {
    std::filesystem::remove(path_);
    const pid_t child = ::fork();
    if (child == 0) {
      Recorder recorder(path_);
      for (;;) {
        put(3);
        recorder.drain(*channels_);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
    while (!std::filesystem::exists(path_) || std::filesystem::file_size(path_) < 500) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 10'000));
    ::kill(child, SIGKILL);
    const std::int64_t killed_ns = now_ns();
    ::waitpid(child, nullptr, 0);
    const auto log = log::read_raw_log(path_);
    ASSERT_TRUE(log) << log.error().message;
    ASSERT_FALSE(log->records.empty());
    EXPECT_LT(killed_ns - log->records.back().header.t_ns, 1'000'000'000);
    const auto before = content();
    const Recorder next(path_);
    EXPECT_EQ(content(), before);
  }
}

}  // namespace
}  // namespace backwash::daemon
