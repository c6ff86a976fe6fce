// SPDX-License-Identifier: BSD-3-Clause
// What a table beside the recordings says of them.
#include "core/log/columns/labels.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace backwash::log {
namespace {

class LabelsTest : public testing::Test {
 protected:
  std::string path_ = (std::filesystem::temp_directory_path() / ("labels-" + std::to_string(::getpid()) + ".csv"));
  tl::expected<Labels, LogError> read(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return read_labels(path_);
  }
  void refused(const std::string& text, const std::string& line, const std::string& what) {
    const auto labels = read(text);
    ASSERT_FALSE(labels) << text;
    EXPECT_TRUE(labels.error().message.starts_with(path_ + ":" + line + ": ")) << labels.error().message;
    EXPECT_NE(labels.error().message.find(what), std::string::npos) << labels.error().message;
  }
  void TearDown() override { std::filesystem::remove(path_); }
};

TEST_F(LabelsTest, ARowSaysOfItsRecordingWhatItsCellsHoldAndNothingWhereTheyAreEmpty) {
  const auto labels = read("\xef\xbb\xbfrecording,ceiling,cut_mm\r\n b ,1,\r\n\r\na,-1,2.5\r\n");
  ASSERT_TRUE(labels) << labels.error().message;
  const Labels expected{{"a", {{"ceiling", -1}, {"cut_mm", 2.5}}}, {"b", {{"ceiling", 1}}}};
  EXPECT_EQ(*labels, expected);
}

TEST_F(LabelsTest, WhatIsNoTableOfLabelsIsRefusedByFileAndLine) {
  refused("name,ceiling\na,1\n", "1", "name recording first");
  refused("recording\na\n", "1", "one label or more");
  refused("recording,ceiling\na,1\n\na,0\n", "4", "'a' has a row already");
  refused("recording,ceiling\na,1\n ,0\n", "3", "without a recording");
  refused("recording,ceiling\na,yes\n", "2", "column 'ceiling' holds 'yes'");
  refused("recording,ceiling\na,1,2\n", "2", "3 cells");
  refused("recording,ceiling,ceiling\na,1,2\n", "1", "named twice");
  EXPECT_EQ(read_labels(path_ + ".absent").error().kind, LogError::Kind::not_found);
}

TEST_F(LabelsTest, ARecordingIsKnownByItsNameWithoutFolderAndEndings) {
  EXPECT_EQ(recording_name("somewhere/e8_log00.csv"), "e8_log00");
  EXPECT_EQ(recording_name("B2_circle.csv.gz"), "B2_circle");
  EXPECT_EQ(recording_name("log_8.v2.ulg"), "log_8.v2");
}

TEST_F(LabelsTest, ALabelIsAColumnOfEveryRowAndTakesThePlaceOfNothingMeasured) {
  FlightLog log;
  log.t_s = {0, 0.01, 0.02};
  log.columns["z_m"] = {1, 2, 3};
  log.columns["ceiling"] = {-1, -1, -1};
  ASSERT_TRUE(add_labels(log, {{"ceiling", 1}, {"cut_mm", 2.5}}, "labels.csv"));
  EXPECT_EQ(log.column("ceiling"), std::vector<double>(3, 1));
  EXPECT_EQ(log.column("cut_mm"), std::vector<double>(3, 2.5));
  for (const char* measured : {"z_m", "t_s"}) {
    const auto added = add_labels(log, {{measured, 1}}, "labels.csv");
    ASSERT_FALSE(added) << measured;
    EXPECT_EQ(added.error().message.substr(0, 13), "labels.csv:1:");
  }
  EXPECT_EQ(log.column("z_m"), (std::vector<double>{1, 2, 3}));
}

}  // namespace
}  // namespace backwash::log
