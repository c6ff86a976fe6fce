// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <string_view>
#include <vector>

#include "core/files/read_file.hpp"

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

std::string zipped(const std::string& plain) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, plain.size()) + 64, '\0');
  std::string in = plain;
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string noise(std::size_t bytes) {
  std::mt19937_64 random(5);
  std::string text(bytes, '\0');
  for (char& c : text) c = static_cast<char>(random() & 0xff);
  return text;
}

TEST(Unzipped, GivesBackWhatWasPackedAndLeavesTheRestAsItIs) {
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{5}, std::size_t{3} << 20}) {
    const std::string text = noise(bytes);
    EXPECT_EQ(unzipped(zipped(text), 4u << 20), text) << bytes;
  }
  EXPECT_EQ(unzipped("t_s,x_m\n", 100), "t_s,x_m\n");
  EXPECT_EQ(unzipped("", 100), "");
  EXPECT_EQ(unzipped(zipped("one\n") + zipped("two\n"), 100), "one\ntwo\n") << "gzip files may follow one another";
}

TEST(Unzipped, HoldsNoMoreThanTheCapOfABomb) {
  const auto bomb = unzipped(zipped(std::string(std::size_t{64} << 20, '0')), std::size_t{8} << 20);
  ASSERT_FALSE(bomb);
  EXPECT_NE(bomb.error().find("unpacks to more than the cap of 8 MiB"), std::string::npos);
}

TEST(Unzipped, SaysWhatIsCutShortOrDamaged) {
  const std::string whole = zipped(noise(100'000));
  for (const std::size_t left : {std::size_t{2}, std::size_t{10}, whole.size() / 2, whole.size() - 1}) {
    const auto cut = unzipped(whole.substr(0, left), 1u << 20);
    ASSERT_FALSE(cut) << left;
    EXPECT_NE(cut.error().find("cut short"), std::string::npos) << cut.error();
  }
  for (std::size_t at = 10; at < whole.size(); at += 997) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    EXPECT_FALSE(unzipped(damaged, 1u << 20)) << at;
  }
}

}  // namespace
}  // namespace backwash::files
