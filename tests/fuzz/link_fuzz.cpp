// SPDX-License-Identifier: BSD-3-Clause
// docs/faults.md row 18: the serial line's bytes, through the parser and through the link to the flight controller.
#include <gtest/gtest.h>

#include <deque>

#include "firmware_bridge/autopilot_link.hpp"
#include "tests/bridge/bytes.hpp"
#include "tests/fuzz/mutator.hpp"

namespace backwash::fuzz {
namespace {

using namespace mavlink;
using mavlink::test::crc_by_bits;

/// One piece of what a bad serial line carries, and the frame of a known message in it (empty: there is none).
struct Piece {
  Bytes bytes, frame;
  bool whole = false;  // every byte of the frame is in the piece, in order
};

/// Frames of every known message with random values, most of them damaged or among noise.
class BadLine {
 public:
  explicit BadLine(Mutator& mutator) : mutator_(mutator) {
    for (std::uint32_t id = 0; id < 1000; ++id)
      if (find_message(id)) ids_.push_back(id);
  }

  Piece next() {
    Piece piece;
    switch (mutator_.below(8)) {
      case 0:  // noise, rich in start bytes and in headers
        piece.bytes = mutator_.noise(1 + mutator_.below(80));
        for (auto& b : piece.bytes)
          if (mutator_.one_in(6)) b = static_cast<std::uint8_t>(mutator_.one_in(3) ? kMagicV1 : kMagicV2);
        return piece;
      case 1:  // a message that nobody knows
        piece.bytes = frame(60'000 + static_cast<std::uint32_t>(mutator_.below(1000)), 40);
        if (mutator_.one_in(2)) piece.bytes = mutator_.damaged(piece.bytes);
        return piece;
      default:
        break;
    }
    const MessageInfo& info = *find_message(ids_[mutator_.below(ids_.size())]);
    piece.frame = mutator_.one_in(50) ? question() : frame(info.id, info.full_length);
    piece.bytes = piece.frame;
    if (mutator_.one_in(3)) piece.bytes = mutator_.damaged(piece.frame);
    piece.whole = !std::ranges::search(piece.bytes, piece.frame).empty();
    return piece;
  }

 private:
  Bytes frame(std::uint32_t id, std::size_t length) {
    Payload payload;
    payload.length = length;
    const Bytes values = mutator_.noise(length);
    std::ranges::copy(values, payload.bytes.begin());
    // As often as not values that can be: small numbers, zero, one.
    for (std::size_t at = 0; at + 4 <= length && mutator_.one_in(2); at += 4) {
      const float small = static_cast<float>(mutator_.below(200)) / 100 - 1;
      std::memcpy(payload.bytes.data() + at, &small, sizeof small);
    }
    const MessageInfo* info = find_message(id);
    const auto f = encode_frame({1, 1, sequence_++}, id, info ? info->crc_extra : 0, payload);
    return {f.view().begin(), f.view().end()};
  }

  // The one message that the link answers.
  Bytes question() {
    const auto ours = firmware_bridge::kOnboardComputer;
    const auto f = encode_frame({1, 1, sequence_++}, Timesync{0, static_cast<std::int64_t>(mutator_.bits()), 1, ours});
    return {f.view().begin(), f.view().end()};
  }

  Mutator& mutator_;
  std::vector<std::uint32_t> ids_;
  std::uint8_t sequence_ = 0;
};

/// Holds what the parser takes against what was sent.
struct Judge {
  std::deque<Piece> sent;  // not yet arrived, in order
  std::uint64_t whole = 0, damaged = 0, arrived = 0, lost = 0, foreign = 0, bad = 0, decoded = 0;

  void send(const Piece& piece) {
    if (piece.frame.empty()) return;
    ++(piece.whole ? whole : damaged);
    sent.push_back(piece);
  }
  void take(const Frame& f) {
    bad += !mavlink::test::frame_is_good(f.bytes);
    decoded += decode_and_visit(f.id, f.payload, [](const auto&) {});
    const auto same = std::ranges::find_if(sent, [&](const Piece& p) { return std::ranges::equal(p.frame, f.bytes); });
    if (same == sent.end()) {
      ++foreign;
      return;
    }
    forget(static_cast<std::size_t>(same - sent.begin()));
    sent.pop_front();
    ++arrived;
  }
  void forget(std::size_t count) {
    for (; count > 0; --count) {
      lost += sent.front().whole;
      sent.pop_front();
    }
  }
};

TEST(Fuzz, TheParserTakesNoBadFrameAndLosesHardlyAWholeOne) {
  Mutator mutator("MAVLink parser");
  BadLine line(mutator);
  Parser parser;
  Judge judge;
  Bytes chunk;
  bool more = true;
  while (more) {
    const Piece piece = line.next();
    judge.send(piece);
    more = mutator.spend(piece.bytes.size());
    chunk.insert(chunk.end(), piece.bytes.begin(), piece.bytes.end());
    // Chunks begin and end anywhere.
    for (std::size_t size; !chunk.empty() && (size = 1 + mutator.below(600)) <= chunk.size();) {
      parser.feed(std::span(chunk).first(size), [&](const Frame& f) { judge.take(f); });
      chunk.erase(chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(size));
    }
    if (judge.sent.size() > 64) judge.forget(1);
  }
  const auto& seen = parser.counters();
  std::printf("%llu whole frames, %llu damaged; %llu arrived, %llu lost; %llu wrong checksums, %llu right by chance\n",
              static_cast<unsigned long long>(judge.whole), static_cast<unsigned long long>(judge.damaged),
              static_cast<unsigned long long>(judge.arrived), static_cast<unsigned long long>(judge.lost),
              static_cast<unsigned long long>(seen.bad_crc), static_cast<unsigned long long>(judge.foreign));
  EXPECT_EQ(judge.bad, 0u);
  EXPECT_EQ(judge.decoded, seen.frames);
  EXPECT_GT(judge.arrived, judge.whole * 99 / 100);
  // A damaged unknown message may swallow the frame behind it (firmware_bridge/README.md); so may a chance checksum.
  EXPECT_LE(judge.lost, judge.damaged / 500 + 5);
  // A wrong frame passes a 16-bit checksum once in 65,536: any more, and something else lets them through.
  EXPECT_LE(judge.foreign, seen.bad_crc / 65'536 * 3 + 20);
  EXPECT_GT(seen.bad_crc, judge.damaged / 4);
  EXPECT_GT(seen.unknown_id, 0u);
}

bool finite(const std::optional<double>& v) { return !v || std::isfinite(*v); }

/// Nothing that the tick may use can be broken, whatever was said.
void expect_sane(const firmware_bridge::Telemetry& t, firmware_bridge::Time now) {
  if (const auto said = t.local_state.at(now)) {
    ASSERT_TRUE(said->value.p_W.allFinite() && said->value.v_W.allFinite());
  }
  if (const auto said = t.attitude.at(now)) {
    ASSERT_NEAR(said->value.q_LB.norm(), 1, 1e-6);
    ASSERT_TRUE(said->value.omega_B.allFinite());
  }
  if (const auto said = t.battery.at(now)) {
    ASSERT_TRUE(finite(said->value.voltage));
    ASSERT_TRUE(!said->value.remaining || (*said->value.remaining >= 0 && *said->value.remaining <= 1));
  }
  if (const auto said = t.landed_state.at(now)) {
    ASSERT_LE(static_cast<int>(said->value), 4);
  }
  if (t.text) {
    ASSERT_EQ(t.text->value.text.back(), '\0');
  }
}

TEST(Fuzz, TheLinkKeepsNothingBrokenAndSendsNothingButAnswersToTimesync) {
  Mutator mutator("link to the flight controller");
  BadLine line(mutator);
  auto ours = firmware_bridge::UdpPort::open({"127.0.0.1", 0}, std::nullopt);
  ASSERT_TRUE(ours);
  auto theirs = firmware_bridge::UdpPort::open({"127.0.0.1", 0},
                                               firmware_bridge::UdpPort::Endpoint{"127.0.0.1", ours->local_port()});
  ASSERT_TRUE(theirs);
  auto now = std::chrono::steady_clock::now();
  firmware_bridge::AutopilotLink link(std::move(*ours), std::uint8_t{1}, now);
  Parser answers;
  std::uint64_t answered = 0, other = 0;
  std::array<std::uint8_t, 2048> received;
  for (bool more = true; more;) {
    for (int datagram = 0; datagram < 4; ++datagram) {
      Bytes bytes;
      while (bytes.size() < 200) {
        const Bytes piece = line.next().bytes;
        bytes.insert(bytes.end(), piece.begin(), piece.end());
      }
      bytes.resize(std::min<std::size_t>(bytes.size(), 512));
      more = mutator.spend(bytes.size());
      ASSERT_EQ(theirs->write(bytes), bytes.size());
    }
    now += std::chrono::milliseconds(20);
    ASSERT_TRUE(link.poll(now));
    expect_sane(link.telemetry(), now);
    if (HasFatalFailure()) return;
    for (std::size_t size; (size = theirs->read(received).value()) > 0;)
      answers.feed(std::span(received).first(size), [&](const Frame& f) {
        ++(f.id == Timesync::kId && f.sender.component == firmware_bridge::kOnboardComputer ? answered : other);
      });
  }
  const auto& t = link.telemetry();
  std::printf("%llu bytes heard, %llu frames, %llu broken messages dropped, %llu out of order; %llu answers\n",
              static_cast<unsigned long long>(link.received().bytes),
              static_cast<unsigned long long>(link.received().frames), static_cast<unsigned long long>(t.broken),
              static_cast<unsigned long long>(t.out_of_order), static_cast<unsigned long long>(answered));
  EXPECT_EQ(link.vehicle(), 1);
  EXPECT_TRUE(t.local_state.age(now) && t.attitude.age(now) && t.text);
  if (link.received().frames > 100'000) {  // rarer: a state out of five of 256, battery 0
    EXPECT_TRUE(t.landed_state.age(now) && t.battery.age(now));
  }
  EXPECT_GT(t.broken, 0u);
  EXPECT_GT(answered, 0u);
  EXPECT_EQ(other, 0u) << "something was sent that nobody asked for";
}

}  // namespace
}  // namespace backwash::fuzz
