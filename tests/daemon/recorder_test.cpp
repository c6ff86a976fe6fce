// SPDX-License-Identifier: BSD-3-Clause
// Row 35 of faults.md: a full disk and a log directory that is gone cost records, are told, and nothing else.
#include "services/backwashd/recorder.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <filesystem>
#include <thread>

#include "core/study/raw_log.hpp"

namespace backwash::daemon {
namespace {

class Row35Recorder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "recorder_" + std::to_string(::getpid());
    std::filesystem::create_directory(folder_);
    path_ = folder_ + "/flight.bwlog";
    channels_ = std::make_unique<Channels>();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void put(int records) {
    ControlRecord r;
    r.header = {now_ns(), study::RecordKind::frame_out, 100};
    for (int n = 0; n < records; ++n) channels_->control_log.push(r);
  }
  /// Number of records in the file, and what its last `lost` record says.
  std::pair<std::size_t, std::uint64_t> read() const {
    const auto log = study::read_raw_log(path_).value();
    EXPECT_FALSE(log.cut_at) << "a record was cut";
    std::uint64_t lost = 0;
    for (const auto& r : log.records)
      if (r.header.kind == study::RecordKind::lost) lost = study::payload<study::LostRecord>(r)->records;
    return {log.records.size(), lost};
  }

  std::string folder_, path_;
  std::unique_ptr<Channels> channels_;
};

TEST_F(Row35Recorder, AFullDiskLosesWholeBatchesAndTheLogSaysHowManyOnceItCanBeWrittenAgain) {
  Recorder recorder(path_);
  put(50);
  recorder.drain(*channels_);
  EXPECT_EQ(read(), std::pair(std::size_t{50}, std::uint64_t{0}));

  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{std::filesystem::file_size(path_) + 1000, before.rlim_max};
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

TEST_F(Row35Recorder, ADirectoryThatIsGoneLosesRecordsUntilItIsBack) {
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

TEST_F(Row35Recorder, AFileThatCannotBeMadeAtStartIsAConfigurationErrorThatNamesIt) {
  try {
    Recorder recorder(folder_ + "/nowhere/flight.bwlog");
    FAIL() << "started without a log";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find(folder_ + "/nowhere/flight.bwlog"), std::string::npos);
  }
}

}  // namespace
}  // namespace backwash::daemon
