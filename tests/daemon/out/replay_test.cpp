// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/log/raw/tick_log.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

using log::RecordKind;

/// A raw log of a flight in lockstep with a hold and a landing, in a file of its own. tests/golden keeps it: the
/// environment variable BACKWASH_KEEP_RAW_LOG names where.
class Replay : public testing::Test {
 protected:
  void SetUp() override {
    Lockstep rig;
    rig.take_off();
    rig.start_route(2);
    rig.tick(3);
    rig.ticks(100);
    EXPECT_TRUE(rig.channels->orders.push({track::Request::land}));
    rig.ticks(50);
    ticks_ = rig.view().ticks;
    path_ = testing::TempDir() + "replay_" + std::to_string(::getpid()) + ".bwlog";
    rig.save(path_);
  }
  void TearDown() override {
    if (const char* kept = std::getenv("BACKWASH_KEEP_RAW_LOG"))
      std::filesystem::copy_file(path_, kept, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::remove(path_);
  }

  log::RawLog read() const { return log::read_raw_log(path_).value(); }
  /// Changes one byte of the file.
  void flip(std::uint64_t offset) const {
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    file.seekg(static_cast<std::streamoff>(offset));
    const auto byte = static_cast<char>(file.get() ^ 0x10);
    file.seekp(static_cast<std::streamoff>(offset));
    file.put(byte);
  }
  static const log::RawRecord& nth(const log::RawLog& log, RecordKind kind, std::size_t n) {
    for (const auto& r : log.records)
      if (r.header.kind == kind && n-- == 0) return r;
    throw std::out_of_range("no such record");
  }

  std::string path_;
  std::uint64_t ticks_ = 0;
};

TEST_F(Replay, OfAFlightIsBitForBitEqualEachTime) {
  const auto first = log::replay(read(), path_);
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(first->ticks, ticks_);
  EXPECT_EQ(first->ticks_missing, 0u);
  EXPECT_EQ(first->segments, 3u);  // lift-off, the rest of the way up, the route
  EXPECT_GT(first->setpoints, 400u);
  EXPECT_EQ(first->differing, 0u) << first->first->field << " of tick " << first->first->tick;
  EXPECT_EQ(log::replay(read(), path_)->state_hash, first->state_hash);
}

// Inputs of every kind: where the replay first differs is where the input was read.
TEST_F(Replay, NamesTheTickAndFieldThatAChangedInputMakesDiffer) {
  const auto log = read();
  const auto& input = nth(log, RecordKind::tick_input, 400);
  const std::uint64_t body = input.offset + sizeof(log::RecordHeader);
  for (const std::size_t at : {offsetof(log::TickInputRecord, p) + 6, offsetof(log::TickInputRecord, v) + 6,
                               offsetof(log::TickInputRecord, flags)}) {
    flip(body + at);
    const auto replayed = log::replay(read(), path_);
    ASSERT_TRUE(replayed) << replayed.error().message;
    ASSERT_TRUE(replayed->first) << at;
    EXPECT_EQ(replayed->first->tick, 400u) << at;
    EXPECT_GT(replayed->first->offset, body);
    flip(body + at);
  }
  EXPECT_EQ(log::replay(read(), path_)->differing, 0u);
}

TEST_F(Replay, NamesADecisionThatTheLogTellsOtherwise) {
  const auto log = read();
  const auto& tick = nth(log, RecordKind::tick, 500);
  flip(tick.offset + sizeof(log::RecordHeader) + offsetof(log::TickRecord, local_v));
  const auto replayed = log::replay(read(), path_);
  ASSERT_TRUE(replayed && replayed->first);
  EXPECT_EQ(replayed->differing, 1u);
  EXPECT_EQ(replayed->first->tick, 500u);
  EXPECT_EQ(replayed->first->field, "local_v");
  EXPECT_EQ(replayed->first->offset, tick.offset);
}

TEST_F(Replay, NamesTheByteOfWhatIsDamaged) {
  const auto log = read();
  const auto expect_named = [&](const auto& result, std::uint64_t offset) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, log::LogError::Kind::bad_data);
    EXPECT_NE(result.error().message.find(path_ + ": byte " + std::to_string(offset) + ": "), std::string::npos)
        << result.error().message;
  };
  const auto& record = nth(log, RecordKind::tick, 100);
  flip(record.offset + 8);  // the kind
  expect_named(log::read_raw_log(path_), record.offset);
  flip(record.offset + 8);

  const auto& offer = nth(log, RecordKind::offer, 1);
  flip(offer.offset + sizeof(log::RecordHeader) + 7 * 8 + 6);  // the number of its commands
  expect_named(log::replay(read(), path_), offer.offset);
  flip(offer.offset + sizeof(log::RecordHeader) + 7 * 8 + 6);

  const std::uint64_t last = log.records.back().offset;
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) - 5);
  const auto cut = read();
  EXPECT_EQ(cut.cut_at, last);
  EXPECT_EQ(cut.records.size() + 1, log.records.size());
}

/// The log as it was written before a pose was held against its twist by a law that the log says.
log::RawLog as_before(log::RawLog log) {
  for (auto& r : log.records) {
    if (r.header.kind == RecordKind::constants) r.bytes.resize(sizeof(log::ConstantsRecord));
    if (r.header.kind == RecordKind::tick_input) r.bytes.resize(sizeof(log::TickInputRecord));
  }
  return log;
}

TEST_F(Replay, OfALogThatNamesNoLawIsTheSameWhereNothingDrifted) {
  const auto replayed = log::replay(as_before(read()), path_);
  ASSERT_TRUE(replayed) << replayed.error().message;
  EXPECT_EQ(replayed->ticks, ticks_);
  EXPECT_EQ(replayed->differing, 0u);
}

// By the law of before, which a log that names none was decided by, this drift is flown on.
TEST(ReplayOfADrift, IsHeldByTheLawThatTheLogNamesAlone) {
  Lockstep rig;
  rig.take_off();
  double drifted = 0;
  rig.spoil = [&](OdometrySample& s) {
    s.state.p_W.x() += drifted += 0.05 * kControlPeriod;
    s.velocity_variance = Vec3::Constant(1e-4);
  };
  const int ticks = rig.ticks_until(Mode::hold, 400);
  ASSERT_GT(ticks, 60);
  ASSERT_EQ(rig.reason(), Reason::odometry_inconsistent);
  const auto held = rig.view().ticks - 1;
  rig.ticks(5);
  const std::string path = testing::TempDir() + "drift_" + std::to_string(::getpid()) + ".bwlog";
  rig.save(path);
  const auto log = log::read_raw_log(path).value();
  std::filesystem::remove(path);
  const auto now = log::replay(log, path), before = log::replay(as_before(log), path);
  ASSERT_TRUE(now && before);
  EXPECT_EQ(now->differing, 0u) << now->first->field;
  ASSERT_TRUE(before->first);
  EXPECT_EQ(before->first->tick, held);
  EXPECT_EQ(before->first->field, "mode");
  // What it says of its velocity decides too: without it the hold comes later.
  auto unstated = log;
  for (auto& r : unstated.records)
    if (r.header.kind == RecordKind::tick_input) r.bytes.resize(sizeof(log::TickInputRecord));
  EXPECT_GT(log::replay(unstated, path)->differing, 0u);
}

TEST_F(Replay, CountsTicksThatTheLogHasLost) {
  auto log = read();
  std::size_t seen = 0;
  std::erase_if(log.records, [&](const auto& r) { return r.header.kind == RecordKind::tick_input && seen++ == 300; });
  const auto replayed = log::replay(log, path_);
  ASSERT_TRUE(replayed);
  EXPECT_EQ(replayed->ticks_missing, 1u);
}

TEST(Offer, ComesBackAsItWentIn) {
  track::AcceptedSegment s;
  s.id = 7;
  s.continues = 6;
  s.branch = 1;
  s.commands.resize(3);
  s.commands[1] = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, 0.5};
  s.tube.resize(4);
  s.tube[2].center.p_W = {0.1, 0.2, 0.3};
  s.tube[2].half_widths = {1, 2, 3, 4, 5};
  s.tube[3].half_widths_interval = {6, 7, 8, 9, 10};
  s.stops.resize(1);
  s.stops[0] = {1, {s.commands[1]}, {s.tube[2], s.tube[3]}};
  const auto bytes = log::encode(s);
  const auto back = log::decode_offer(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(log::encode(**back), bytes);
  EXPECT_EQ((*back)->stops[0].branch, 1u);
  EXPECT_EQ((*back)->commands[1].a_W, Vec3(7, 8, 9));
  for (std::size_t n = 0; n < bytes.size(); n += 8)
    EXPECT_FALSE(log::decode_offer(std::span(bytes).first(n))) << "cut at " << n;
  s.worst = 2.5;
  s.worst_at_rest = 1.5;
  EXPECT_EQ(log::decode_offer(log::encode(s)).value()->worst, 2.5);
  EXPECT_EQ(log::decode_offer(log::encode(s)).value()->worst_at_rest, 1.5);
  s.worst = 0.5;
  EXPECT_FALSE(log::decode_offer(log::encode(s)));
}

}  // namespace
}  // namespace backwash::daemon::test
