// SPDX-License-Identifier: BSD-3-Clause
// Damaged logs: each reader says what is wrong or gives something whole; none crashes.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/log/dataflash.hpp"
#include "core/log/tick_log.hpp"
#include "core/log/ulog.hpp"
#include "core/report/recorded_flight.hpp"
#include "tests/daemon/lockstep.hpp"
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

/// Records of a take-off and a route as the planner writes them, with ticks that agree, and two rows of truth.
std::vector<log::RawRecord> flown(const plan::World& world) {
  std::vector<log::RawRecord> log;
  const auto record = [&](RecordKind kind, std::int64_t t_ns, const Bytes& bytes) {
    log.push_back({{t_ns, kind, static_cast<std::uint32_t>(bytes.size())}, bytes});
  };
  for (std::uint64_t id = 1; id <= 2; ++id) {
    const State start{Vec3(-2, 0, 1.2), Vec3::Zero()};
    const std::vector<Setpoint> rows(20, Setpoint{start.p_W, Vec3::Zero(), Vec3::Zero(), 0});
    log::SegmentRecord head{};
    head.id = id, head.commands = rows.size() - 1;
    std::copy_n(start.p_W.data(), 3, head.start_p);
    Bytes segment;
    append(segment, &head, sizeof head);
    for (const auto& c : rows) {
      const double v[10] = {c.p_W.x(), c.p_W.y(), c.p_W.z()};
      append(segment, v, sizeof v);
    }
    record(RecordKind::segment, 0, segment);
    const std::span commands(rows.begin() + 1, rows.end());
    const auto tube = reach::tube_over_field(world.reach, start, rows[0], commands, world.bounds);
    for (std::size_t k = 0; k < 22; ++k) {
      log::TickRecord tick{};
      tick.segment = id, tick.index = k, tick.judged = 1;
      std::copy_n(tube[std::min(k, tube.size() - 1)].center.p_W.data(), 3, tick.center);
      Bytes bytes;
      append(bytes, &tick, sizeof tick);
      record(RecordKind::tick, static_cast<std::int64_t>(20'000'000 * (k + 40 * id)), bytes);
    }
  }
  return log;
}

TEST(Fuzz, ADamagedFlightIsPutTogetherOrRefused) {
  Mutator mutator("recorded flight", 0.02);
  const auto world = daemon::test::corridor();
  const auto whole = flown(*world);
  log::FlightLog truth;
  truth.t_s = {0, 10};
  for (const char* c : {"x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "ax_mps2", "ay_mps2", "az_mps2"})
    truth.columns[c] = {0, 0};
  ASSERT_TRUE(report::recorded_flight(whole, truth, *world))
      << report::recorded_flight(whole, truth, *world).error().message;
  Outcome outcome;
  for (bool more = true; more;) {
    auto log = whole;
    std::size_t bytes = 0;
    for (std::size_t n = 1 + mutator.below(3); n > 0; --n) {
      // Every other one the head of a segment: there are but two.
      const std::size_t at = mutator.one_in(2) ? mutator.below(2) * 23 : mutator.below(log.size());
      log[at].bytes = mutator.damaged(log[at].bytes);
      if (mutator.one_in(4)) log[at].bytes.resize(std::min(log[at].bytes.size(), mutator.below(300)));
      bytes += log[at].bytes.size();
    }
    more = mutator.spend(bytes);
    const auto flight = report::recorded_flight(log, truth, *world);
    ++(flight ? outcome.taken : outcome.refused);
    if (!flight) {
      ASSERT_FALSE(flight.error().message.empty());
    }
  }
  EXPECT_GT(outcome.refused, 0u);
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
