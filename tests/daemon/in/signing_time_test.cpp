// SPDX-License-Identifier: BSD-3-Clause
// The time of our signatures never goes back, whatever ends the daemon and whatever the wall clock says.
#include "services/backwashd/in/signing_time.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>
#include "services/backwashd/channels.hpp"

namespace backwash::daemon {
namespace {

using namespace std::chrono_literals;
using mavlink::kSigningSecond;
using mavlink::SigningTime;
using Wall = std::chrono::system_clock::time_point;

constexpr SigningTime kThen = 100 * 86'400 * kSigningSecond;               // 2015-04-11
constexpr Wall kWall{std::chrono::seconds(1'420'070'400 + 100 * 86'400)};  // date -d 2015-04-11Z +%s: 1428710400
static_assert(kWall.time_since_epoch() == std::chrono::seconds(1'428'710'400));

class SigningTimeTest : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_ = [] {
    std::string name = (std::filesystem::temp_directory_path() / "backwash_signing_XXXXXX").string();
    return std::filesystem::path(::mkdtemp(name.data()));
  }();
  SigningTime stored() const {
    SigningTime time = 0;
    std::ifstream(path_) >> time;
    return time;
  }
  std::string path_ = signing_time_path((folder_ / "flight.bwlog").string());
};

TEST_F(SigningTimeTest, BeginsAtTheWallClockInAPrivateFileBesideTheLog) {
  SigningTimeFile file(path_, kWall);
  EXPECT_EQ(file.start(), kThen);
  struct stat about {};
  ASSERT_EQ(::stat((folder_ / "mavlink_signing.time").c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 07777, 0600U);
}

TEST_F(SigningTimeTest, AClockThatWentBackOverACrashDoesNotTakeTheSignaturesAlong) {
  SigningTime last = 0;
  {
    SigningTimeFile file(path_, kWall);
    for (last = file.start(); last < kThen + 100 * kSigningSecond; last += kSigningSecond / 5)
      EXPECT_TRUE(file.keep(last));
  }  // ends as by kill -9: nothing is written at the end
  SigningTimeFile again(path_, kWall - 24h * 365);
  EXPECT_GT(again.start(), last);
  EXPECT_LE(again.start(), last + SigningTimeFile::kReserve);
}

TEST_F(SigningTimeTest, AtEachMomentTheFileHoldsATimeThatIsNotReached) {
  SigningTimeFile file(path_, kWall);
  for (SigningTime now = kThen; now < kThen + 60 * kSigningSecond; now += kSigningSecond / 10) {
    file.keep(now);
    ASSERT_GT(stored(), now);
  }
}

TEST_F(SigningTimeTest, AnEndInOrderIsGoneOnFrom) {
  {
    SigningTimeFile file(path_, kWall);
    file.close(kThen + 7);
  }
  EXPECT_EQ(SigningTimeFile(path_, Wall{}).start(), kThen + 7);
  EXPECT_EQ(SigningTimeFile(path_, kWall + 1h).start(), kThen + 3600 * kSigningSecond) << "and a later clock counts";
}

TEST_F(SigningTimeTest, AFileThatHoldsNoTimeIsWrittenAnew) {
  for (const char* bad : {"x", "12", "garbage garbage garbage", "999999999999999\n", "-00000000000001\n"}) {
    std::ofstream(path_) << bad;
    EXPECT_EQ(SigningTimeFile(path_, Wall{}).start(), 0U) << bad << " is no time, not even an early one";
    std::ofstream(path_) << bad;
    EXPECT_EQ(SigningTimeFile(path_, kWall).start(), kThen) << bad;
    EXPECT_EQ(stored(), kThen + SigningTimeFile::kReserve);
  }
}

TEST_F(SigningTimeTest, AStartWithoutAFileToWriteIsRefused) {
  EXPECT_THROW(SigningTimeFile((folder_ / "none" / "x").string(), kWall), std::runtime_error);
  std::filesystem::create_symlink(folder_ / "elsewhere", path_);
  EXPECT_THROW(SigningTimeFile(path_, kWall), std::runtime_error) << "no link is followed";
  EXPECT_THROW(SigningTimeFile("/dev/full", kWall), std::runtime_error) << "a disk without room keeps no time";
}

TEST_F(SigningTimeTest, IsKeptAheadWhileTheLinkSignsAndNotPutBackByAnEndBeforeTheFirstSignature) {
  const auto channels = std::make_unique<Channels>();
  std::atomic<bool> end{true};
  SigningTimeFile file(path_, kWall);
  run_signing_time(file, *channels, end);
  EXPECT_EQ(stored(), kThen + SigningTimeFile::kReserve) << "nothing was signed";

  end = false;
  std::thread keeper([&] { run_signing_time(file, *channels, end); });
  const SigningTime later = kThen + 1000 * kSigningSecond;
  channels->signing_time.store(later);
  for (int i = 0; i < 1000 && stored() <= later; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_GT(stored(), later) << "while it runs";
  channels->signing_time.store(later + 3);
  end = true;
  keeper.join();
  EXPECT_EQ(stored(), later + 3) << "an end in order gives the rest back";
}

}  // namespace
}  // namespace backwash::daemon
