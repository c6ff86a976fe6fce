// SPDX-License-Identifier: BSD-3-Clause
// Damaged logs: each reader says what is wrong or gives something whole; none crashes.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/log/autopilot/dataflash.hpp"
#include "core/log/autopilot/ulog.hpp"
#include "core/log/raw/tick_log.hpp"
#include "core/report/recorded_map.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"
#include "tests/fuzz/mutator.hpp"

namespace backwash::fuzz {
namespace {

using daemon::test::Lockstep;
using log::RecordKind;

const std::string kPath = testing::TempDir() + "fuzz_log_" + std::to_string(::getpid());

void write(const Bytes& bytes) {
  std::ofstream(kPath, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

Bytes read(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void append(Bytes& to, const void* from, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(from);
  to.insert(to.end(), bytes, bytes + size);
}

struct Outcome {
  std::uint64_t taken = 0, refused = 0;
  ~Outcome() {
    std::printf("%llu taken, %llu refused\n", static_cast<unsigned long long>(taken),
                static_cast<unsigned long long>(refused));
    std::filesystem::remove(kPath);
  }
};

/// The raw log of a take-over and a short segment, few enough records for damage to meet every kind.
Bytes raw_log() {
  Lockstep rig;
  rig.ticks(60);
  rig.channels->orders.push_or_count({track::Request::enable});
  EXPECT_GT(rig.ticks_until(Mode::tracking, 250), 0);
  rig.offer(std::vector<Setpoint>(10, Setpoint{rig.view().state.p_W, Vec3::Zero(), Vec3::Zero(), 0}));
  rig.ticks(12);
  Bytes log;
  append(log, log::kRawLogMagic, sizeof log::kRawLogMagic - 1);
  std::uint64_t tick = 0;
  for (const auto& r : rig.log) {
    const auto kind = r.header.kind;
    tick += kind == RecordKind::tick_input;
    const bool frame = kind == RecordKind::frame_in || kind == RecordKind::frame_out;
    // The first ticks, all that is rare, and the last ticks.
    if (frame || (tick > 3 && tick + 15 < rig.view().ticks && kind != RecordKind::offer)) continue;
    append(log, &r.header, sizeof r.header);
    append(log, r.bytes.data(), r.bytes.size());
  }
  std::printf("%zu bytes of log\n", log.size());
  return log;
}

TEST(Fuzz, ADamagedRawLogIsReplayedOrRefusedByItsByte) {
  Mutator mutator("raw log and replay", 0.5);
  const Bytes whole = raw_log();
  Outcome outcome;
  for (bool more = true; more;) {
    const Bytes bytes = mutator.damaged(whole);
    more = mutator.spend(bytes.size());
    write(bytes);
    const auto log = log::read_raw_log(kPath);
    const auto replayed = log ? log::replay(*log, "log") : tl::unexpected(log.error());
    ++(replayed ? outcome.taken : outcome.refused);
    if (!replayed) {
      const std::string& why = replayed.error().message;
      ASSERT_TRUE(why.find("byte ") != why.npos || why.find("no constants") != why.npos) << why;
    }
    if (log) (void)report::recorded_map(log->records);
  }
  EXPECT_GT(outcome.taken, 0u);
}

TEST(Fuzz, ADamagedULogIsReadOrRefusedByItsByte) {
  const std::string path = BACKWASH_RECORDINGS "/ulog/sample_log_small.ulg";
  Mutator mutator("ULog", 0.5);
  Bytes whole = read(path);
  whole.resize(std::min<std::size_t>(whole.size(), 60'000));
  Outcome outcome;
  for (bool more = true; more;) {
    Bytes bytes = whole;
    bytes = mutator.damaged(std::move(bytes));
    more = mutator.spend(bytes.size());
    const auto log = log::decode_ulog(bytes);
    ++(log ? outcome.taken : outcome.refused);
    if (!log) {
      ASSERT_TRUE(log.error().starts_with("byte ")) << log.error();
      continue;
    }
    if (!mutator.one_in(8)) continue;
    write(bytes);
    const auto flight = log::read_ulog(kPath);  // the whole way to a flight log
    if (!flight) {
      ASSERT_FALSE(flight.error().message.empty());
    }
  }
  EXPECT_GT(outcome.refused, 0u);
}

TEST(Fuzz, ADamagedDataflashLogIsReadAsFiniteNumbersOrRefused) {
  Mutator mutator("DataFlash", 0.5);
  const Bytes whole = read(BACKWASH_SOURCE_DIR "/tests/data/ardupilot/door.bin");
  Outcome outcome;
  for (bool more = true; more;) {
    const Bytes bytes = mutator.damaged(whole);
    more = mutator.spend(bytes.size());
    const auto log = log::decode_dataflash(bytes);
    const auto flight = log ? log::flight_of(log::px4_names(*log)) : tl::make_unexpected(log.error());
    ++(flight ? outcome.taken : outcome.refused);
    if (!flight) {
      ASSERT_FALSE(flight.error().empty());
      continue;
    }
    for (const auto& [name, column] : flight->columns) {
      ASSERT_EQ(column.size(), flight->t_s.size()) << name;
      ASSERT_TRUE(std::ranges::all_of(column, [](double v) { return std::isfinite(v); })) << name;
    }
  }
  EXPECT_GT(outcome.taken, 0u);
}

TEST(Fuzz, ADamagedFlightLogHoldsFiniteNumbersOrIsRefusedByItsLine) {
  Mutator mutator("flight log CSV", 0.02);
  const std::string text =
      "t_s,x_m,y_m,z_m,qw,segment\n0.00,1,2,3,1,0\n0.02,1.5,-2e-3,3,1,0\n0.04,.5,2,3,0.5,-1\n0.06,1,2,3,1,0\n";
  Outcome outcome;
  for (bool more = true; more;) {
    const Bytes bytes = mutator.damaged({text.begin(), text.end()});
    more = mutator.spend(bytes.size());
    write(bytes);
    const auto log = log::read_csv(kPath);
    ++(log ? outcome.taken : outcome.refused);
    if (!log) {
      ASSERT_NE(log.error().message.find(kPath), std::string::npos);
      continue;
    }
    for (const auto& [name, column] : log->columns) {
      ASSERT_EQ(column.size(), log->t_s.size()) << name;
      for (const double v : column) ASSERT_TRUE(std::isfinite(v)) << name;
    }
  }
  EXPECT_GT(outcome.taken, 0u);
  EXPECT_GT(outcome.refused, 0u);
}

}  // namespace
}  // namespace backwash::fuzz
