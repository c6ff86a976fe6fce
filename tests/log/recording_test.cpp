// SPDX-License-Identifier: BSD-3-Clause
// A recording is known by its content, whatever it is called and whatever packed it.
#include "core/log/kinds/recording.hpp"

#include <gtest/gtest.h>

#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace {

using namespace backwash::log;
namespace fs = std::filesystem;

class Recording : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("recording_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string file(const std::string& name, const std::string& content) const {
    const auto path = (folder_ / name).string();
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
  fs::path folder_;
};

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string number(std::size_t value, std::size_t bytes) {
  std::string text;
  for (std::size_t k = 0; k < bytes; ++k) text += static_cast<char>(value >> (8 * k) & 0xff);
  return text;
}

std::string deflated(const std::string& content, int window) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, content.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

/// A ZIP archive as PKWARE's note has it; `stored`: without packing.
std::string zip(const std::vector<std::pair<std::string, std::string>>& files, bool stored = false) {
  std::string local, central;
  for (const auto& [name, content] : files) {
    const auto packed = stored ? content : deflated(content, -MAX_WBITS);
    const auto crc = crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size()));
    const auto head = number(0, 2) + number(stored ? 0 : 8, 2) + number(0, 4) + number(crc, 4) +
                      number(packed.size(), 4) + number(content.size(), 4) + number(name.size(), 2) + number(0, 2);
    central += "PK\x01\x02" + number(20, 2) + number(20, 2) + head + number(0, 10) + number(local.size(), 4) + name;
    local += "PK\x03\x04" + number(20, 2) + head + name + packed;
  }
  return local + central + "PK\x05\x06" + number(0, 4) + number(files.size(), 2) + number(files.size(), 2) +
         number(central.size(), 4) + number(local.size(), 4) + number(0, 2);
}

const std::string kDoor = BACKWASH_SOURCE_DIR "/tests/data/ardupilot/door.bin";
const std::string kUlog = BACKWASH_RECORDINGS "/ulog/log_8_2024-2-20-15-42-26.ulg";

TEST_F(Recording, IsTheSameFlightWhateverItIsCalledAndWhateverPackedIt) {
  for (const auto& whole : {kDoor, kUlog}) {
    const auto content = content_of(whole);
    const auto expected = read_recording(whole);
    ASSERT_TRUE(expected) << expected.error().message;
    const auto gzip = deflated(content, 16 + MAX_WBITS);
    for (const auto& path :
         {file("flight.ULG", content), file("flight.px4log", content), file("none", content), file("a.csv", content),
          file("a.ulg.gz", gzip), file("b.dat", gzip), file("c.zip", zip({{"log/", ""}, {"log/x", content}})),
          file("d.txt", zip({{"x.bin", content}}, true))}) {
      const auto log = read_recording(path);
      ASSERT_TRUE(log) << log.error().message;
      EXPECT_EQ(log->t_s, expected->t_s) << path;
      EXPECT_EQ(log->columns, expected->columns) << path;
    }
  }
}

TEST_F(Recording, OfAnArchiveThatIsDamagedOrHoldsSeveralIsRefused) {
  const auto content = content_of(kDoor), whole = zip({{"x", content}});
  const auto why = [&](const std::string& bytes) { return read_recording(file("x.zip", bytes)).error().message; };
  EXPECT_NE(why(zip({{"x", content}, {"y", content}})).find("holds 2 files"), std::string::npos);
  EXPECT_NE(why(whole.substr(0, whole.size() / 2)).find("is cut short"), std::string::npos);
  for (std::size_t at = 40; at + 100 < whole.size(); at += whole.size() / 97) {
    auto hurt = whole;
    hurt[at] = static_cast<char>(hurt[at] ^ 0x55);
    EXPECT_NE(why(hurt).find("is damaged"), std::string::npos) << at;
  }
}

TEST_F(Recording, IsNamedByItsContent) {
  using std::string_literals::operator""s;
  const std::string frame = "\x00\x05\xe0\x00\x00\x00\x00\x00"s + "\xfe\x02\x00\x01\x01\x00"s + "abcc";
  const std::pair<std::string, std::string> kinds[] = {
      {content_of(kDoor), "ardupilot"},
      {"some bytes before" + content_of(kDoor), "ardupilot"},
      {content_of(kUlog), "ulog"},
      {"\x89MCAP0\r\n and more", "mcap"},
      {"backwash raw log 3\n", "mcap"},
      {"t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n", "airgarage"},
      {"\"t\", \"x\", \"y\", \"z\", \"qx\", \"qy\", \"qz\", \"qw\"\r\n", "airgarage"},
      {"t_s,x_m,y_m,z_m,ax_g,battery_mV\n", "crazypad"},
      {"t_s,x_m,y_m,z_m\n0,0,0,1\n", "flight-log"}};
  for (const auto& [content, name] : kinds) {
    const auto kind = recording_of(file("x", content));
    ASSERT_TRUE(kind) << kind.error().message;
    EXPECT_EQ((*kind)->name, name) << (*kind)->words;
  }
  const std::pair<std::string, std::string> unread[] = {
      {"SQLite format 3\0.."s, "ros2 bag play"},
      {"#ROSBAG V2.0\n..", "rostopic echo -b"},
      {frame + frame, "mavlogdump.py"},
      {"H Product:Blackbox flight data recorder\n", "blackbox_decode"},
      {"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"},
      {"/annex/objects/SHA256-s1--0.ulg\n", "git annex get"},
      {"MATLAB 5.0 MAT-file\0\1"s, "matlab -batch"},
      {"<!DOCTYPE html><html>", "download"},
      {"\xfd"
       "7zXZ\0....."s,
       "xz -dk"},
      {"ply\nformat ascii 1.0\n", "map convert"},
      {"# of a modeller\rv 0 0 0\rv 1 0 0\r", "map convert"},
      {"SOLID room\nFACET", "map convert"},
      {"{\"asset\": {}}", "map convert"},
      {"time,px,py,pz\n0,1,2,3\n", "import --propose"}};
  for (const auto& [content, way] : unread) {
    const auto path = file("flight.ulg", content);
    const auto log = read_recording(path);
    ASSERT_FALSE(log) << way;
    EXPECT_EQ(log.error().kind, LogError::Kind::bad_data);
    EXPECT_NE(log.error().message.find(way), std::string::npos) << log.error().message;
    EXPECT_TRUE(log.error().message.starts_with(path + ":1: is ")) << log.error().message;
  }
}

TEST_F(Recording, ThatIsNoneIsRefused) {
  EXPECT_EQ(read_recording("/nowhere.ulg").error().kind, LogError::Kind::not_found);
  EXPECT_EQ(read_recording(folder_.string()).error().kind, LogError::Kind::not_found);
  for (const auto& content : {std::string(300, '\1'), std::string()}) {
    const auto log = read_recording(file("x.bin", content));
    ASSERT_FALSE(log);
    EXPECT_NE(log.error().message.find("no recording that is known"), std::string::npos) << log.error().message;
  }
}

}  // namespace
