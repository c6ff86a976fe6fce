// SPDX-License-Identifier: BSD-3-Clause
// Rows 35 and 36 of docs/faults.md: what a kill, a power cut and a full disk leave of the raw log.
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "core/log/raw_log.hpp"
#include "services/backwashd/recorder.hpp"
#include "tests/daemon/recorded_folder.hpp"
#include "tests/daemon/traps.hpp"

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
  if (!backwash::test::traps_work()) GTEST_SKIP() << "this build's sanitizer owns fdatasync()";
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

TEST_F(WrittenLog, ADiskKeepsATwentiethForOthers) {
  if (::unshare(CLONE_NEWNS) != 0 || ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=4m") != 0)
    GTEST_SKIP() << "a file system cannot be mounted here: " << std::strerror(errno);
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
