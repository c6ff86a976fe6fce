// SPDX-License-Identifier: BSD-3-Clause
// Rows 35 and 45 of docs/faults.md: a full disk, one that hangs and a log directory that is gone cost records, are
// told, and nothing else; what an earlier flight has recorded is never touched.
#include "services/backwashd/record/recorder.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <thread>
#include <type_traits>

#include "core/log/raw/raw_log.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/control_loop.hpp"
#include "services/backwashd/in/dds_front.hpp"
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

}  // namespace
}  // namespace backwash::daemon
