// SPDX-License-Identifier: BSD-3-Clause
#include "core/files/read_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

namespace backwash::files {
namespace {

using Kind = FileError::Kind;

class ReadFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "read_file_" + std::to_string(::getpid());
    std::filesystem::create_directory(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string folder_;
};

TEST_F(ReadFile, GivesEveryByteOfARegularFileAndOfALinkToOne) {
  const std::string path = folder_ + "/plain", text("a\0b\r\n\xff", 6);
  std::ofstream(path, std::ios::binary) << text;
  std::filesystem::create_symlink(path, folder_ + "/link");
  EXPECT_EQ(read_file(path, 6, "x"), text);
  EXPECT_EQ(read_file(folder_ + "/link", 6, "x"), text);
  std::ofstream(folder_ + "/empty");
  EXPECT_EQ(read_file(folder_ + "/empty", 0, "x"), "");
}

TEST_F(ReadFile, WaitsForNoFifoAndReadsNoDeviceNorDirectoryAndSaysWhatWouldBeRight) {
  const std::string fifo = folder_ + "/fifo";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  for (const auto& [path, what] : {std::pair{fifo, "is a FIFO; needs a map"},
                                   {std::string("/dev/zero"), "is a device; needs a map"},
                                   {folder_, "is a directory; needs a map"}}) {
    const auto read = read_file(path, 100, "a map");
    ASSERT_FALSE(read) << path;
    EXPECT_EQ(read.error().kind, Kind::not_regular);
    EXPECT_EQ(read.error().message, what);
  }
  const auto absent = read_file(folder_ + "/absent", 100, "a map");
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, Kind::not_found);
  EXPECT_EQ(absent.error().message, "cannot be read: No such file or directory; needs a map");
}

TEST_F(ReadFile, RefusesWhatIsLargerThanItsKindBeforeReadingIt) {
  const std::string path = folder_ + "/large";
  std::ofstream(path) << "x";
  std::filesystem::resize_file(path, std::uintmax_t{1} << 40);  // a hole: nothing could hold it
  const auto read = read_file(path, kLargestLog, "a raw log");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, Kind::too_large);
  EXPECT_EQ(read.error().message, "has 1048576 MiB, the cap is 8192 MiB; needs a raw log");
}

TEST_F(ReadFile, GivesEachLineOnceWhateverItsLengthAndHoldsNoOther) {
  const std::string path = folder_ + "/lines", longest(std::size_t{5} << 19, 'x');  // 2.5 MiB: read in three
  const std::vector<std::string> lines{"a", "", longest, std::string((1u << 20) - 1, 'y'), "b\r", "last"};
  for (const bool ended : {true, false}) {
    std::string text;
    for (const auto& line : lines) text += line + "\n";
    if (!ended) text.pop_back();
    std::ofstream(path, std::ios::binary) << text;
    std::vector<std::string> told;
    ASSERT_TRUE(each_line(path, text.size(), "x", [&](std::string_view line) { told.emplace_back(line); }));
    EXPECT_TRUE(told == lines) << told.size();
  }
  std::ofstream(path, std::ios::binary).flush();
  ASSERT_TRUE(each_line(path, 0, "x", [](std::string_view) { FAIL() << "of an empty file"; }));
  const auto none = [](std::string_view) { FAIL() << "of no file"; };
  EXPECT_EQ(each_line(folder_, 9, "rows", none).error().message, "is a directory; needs rows");
  EXPECT_EQ(each_line(folder_ + "/absent", 9, "rows", none).error().kind, Kind::not_found);
  std::ofstream(path) << "0123456789";
  EXPECT_EQ(each_line(path, 9, "rows", none).error().kind, Kind::too_large);
}

}  // namespace
}  // namespace backwash::files
