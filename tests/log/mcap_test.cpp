// SPDX-License-Identifier: BSD-3-Clause
// A raw log within an MCAP file: the same records again, or a word of what is wrong and where. Other people's readers
// of the same files: tests/system/mcap_peer.sh.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

#include "core/log/mcap/mcap_flight.hpp"
#include "core/log/mcap/mcap_walk.hpp"
#include "core/log/mcap/mcap_writer.hpp"
#include "core/log/mcap/ros_schemas.hpp"
#include "core/log/raw/raw_flight.hpp"
#include "core/log/raw/raw_log.hpp"

namespace backwash::log {
namespace {

/// Puts what is written into `content`, as a file system does; a `full` one puts nothing at the end.
McapSink into(std::string& content, const bool* full = nullptr) {
  return [&content, full](std::uint64_t at, std::span<const std::uint8_t> bytes) {
    EXPECT_TRUE(at == content.size() || at + bytes.size() <= content.size());
    if (at == content.size() && full && *full) return false;
    content.replace(at, bytes.size(), reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return true;
  };
}

class McapFile : public testing::Test {
 protected:
  void SetUp() override {
    path_ = testing::TempDir() + "mcap_" + std::to_string(::getpid());
    put(RecordKind::part, PartRecord{1, 1'000'000'000'000, 1, 0});
    for (int n = 0; n < 9000; ++n) {
      t_ns_ += 1'000'000;
      OdometryRecord odometry{t_ns_, {1.0 * n, 2, 3}, {}, {1, 0, 0, 0}};
      if (n % 10 == 0) put(RecordKind::odometry, odometry);
      std::vector<std::uint8_t> frame(random_() % 281);
      for (auto& byte : frame) byte = static_cast<std::uint8_t>(random_());
      log_.records.push_back({{t_ns_, RecordKind::frame_in, static_cast<std::uint32_t>(frame.size())}, frame});
    }
    std::ostringstream out;
    export_mcap(out, log_, "test");
    whole_ = out.str();
    ASSERT_GT(whole_.size(), std::size_t{2} << 20) << "several chunks";
  }
  void TearDown() override { ::unlink(path_.c_str()); }

  template <typename T>
  void put(RecordKind kind, const T& record) {
    std::vector<std::uint8_t> bytes(sizeof record);
    std::memcpy(bytes.data(), &record, sizeof record);
    log_.records.push_back({{t_ns_, kind, sizeof record}, std::move(bytes)});
  }
  tl::expected<RawLog, LogError> read(const std::string& content) const {
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << content;
    return read_raw_log(path_);
  }
  /// Whether the log's first records are those that were written; all of them, if not `less`.
  void expect_those_written(const RawLog& read, const std::string& content, bool less) const {
    ASSERT_TRUE(less ? read.records.size() <= log_.records.size() : read.records.size() == log_.records.size());
    for (std::size_t n = 0; n < read.records.size(); ++n) {
      const auto &got = read.records[n], &wanted = log_.records[n];
      ASSERT_TRUE(std::memcmp(&got.header, &wanted.header, sizeof got.header) == 0 && got.bytes == wanted.bytes) << n;
      ASSERT_EQ(std::memcmp(content.data() + got.offset, &wanted.header, sizeof wanted.header), 0) << "its offset";
    }
  }

  std::mt19937 random_{20261125};
  std::int64_t t_ns_ = 5'000'000'000;
  std::string path_, whole_;
  RawLog log_;
};

// Each part of a schema begins with a type that a message before it names, and it is the same text each time.
TEST(RosSchema, NamesEachTypeThatItsMembersNeed) {
  for (const auto* type : {"nav_msgs/Odometry", "nav_msgs/Path", "visualization_msgs/MarkerArray", "tf2_msgs/TFMessage",
                           "foxglove_msgs/SceneUpdate"}) {
    const std::string text = ros_schema(type), line = std::string(80, '=') + "\nMSG: ";
    EXPECT_EQ(text, ros_schema(type));
    EXPECT_TRUE(std::ranges::all_of(text, [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); })) << type;
    std::size_t parts = 0;
    for (auto at = text.find(line); at != text.npos; at = text.find(line, at + 1), ++parts) {
      const std::string name = text.substr(at + line.size(), text.find('\n', at + line.size()) - at - line.size());
      EXPECT_NE(text.substr(0, at).find(name), text.npos) << type << " needs no " << name;
    }
    EXPECT_GT(parts, 3u) << type;
  }
}

TEST_F(McapFile, HoldsTheRawLogByteForByte) {
  const auto log = read(whole_);
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_FALSE(log->cut_at);
  expect_those_written(*log, whole_, false);
  EXPECT_TRUE(is_raw_log(path_));
}

TEST_F(McapFile, CutAnywhereGivesEachRecordThatIsWholeAndSaysWhereItEnds) {
  const auto all = read(whole_).value();
  std::size_t some = 0;
  for (int n = 0; n < 200; ++n) {
    const std::size_t cut = random_() % whole_.size();
    const std::string content = whole_.substr(0, cut);
    const auto log = read(content);
    if (!log) {
      EXPECT_EQ(log.error().kind, LogError::Kind::bad_data);
      EXPECT_EQ(log.error().message.find(path_ + ": byte "), 0u) << log.error().message;
      continue;
    }
    const auto whole = static_cast<std::size_t>(std::ranges::count_if(
        all.records, [cut](const auto& r) { return r.offset + sizeof r.header + r.bytes.size() <= cut; }));
    EXPECT_EQ(log->records.size(), whole) << cut;
    if (log->cut_at) {
      EXPECT_LT(*log->cut_at, cut);
    }
    expect_those_written(*log, content, true);
    some += !log->records.empty();
  }
  EXPECT_GT(some, 190u);
}

TEST_F(McapFile, HoldsEachBatchOnceItIsWrittenAndNothingOfOneThatWasNot) {
  std::string content;
  bool full = false;
  const McapSink sink = into(content, &full);
  McapFlight flight("test");
  RawLog written;
  for (std::size_t n = 0; n < log_.records.size();) {
    const std::size_t from = n;
    do flight.take(log_.records[n]);
    while (++n < log_.records.size() && n % 100 != 0);
    full = from != 0 && random_() % 4 == 0;
    ASSERT_EQ(flight.writer().flush(sink), !full);
    if (full)
      flight.writer().drop();
    else
      std::copy_n(log_.records.begin() + static_cast<std::ptrdiff_t>(from), n - from,
                  std::back_inserter(written.records));
    if (from % 900 != 0) continue;
    const auto log = read(content);
    ASSERT_TRUE(log) << log.error().message;
    EXPECT_FALSE(log->cut_at);
    ASSERT_EQ(log->records.size(), written.records.size());
  }
  full = true;
  EXPECT_FALSE(flight.finish(sink));
  full = false;
  EXPECT_TRUE(flight.finish(sink));
  std::swap(log_, written);
  ASSERT_LT(log_.records.size(), written.records.size());
  const auto log = read(content);
  ASSERT_TRUE(log) << log.error().message;  // its checksums fit
  expect_those_written(*log, content, false);
}

TEST_F(McapFile, SaysTheModeAgainAfterWhatWasLostAndDrawsNoMoreMapsThanItShall) {
  std::string content;
  McapFlight flight("test", {.largest = 24, .between_ns = 10'000'000'000});
  const auto counts = [&] {
    EXPECT_TRUE(flight.writer().flush(into(content)));
    const auto messages = flight.messages();
    return std::pair(messages.at("/backwash/mode"), messages.at("/backwash/voxels"));
  };
  const auto take = [&](RecordKind kind, const auto& record, const std::string& more = {}) {
    put(kind, record);
    log_.records.back().bytes.insert(log_.records.back().bytes.end(), more.begin(), more.end());
    flight.take(log_.records.back());
  };
  const auto map = [&] {  // knows a free cube
    std::string tree("\x03\0", 2);
    for (int level = 0; level < 10; ++level) tree += std::string("\0\xc0", 2);
    take(RecordKind::map, MapRecord{0.1, 1, 1}, tree + std::string("\0\x40", 2));
  };
  take(RecordKind::tick, TickRecord{});
  take(RecordKind::tick, TickRecord{});
  map();
  map();
  EXPECT_EQ(counts(), std::pair(std::uint64_t{1}, std::uint64_t{1}));
  t_ns_ += 11'000'000'000;
  take(RecordKind::lost, LostRecord{3});
  EXPECT_EQ(counts(), std::pair(std::uint64_t{1}, std::uint64_t{2}));
  map();
  take(RecordKind::tick, TickRecord{});
  EXPECT_EQ(counts(), std::pair(std::uint64_t{2}, std::uint64_t{2}));
  take(RecordKind::map, MapRecord{0.1, 1, 1}, std::string(25, 'x'));
  EXPECT_TRUE(flight.finish(into(content)));
  EXPECT_EQ(flight.messages().at("/backwash/voxels"), 3u);
}

TEST_F(McapFile, WithABitTurnedIsReadWholeOrRefusedByItsByteAndNeverOtherwise) {
  std::size_t refused = 0;
  for (int n = 0; n < 400; ++n) {
    // Every other one near an end, where the records are that hold the others.
    const std::size_t near = random_() % 2000, at = n % 2 == 0   ? random_() % whole_.size()
                                                    : n % 4 == 1 ? near
                                                                 : whole_.size() - 1 - near;
    std::string content = whole_;
    content[at] = static_cast<char>(content[at] ^ (1 << random_() % 8));
    const auto log = read(content);
    if (!log) {
      EXPECT_EQ(log.error().kind, LogError::Kind::bad_data);
      EXPECT_EQ(log.error().message.find(path_ + ": byte "), 0u) << log.error().message;
      ++refused;
    } else {
      expect_those_written(*log, content, log->cut_at.has_value());
    }
  }
  EXPECT_GT(refused, 200u);
}

TEST_F(McapFile, OfOthersIsRefusedByName) {
  McapWriter writer("test");
  writer.write(writer.add_channel("/chatter", "std_msgs/msg/String", "string data\n"), {}, {});
  std::string content;
  EXPECT_TRUE(writer.finish(into(content)));
  const auto log = read(content);
  ASSERT_FALSE(log);
  EXPECT_NE(log.error().message.find("/backwash/raw_log"), std::string::npos) << log.error().message;
}

TEST_F(McapFile, ThatSomebodyCompressedIsRefusedByName) {
  // A chunk's times, size and checksum are 28 bytes; the length of its compression's name follows, here 0, then 8
  // bytes.
  std::size_t chunk = kMcapMagic.size();
  for (std::uint64_t length; whole_[chunk] != '\x06'; chunk += 9 + length)
    std::memcpy(&length, whole_.data() + chunk + 1, sizeof length);
  std::string content = whole_.substr(0, chunk + 9 + 28) + std::string("\x04\0\0\0zstd\0\0\0\0\0\0\0\0", 16);
  content[chunk + 1] = 28 + 16;
  std::memset(content.data() + chunk + 2, 0, 7);
  const auto log = read(content);
  ASSERT_FALSE(log);
  EXPECT_NE(log.error().message.find("is compressed"), std::string::npos) << log.error().message;
}

/// A recording without chunks and checksums, as some recorders write it: `count` messages of 40 bytes that count up.
std::string without_chunks(int count) {
  std::string file(kMcapMagic.begin(), kMcapMagic.end());
  const auto number = [](auto value) { return std::string(reinterpret_cast<const char*>(&value), sizeof value); };
  const auto text = [&](const std::string& s) { return number(static_cast<std::uint32_t>(s.size())) + s; };
  const auto put = [&](char op, const std::string& body) { file += op + number(std::uint64_t{body.size()}) + body; };
  put(1, text("ros2") + text("a test"));
  put(3, number(std::uint16_t{1}) + text("a/b") + text("") + text(""));
  put(4, number(std::uint16_t{1}) + number(std::uint16_t{1}) + text("/a") + text("cdr") + text(""));
  for (std::uint64_t k = 0; k < static_cast<std::uint64_t>(count); ++k) {
    std::string body = number(std::uint16_t{1}) + number(std::uint32_t{0}) + number(k) + number(k);
    for (int i = 0; i < 5; ++i) body += number(0x0101010101010101 * (k + 1));
    put(5, body);
  }
  put(15, number(std::uint32_t{0}));
  put(11, number(static_cast<std::uint64_t>(count)) + std::string(38, '\0'));
  put(2, std::string(20, '\0'));
  return file + std::string(kMcapMagic.begin(), kMcapMagic.end());
}

/// What of a file is read over its damage: the messages, and what is told.
std::pair<std::vector<std::string>, McapEnd> over_damage(const std::string& file) {
  std::vector<std::string> messages;
  McapListener listener;
  listener.message = [&](const McapChannel&, std::string_view data, std::uint64_t) {
    messages.emplace_back(data);
    return std::string();
  };
  listener.over_damage = true;
  auto end = walk_mcap(file, listener);
  return {messages, end};
}

TEST_F(McapFile, DamagedAnywhereGivesWhatIsLeftAndTellsTheShareLost) {
  std::mt19937 random(53);
  for (const auto& [name, whole, least] : {std::tuple{"chunks", whole_, 0.2}, {"none", without_chunks(3000), 0.9}}) {
    const auto sound = over_damage(whole);
    ASSERT_EQ(sound.second.wrong, "");
    EXPECT_EQ(sound.second.loss(whole.size()), "");
    const std::set<std::string> written(sound.first.begin(), sound.first.end());
    for (int n = 0; n < 100; ++n) {
      std::string hurt = whole;
      const std::size_t at = 2000 + random() % (whole.size() - 6000), size = 1 + random() % 3000;
      // Other bytes in a message without a checksum nobody can tell.
      const int way = name == std::string("none") ? 0 : n % 4;
      if (way == 0) hurt.erase(at, size);
      if (way == 1) hurt.replace(at, size, size, '\0');
      if (way == 2) hurt.insert(at, std::string(size, 'x'));
      if (way == 3) hurt.resize(at);
      const auto [messages, end] = over_damage(hurt);
      EXPECT_EQ(end.wrong, "") << name << n;
      std::size_t others = 0;
      for (const auto& message : messages) others += written.contains(message) ? 0 : 1;
      EXPECT_EQ(others, 0u) << name << n;
      if (messages.size() < sound.first.size()) {
        EXPECT_TRUE(!end.loss(hurt.size()).empty() || !end.whole) << name << n << ": silent";
      }
      if (way < 3) {
        EXPECT_GE(static_cast<double>(messages.size()), least * static_cast<double>(sound.first.size())) << name << n;
      }
    }
  }
}

TEST_F(McapFile, MessagesHaveWallTimeAndTheirLogTimeNeverFalls) {
  log_.records.push_back({{1'000'000'000, RecordKind::frame_in, 0}, {}});  // of a thread that was drained late
  std::ostringstream out;
  export_mcap(out, log_, "test");
  const std::string content = out.str();
  // The last chunk's times are told by the statistics: 8 + 2 + 4 · 4 bytes behind their head.
  const std::size_t statistics = content.rfind(std::string("\x0B\xA6\0\0\0\0\0\0\0", 9));
  ASSERT_NE(statistics, content.npos);
  std::uint64_t times[2];
  std::memcpy(times, content.data() + statistics + 9 + 26, sizeof times);
  EXPECT_EQ(times[0], 1'005'000'000'000u);
  EXPECT_EQ(times[1], static_cast<std::uint64_t>(t_ns_ + 1'000'000'000'000));
}

}  // namespace
}  // namespace backwash::log
