// SPDX-License-Identifier: BSD-3-Clause
// Rows 35 and 45 of docs/faults.md: a full disk, one that hangs and a log directory that is gone cost records, are
// told, and nothing else; what an earlier flight has recorded is never touched.
#include <gtest/gtest.h>

#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <thread>
#include <type_traits>

#include "core/log/raw/raw_log.hpp"
#include "core/log/raw/tick_log.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/control_loop.hpp"
#include "services/backwashd/in/dds_front.hpp"
#include "services/backwashd/record/recorder.hpp"
#include "tests/daemon/lockstep/traps.hpp"
#include "tests/daemon/out/recorded_folder.hpp"

namespace backwash::daemon {
namespace {

class RecorderFault : public RecordedFolder {
 protected:
  /// Number of records in the file beside the one that says which part it is, and what its last `lost` record says.
  std::pair<std::size_t, std::uint64_t> read() const {
    const auto log = log::read_raw_log(path_).value();
    EXPECT_FALSE(log.cut_at) << "a record was cut";
    std::uint64_t lost = 0;
    std::size_t parts = 0;
    for (const auto& r : log.records) {
      parts += r.header.kind == log::RecordKind::part;
      if (r.header.kind == log::RecordKind::lost) lost = log::payload<log::LostRecord>(r)->records;
    }
    return {log.records.size() - parts, lost};
  }
};

TEST_F(RecorderFault, AFullDiskLosesWholeBatchesAndTheLogSaysHowManyOnceItCanBeWrittenAgain) {
  Recorder recorder(path_);
  put(50);
  recorder.drain(*channels_);
  EXPECT_EQ(read(), std::pair(std::size_t{50}, std::uint64_t{0}));

  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{std::filesystem::file_size(path_) + 1400, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  put(50);  // room for eight of them
  recorder.drain(*channels_);
  put(7);
  recorder.drain(*channels_);
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(recorder.lost(), 50u);  // the seven went in: the batch fitted
  put(3);
  recorder.drain(*channels_);
  EXPECT_EQ(recorder.lost(), 50u);
  EXPECT_EQ(read(), std::pair(std::size_t{50 + 1 + 7 + 3}, std::uint64_t{50}));
}

TEST_F(RecorderFault, ADirectoryThatIsGoneLosesRecordsUntilItIsBack) {
  Recorder recorder(path_);
  put(5);
  recorder.drain(*channels_);
  std::filesystem::remove_all(folder_);
  std::this_thread::sleep_for(std::chrono::milliseconds(510));  // the file is looked for twice a second
  for (int n = 0; n < 3; ++n) {
    put(10);
    recorder.drain(*channels_);
  }
  EXPECT_EQ(recorder.lost(), 30u);
  std::filesystem::create_directory(folder_);
  std::this_thread::sleep_for(std::chrono::milliseconds(510));
  put(4);
  recorder.drain(*channels_);
  EXPECT_EQ(recorder.lost(), 30u);
  EXPECT_EQ(read(), std::pair(std::size_t{1 + 4}, std::uint64_t{30}));
}

TEST_F(RecorderFault, AFileThatCannotBeMadeAtStartIsAConfigurationErrorThatNamesIt) {
  try {
    Recorder recorder(folder_ + "/nowhere/flight.bwlog");
    FAIL() << "started without a log";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find(folder_ + "/nowhere/flight.bwlog"), std::string::npos);
  }
}

// A file system without room, not a limit of the process.
// systemd starts it again every few seconds.
TEST_F(RecorderFault, AStartOnAFullDiskLeavesNoEmptyLogs) {
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{0, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  for (int start = 0; start < 3; ++start) EXPECT_THROW(Recorder{path_}, std::runtime_error);
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(RecorderFault, ASmallDiskThatIsFullLosesRecordsUntilSomethingIsDeleted) {
  if (::unshare(CLONE_NEWNS) != 0 || ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=128k") != 0)
    GTEST_SKIP() << "right: a file system cannot be mounted here: " << std::strerror(errno);
  {
    Recorder recorder(path_);
    put(10);
    recorder.drain(*channels_);
    std::ofstream(folder_ + "/other") << std::string(200'000, 'x');  // takes all that is left
    for (int n = 0; n < 5; ++n) {
      put(1000);
      recorder.drain(*channels_);
    }
    EXPECT_EQ(recorder.lost(), 5000u);
    std::filesystem::remove(folder_ + "/other");
    put(20);
    recorder.drain(*channels_);
    EXPECT_EQ(recorder.lost(), 5000u);
    EXPECT_EQ(read(), std::pair(std::size_t{10 + 1 + 20}, std::uint64_t{5000}));
  }
  ::umount(folder_.c_str());
}

TEST_F(RecorderFault, ADiskThatHangsDelaysNobodyAndHoldsNoMoreThanItsShareOfMemory) {
  if (!backwash::test::traps_work()) GTEST_SKIP() << "sanitizer: it owns write()";
  constexpr std::size_t kMiB = 1u << 20;
  Recorder recorder(path_);
  std::atomic<bool> end{false};
  std::thread thread([&] { recorder.run(*channels_, end); });
  backwash::test::hang_disk(true);
  put(10);
  while (backwash::test::hanging_writes() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const std::vector<std::uint8_t> map(kMiB);
  for (int n = 0; n < 100; ++n) recorder.append(log::RecordKind::map, map);  // would wait for ever
  put(3000);                                                                 // the ring holds 2048
  EXPECT_GE(recorder.lost(), 100 - Recorder::kMostPending / kMiB);
  EXPECT_LE(recorder.lost(), 100 - Recorder::kMostPending / kMiB + 1);
  EXPECT_GE(channels_->control_log.lost(), 900u);
  backwash::test::hang_disk(false);
  end = true;
  thread.join();
  const auto lost = recorder.lost() + channels_->control_log.lost();
  const auto [records, told] = read();
  EXPECT_EQ(told, lost);
  EXPECT_EQ(records + lost, 10u + 100 + 3000 + 1);  // one says what was lost
}

TEST_F(RecorderFault, EachChangeOfTheModeIsPutOnTheDiskByTheRecordersThread) {
  if (!backwash::test::traps_work()) GTEST_SKIP() << "sanitizer: it owns fdatasync()";
  Recorder recorder(path_);
  const auto tick = [&](std::uint32_t mode) {
    log::TickRecord row{};
    row.mode = mode;
    ControlRecord r;
    r.header = {now_ns(), log::RecordKind::tick, sizeof row};
    std::memcpy(r.bytes.data(), &row, sizeof row);
    EXPECT_TRUE(channels_->control_log.push(r));
    recorder.drain(*channels_);
    return backwash::test::disk_syncs();
  };
  const int before = backwash::test::disk_syncs();
  EXPECT_EQ(tick(0), before);
  EXPECT_EQ(tick(2), before + 1);
  EXPECT_EQ(tick(2), before + 1);
  EXPECT_EQ(tick(5), before + 2);
}

std::string content(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_F(RecorderFault, EachStartMakesANewFileWithTheNextNumberAndTouchesNoOther) {
  for (const char* file : {"flight-7.bwlog", "flight-x.bwlog", "flight-07x.bwlog", "flighty-9.bwlog"})
    std::ofstream(folder_ + "/" + file) << file;
  EXPECT_EQ(Recorder(path_).path(), path_);
  std::ofstream(path_) << "an earlier flight";
  const Recorder eighth(path_), ninth(path_);
  EXPECT_EQ(eighth.path(), folder_ + "/flight-8.bwlog");
  EXPECT_EQ(ninth.path(), folder_ + "/flight-9.bwlog");
  EXPECT_EQ(content(path_), "an earlier flight");
  EXPECT_EQ(content(folder_ + "/flight-7.bwlog"), "flight-7.bwlog");
  const auto begun = log::read_raw_log(folder_ + "/flight-8.bwlog").value();
  ASSERT_EQ(begun.records.size(), 1u);
  EXPECT_EQ(log::payload<log::PartRecord>(begun.records[0])->part, 1u);
  struct stat status {};
  const mode_t mask = ::umask(0);
  const Recorder open_to_all(path_);
  ::umask(mask);
  ASSERT_EQ(::stat(open_to_all.path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640u);
}

TEST_F(RecorderFault, AStartThatFailsBeforeAnythingIsRecordedLeavesNoLogAndTouchesNoOther) {
  std::ofstream(path_) << "an earlier flight";
  { const Recorder failed(path_); }
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/flight-2.bwlog"));
  {
    const Recorder failed(path_);
    std::filesystem::remove(failed.path());
    std::ofstream(failed.path()) << "of somebody else";
  }
  EXPECT_EQ(content(folder_ + "/flight-2.bwlog"), "of somebody else");
  {
    Recorder recorder(path_);
    put(1);
    recorder.drain(*channels_);
  }
  EXPECT_EQ(log::read_raw_log(folder_ + "/flight-3.bwlog").value().records.size(), 2u);
  EXPECT_EQ(content(path_), "an earlier flight");
}

// A thread of ordinary priority may hold the recorder's lock: what the real-time threads run has no way to it.
static_assert(std::is_constructible_v<DdsFront, const config::Daemon&, int, const Vehicle&, Channels&>);
static_assert(!std::is_constructible_v<DdsFront, const config::Daemon&, int, const Vehicle&, Channels&, Recorder&>);
static_assert(!std::is_constructible_v<ControlLoop, Channels&, firmware_bridge::AutopilotLink&, const Vehicle&, double,
                                       const MapSettings&, Recorder&>);

TEST_F(RecorderFault, CommandsComeThroughARingAndWhatItHadNoRoomForIsCounted) {
  Recorder recorder(path_);
  ControlRecord r;
  r.header = {now_ns(), log::RecordKind::command, 10};
  std::size_t sent = 0;
  while (channels_->command_log.push(r)) ++sent;
  EXPECT_EQ(channels_->records_lost(), 1u);
  recorder.drain(*channels_);
  EXPECT_EQ(read(), std::pair(sent + 1, std::uint64_t{1}));
}

TEST_F(RecorderFault, ALinkInThePlaceOfTheLogIsNotFollowed) {
  std::ofstream(folder_ + "/other") << "of somebody else";
  std::filesystem::create_symlink(folder_ + "/other", path_);
  std::filesystem::create_symlink(folder_ + "/nowhere", folder_ + "/flight-2.bwlog");
  EXPECT_EQ(Recorder(path_).path(), folder_ + "/flight-3.bwlog");
  EXPECT_EQ(content(folder_ + "/other"), "of somebody else");
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/nowhere"));
}

TEST_F(RecorderFault, AFileThatWasReplacedInFlightIsLeftAndTheNextOneMade) {
  Recorder recorder(path_);
  put(5);
  recorder.drain(*channels_);
  std::filesystem::remove(path_);
  std::ofstream(path_) << "of somebody else";
  std::this_thread::sleep_for(std::chrono::milliseconds(510));
  put(4);
  recorder.drain(*channels_);
  EXPECT_EQ(content(path_), "of somebody else");
  EXPECT_EQ(recorder.path(), folder_ + "/flight-2.bwlog");
  EXPECT_EQ(log::read_raw_log(recorder.path()).value().records.size(), 1 + 4u);
}

// Rows 35 and 36 of docs/faults.md: what a kill, a power cut and a full disk leave of the raw log.

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
    // Schemas and channels are 12 kB: before them there is nothing to lose.
    while (!std::filesystem::exists(path_) || std::filesystem::file_size(path_) < 16'000) std::this_thread::yield();
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
