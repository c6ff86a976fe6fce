// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/record/recorder.hpp"

namespace backwash::daemon {

/// A folder for a raw log, and the channels that records come by.
class RecordedFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "raw_logs_" + std::to_string(::getpid());
    std::filesystem::create_directory(folder_);
    path_ = folder_ + "/flight.bwlog";
    channels_ = std::make_unique<Channels>();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void put(int records) {
    ControlRecord r;
    r.header = {now_ns(), log::RecordKind::frame_out, 100};
    for (int n = 0; n < records; ++n) channels_->control_log.push_or_count(r);
  }

  std::string folder_, path_;
  std::unique_ptr<Channels> channels_;
};

}  // namespace backwash::daemon
