// SPDX-License-Identifier: BSD-3-Clause
// Autopilots' logs with bytes lost, overwritten and added: what is read is what was left of them, and the rest is told.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <set>

#include "core/log/autopilot/dataflash.hpp"
#include "core/log/autopilot/ulog.hpp"

namespace {

using namespace backwash::log;

using Bytes = std::vector<std::uint8_t>;

/// A log and, by a walk of its own, where each message with a time lies in it.
struct Whole {
  Bytes bytes;
  std::vector<std::pair<std::size_t, std::size_t>> rows;  ///< first byte, one past the last
};

Bytes read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

template <typename T>
T at(const Bytes& bytes, std::size_t k) {
  T value;
  std::memcpy(&value, &bytes[k], sizeof value);
  return value;
}

Whole ulog_of(Bytes bytes) {
  Whole log{std::move(bytes), {}};
  for (std::size_t k = 16; k + 3 <= log.bytes.size();) {
    const std::size_t end = k + 3 + at<std::uint16_t>(log.bytes, k);
    if (log.bytes[k + 2] == 'D' && end <= log.bytes.size()) log.rows.emplace_back(k, end);
    k = end;
  }
  return log;
}

Whole dataflash_of(Bytes bytes) {
  Whole log{std::move(bytes), {}};
  std::size_t size[256] = {};
  size[0x80] = 89;
  bool timed[256] = {};
  for (std::size_t k = 0; k + 3 <= log.bytes.size();) {
    const auto type = log.bytes[k + 2];
    const std::size_t end = k + size[type];
    if (type == 0x80) {
      size[log.bytes[k + 3]] = log.bytes[k + 4];
      timed[log.bytes[k + 3]] = std::memcmp(&log.bytes[k + 25], "TimeUS", 6) == 0;
    }
    if (timed[type] && end <= log.bytes.size()) log.rows.emplace_back(k, end);
    k = end;
  }
  return log;
}

/// A small ULog: positions at 50 Hz, an attitude beside each, a line of text each second.
Whole small_ulog() {
  Bytes bytes{0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35, 0x01, 0, 0, 0, 0, 0, 0, 0, 0};
  const auto put = [&](char type, const Bytes& body) {
    bytes.push_back(static_cast<std::uint8_t>(body.size()));
    bytes.push_back(static_cast<std::uint8_t>(body.size() >> 8));
    bytes.push_back(static_cast<std::uint8_t>(type));
    bytes.insert(bytes.end(), body.begin(), body.end());
  };
  const auto text = [](std::string s) { return Bytes(s.begin(), s.end()); };
  const auto add = [](Bytes& to, auto value) {
    to.resize(to.size() + sizeof value);
    std::memcpy(&to[to.size() - sizeof value], &value, sizeof value);
  };
  put('F', text("vehicle_local_position:uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;"));
  put('F', text("vehicle_attitude:uint64_t timestamp;float[4] q;"));
  for (std::uint8_t id = 0; id < 2; ++id) {
    Bytes body{0, id, 0};
    for (const char c : std::string(id == 0 ? "vehicle_local_position" : "vehicle_attitude"))
      body.push_back(static_cast<std::uint8_t>(c));
    put('A', body);
  }
  for (int k = 0; k < 1500; ++k) {
    const auto t = static_cast<std::uint64_t>(5'000'000 + 20'000 * k);
    Bytes position{0, 0}, attitude{1, 0};
    add(position, t);
    for (int i = 0; i < 6; ++i) add(position, static_cast<float>(std::sin(0.02 * k + i)));
    add(attitude, t + 3000);
    for (int i = 0; i < 4; ++i) add(attitude, i == 0 ? 1.f : 0.f);
    put('D', position);
    put('D', attitude);
    if (k % 50 != 0) continue;
    Bytes line{'6'};
    add(line, t);
    for (const char c : std::string("all is well")) line.push_back(static_cast<std::uint8_t>(c));
    put('L', line);
  }
  return ulog_of(bytes);
}

std::size_t rows_of(const TopicLog& log) {
  std::size_t rows = 0;
  for (const auto& topic : log.topics) rows += topic.t_s.size();
  return rows;
}

enum class Damage { removed, zeros, noise, inserted, cut, twice };

struct Damaged {
  Bytes bytes;
  std::size_t whole = 0;    ///< messages that no damage touched
  std::size_t touched = 0;  ///< the others
};

/// `places` of a damage, of up to `most` bytes each, behind `from`.
Damaged damaged(const Whole& log, Damage damage, std::size_t places, std::size_t most, std::size_t from,
                std::mt19937& random) {
  std::set<std::size_t> starts;
  const auto within = [&](std::size_t a, std::size_t b) { return std::uniform_int_distribution(a, b)(random); };
  while (starts.size() < places) starts.insert(within(from, log.bytes.size() - most - 1));
  std::vector<char> touched(log.bytes.size(), 0);
  Damaged out;
  std::size_t next = 0;
  for (const std::size_t start : starts) {
    if (start < next) continue;
    const std::size_t size = within(1, most);
    out.bytes.insert(out.bytes.end(), &log.bytes[next], &log.bytes[start]);
    next = start;
    if (damage == Damage::inserted || damage == Damage::twice) {
      // In between two bytes of one message, which is not whole then; between two messages none is touched.
      for (std::size_t k = 0; k < size; ++k)
        out.bytes.push_back(damage == Damage::twice ? log.bytes[start - std::min(start, size) + k]
                                                    : static_cast<std::uint8_t>(within(0, 255)));
      touched[start] = 1;
      continue;
    }
    std::fill_n(touched.begin() + static_cast<std::ptrdiff_t>(start), size, 1);
    next += size;
    if (damage == Damage::cut) {
      std::fill(touched.begin() + static_cast<std::ptrdiff_t>(start), touched.end(), 1);
      next = log.bytes.size();
      break;
    }
    for (std::size_t k = 0; damage != Damage::removed && k < size; ++k)
      out.bytes.push_back(damage == Damage::zeros ? 0 : static_cast<std::uint8_t>(within(0, 255)));
  }
  if (next < log.bytes.size())
    out.bytes.insert(out.bytes.end(), log.bytes.begin() + static_cast<std::ptrdiff_t>(next), log.bytes.end());
  for (const auto& [begin, end] : log.rows) {
    const bool hit = std::any_of(&touched[begin], &touched[begin] + (end - begin), [](char c) { return c != 0; });
    ++(hit ? out.touched : out.whole);
  }
  return out;
}

void reads_what_is_left(const Whole& log, tl::expected<TopicLog, std::string> (*decode)(std::span<const std::uint8_t>),
                        std::size_t from) {
  std::mt19937 random(20261129);
  constexpr Damage kAll[] = {Damage::removed,  Damage::zeros, Damage::noise,
                             Damage::inserted, Damage::cut,   Damage::twice};
  const auto sound = decode(log.bytes);
  ASSERT_TRUE(sound) << sound.error();
  ASSERT_EQ(rows_of(*sound), log.rows.size());
  EXPECT_TRUE(sound->loss.words().empty()) << sound->loss.words().front();
  for (int n = 0; n < 120; ++n) {
    const Damage damage = kAll[n % std::size(kAll)];
    const std::size_t places = 1 + random() % 12, most = 1 + random() % 600;
    const auto hurt = damaged(log, damage, places, most, from, random);
    const auto read = decode(hurt.bytes);
    ASSERT_TRUE(read) << n << ": " << read.error();
    const auto rows = rows_of(*read);
    const std::string which = std::to_string(n) + ": damage " + std::to_string(static_cast<int>(damage)) + ", " +
                              std::to_string(places) + " places of up to " + std::to_string(most) + " bytes";
    // A message in front of a place may be read no more, because nothing fits behind it; bytes that came twice may be
    // a message that nothing tells from the first one.
    EXPECT_GE(rows + places, hurt.whole) << which;
    const std::size_t again = damage == Damage::twice ? places * (most / 20 + 1) : places;
    EXPECT_LE(rows, hurt.whole + again) << which;
    const double lost = 1 - static_cast<double>(rows) / static_cast<double>(log.rows.size());
    if (rows < log.rows.size() && damage != Damage::cut) {
      EXPECT_FALSE(read->loss.words().empty()) << which << ": silent";
    }
    if (damage == Damage::removed) {
      EXPECT_NEAR(read->loss.share(), lost, 0.02) << which;
    }
    if (damage == Damage::cut && rows > 0 && !read->loss.words().empty()) {
      EXPECT_EQ(read->loss.words().back(), "it ends within a message: cut short");
    }
  }
}

TEST(DamagedLog, OfAULogIsReadWhatIsLeftAndTheShareLostIsTold) { reads_what_is_left(small_ulog(), decode_ulog, 400); }

TEST(DamagedLog, OfADataflashLogIsReadWhatIsLeftAndTheShareLostIsTold) {
  const auto log = dataflash_of(read(BACKWASH_SOURCE_DIR "/tests/data/ardupilot/door.bin"));
  // Behind the formats: one that is lost takes all of its messages along.
  reads_what_is_left(log, decode_dataflash, log.rows.front().first);
}

TEST(DamagedLog, ACutWithinAMessageIsToldWhateverTheByte) {
  const auto log = small_ulog();
  const auto& [begin, end] = log.rows[700];
  for (std::size_t size = begin + 1; size < end; ++size) {
    const auto read = decode_ulog(std::span(log.bytes).first(size));
    ASSERT_TRUE(read);
    EXPECT_EQ(rows_of(*read), 700u) << size - begin;
    ASSERT_EQ(read->loss.words().size(), 1u) << size - begin;
  }
}

TEST(DamagedLog, WithoutItsPositionsIsRefusedWithTheShareLost) {
  auto log = small_ulog();
  const std::string name = "vehicle_local_position";
  const auto first = std::ranges::search(log.bytes, name).begin();
  *first = 0xff;
  const auto read = decode_ulog(log.bytes);
  ASSERT_TRUE(read) << read.error();
  const auto flight = flight_of(*read);
  ASSERT_FALSE(flight);
  EXPECT_TRUE(flight.error().starts_with("no topic vehicle_local_position")) << flight.error();
  EXPECT_NE(flight.error().find("% of it is lost"), std::string::npos) << flight.error();
}

/// Files of users (shared/data/field); the test is skipped where they are not there.
std::string field(const std::string& name) { return BACKWASH_SOURCE_DIR "/../shared/data/field/" + name; }

TEST(DamagedLog, AFieldLogWithGapsOfItsNetworkIsReadToItsEnd) {
  const auto hurt = read(field("wifi_gaps.ulg")), whole = read(field("flight.ulg"));
  if (hurt.empty()) GTEST_SKIP() << "data: no " << field("wifi_gaps.ulg");
  const auto read = decode_ulog(hurt), sound = decode_ulog(whole);
  ASSERT_TRUE(read) << read.error();
  ASSERT_TRUE(sound) << sound.error();
  EXPECT_TRUE(sound->loss.words().empty());
  const double bytes = 1 - static_cast<double>(hurt.size()) / static_cast<double>(whole.size());
  const double rows = 1 - static_cast<double>(rows_of(*read)) / static_cast<double>(rows_of(*sound));
  EXPECT_NEAR(read->loss.share(), bytes, 0.2 * bytes);
  EXPECT_NEAR(read->loss.share(), rows, 0.02);
}

}  // namespace
