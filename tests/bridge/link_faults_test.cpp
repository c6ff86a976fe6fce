// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <sys/ioctl.h>
#include <termios.h>

#include <bit>
#include <cerrno>
#include <limits>
#include <random>

#include "firmware_bridge/autopilot_link.hpp"
#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

using mavlink::test::operator+;

TEST_F(LinkTest, NamesALostHeartbeatAfterOneAndAHalfSeconds) {
  introduce_vehicle();
  EXPECT_EQ(link_.heartbeat_age(kStart + 100ms), 100ms);
  EXPECT_FALSE(link_.fault(kStart + 1499ms));
  EXPECT_EQ(link_.fault(kStart + 1500ms), LinkFault::heartbeat_lost);
  say_and_poll(mavlink::LocalPositionNed{}, kStart + 1500ms);
  EXPECT_EQ(link_.fault(kStart + 1500ms), LinkFault::heartbeat_lost) << "other messages are no heartbeat";
  introduce_vehicle(kStart + 1600ms);
  EXPECT_FALSE(link_.fault(kStart + 1600ms));
}

TEST_F(LinkTest, TellsAWrongBaudRateFromASilentLine) {
  EXPECT_FALSE(link_.heartbeat_age(kStart));
  EXPECT_FALSE(link_.fault(kStart + 1999ms));
  EXPECT_EQ(link_.fault(kStart + 2s), LinkFault::nothing_received);
  std::mt19937 random(3);
  Bytes garbage(500);
  for (auto& b : garbage) b = static_cast<std::uint8_t>(random());
  far_.write(garbage);
  for (int i = 0; i < 1000 && link_.received().bytes == 0; ++i) {
    ASSERT_TRUE(link_.poll(kStart + 1s));
    ::usleep(1000);
  }
  EXPECT_FALSE(link_.fault(kStart + 1999ms));
  EXPECT_EQ(link_.fault(kStart + 2s), LinkFault::no_valid_frame);
  introduce_vehicle(kStart + 3s);
  EXPECT_FALSE(link_.fault(kStart + 3s));
}

TEST_F(LinkTest, NoticesAnUnpluggedPortWithinOneTickAndStaysSilentAfterANewOne) {
  introduce_vehicle();
  far_.hang_up();
  EXPECT_FALSE(link_.poll(kStart + kTick));
  EXPECT_EQ(link_.fault(kStart + kTick), LinkFault::port_lost);
  EXPECT_FALSE(link_.send_setpoint({}, kStart + kTick));

  PseudoTerminal replacement;
  link_.reconnect(open(replacement.path()), kStart + 1s);
  EXPECT_FALSE(link_.vehicle());
  EXPECT_FALSE(link_.telemetry().status.at(kStart));
  EXPECT_TRUE(link_.poll(kStart + 1s));
  EXPECT_FALSE(link_.send_setpoint({}, kStart + 1s)) << "passive until the vehicle is heard again";
  ::usleep(20'000);
  EXPECT_TRUE(replacement.read().empty());
}

TEST_F(LinkTest, NeverBlocksWhenNobodyReadsAndFlagsTheSecondMissedSetpoint) {
  introduce_vehicle();
  int ticks = 0, first_missed = 0;
  const Time now = kStart;  // stands still, so that no heartbeat is missed
  const auto before = std::chrono::steady_clock::now();
  for (; ticks < 2000; ++ticks) {
    ASSERT_TRUE(link_.poll(now));
    Setpoint s;
    s.p_W.z() = ticks;
    ASSERT_TRUE(link_.send_setpoint(s, now));
    if (first_missed == 0 && link_.transmit().missed_setpoints() == 1) first_missed = ticks;
    if (link_.fault(now) == LinkFault::transmit_stalled) break;
  }
  EXPECT_LT(std::chrono::steady_clock::now() - before, 2s);
  ASSERT_GT(first_missed, 1);
  EXPECT_EQ(ticks, first_missed + 1);
  EXPECT_LE(link_.transmit().waiting(), 2U) << "one part of a frame on the wire and the newest set-point";

  // Once the far end reads again every frame is whole, the stale ones are gone and the newest is the last.
  Bytes wire;
  for (int i = 0; i < 100; ++i) {
    wire = wire + far_.read();
    ASSERT_TRUE(link_.poll(now));
    ::usleep(500);
  }
  mavlink::Parser parser;
  std::vector<mavlink::test::Received> frames;
  mavlink::test::collect(parser, wire, frames);
  EXPECT_EQ(parser.counters().skipped_bytes, 0U);
  EXPECT_EQ(frames.size(), link_.transmit().sent());
  EXPECT_EQ(frames.size() + link_.transmit().dropped(), static_cast<std::size_t>(ticks) + 1);
  EXPECT_EQ(mavlink::decode<mavlink::SetPositionTargetLocalNed>(frames.back().payload).z, static_cast<float>(-ticks));
  EXPECT_FALSE(link_.fault(now));
}

TEST_F(LinkTest, SendsNoOldSetpointAfterDiscarding) {
  introduce_vehicle();
  for (int i = 0; i < 2000 && link_.fault(kStart) != LinkFault::transmit_stalled; ++i) {
    ASSERT_TRUE(link_.send_setpoint({}, kStart));
  }
  ASSERT_EQ(link_.fault(kStart), LinkFault::transmit_stalled);
  link_.discard_unsent();
  EXPECT_EQ(link_.transmit().waiting(), 0U);
  EXPECT_FALSE(link_.fault(kStart));
  // Only what the far end's line discipline had taken (4096 bytes, 63 set-points) is still read.
  const auto before = mavlink::test::parse(far_.await());
  EXPECT_LE(before.size(), 63U);
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(link_.poll(kStart));
    ::usleep(2000);
    EXPECT_TRUE(far_.read().empty());
  }
  ASSERT_TRUE(link_.send_heartbeat());
  EXPECT_EQ(mavlink::test::parse(far_.await()).size(), 1U) << "and the port works on";
}

// Row 20: an autopilot that asks for the time without end, on a line that takes little, keeps the set-points from it.
TEST(TransmitQueue, ASetpointThatGivesWayToOtherFramesIsMissed) {
  TransmitQueue queue;
  const auto frame = mavlink::encode_frame({1, 191, 0}, mavlink::Heartbeat{});
  for (int tick = 1; tick <= kMaxMissedSetpoints; ++tick) {
    queue.push(frame, TransmitQueue::Kind::setpoint);
    for (std::size_t n = 0; n < 2 * TransmitQueue::kCapacity; ++n) queue.push(frame, TransmitQueue::Kind::other);
    EXPECT_EQ(queue.missed_setpoints(), tick);
  }
}

TEST(TransmitQueue, FinishesAHalfWrittenFrameAndDropsTheOldestWholeOne) {
  TransmitQueue queue;
  const auto frame = [](std::uint8_t sequence) {
    return mavlink::encode_frame({1, 191, sequence}, mavlink::Heartbeat{});
  };
  Bytes wire;
  std::size_t room = 5;
  const auto write = [&](std::span<const std::uint8_t> bytes) -> tl::expected<std::size_t, PortError> {
    const std::size_t n = std::min(room, bytes.size());
    wire.insert(wire.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
    room -= n;
    return n;
  };
  queue.push(frame(0), TransmitQueue::Kind::other);
  ASSERT_TRUE(queue.flush(write));
  for (std::uint8_t i = 1; i < 20; ++i) queue.push(frame(i), TransmitQueue::Kind::other);
  EXPECT_EQ(queue.waiting(), TransmitQueue::kCapacity);
  EXPECT_EQ(queue.dropped(), 4U);
  room = 100'000;
  ASSERT_TRUE(queue.flush(write));
  const auto frames = mavlink::test::parse(wire);
  ASSERT_EQ(frames.size(), TransmitQueue::kCapacity);
  EXPECT_EQ(frames[0].frame.sender.sequence, 0);
  EXPECT_EQ(frames[1].frame.sender.sequence, 5) << "1 to 4 were the oldest whole frames";
  EXPECT_EQ(frames.back().frame.sender.sequence, 19);
}

// PX4 sends a datagram for each message, about 20 in a tick; ArduPilot gathers them in datagrams of up to 1,500 bytes.
TEST(LinkOverUdp, TakesAllDatagramsOfATickInOnePollAndEachOneWhole) {
  auto far = UdpPort::open({"127.0.0.1", 0}, std::nullopt);
  ASSERT_TRUE(far);
  auto near = UdpPort::open({"127.0.0.1", 0}, UdpPort::Endpoint{"127.0.0.1", far->local_port()});
  ASSERT_TRUE(near);
  ASSERT_TRUE(near->write(Bytes{0xFD}));  // so that the far end knows its peer
  std::array<std::uint8_t, 8> heard;
  for (int i = 0; i < 1000 && far->read(heard).value_or(0) == 0; ++i) ::usleep(1000);
  AutopilotLink link(std::move(*near), std::uint8_t{1}, kStart);
  Bytes gathered;
  auto frame = [n = std::uint8_t{0}]() mutable {
    return mavlink::encode_frame({1, 1, n++}, mavlink::Heartbeat{.autopilot = 12, .mavlink_version = 3});
  };
  for (int i = 0; i < 40; ++i) ASSERT_TRUE(far->write(frame().view()));
  for (int i = 0; i < 60; ++i) {
    const auto f = frame();
    gathered.insert(gathered.end(), f.view().begin(), f.view().end());
  }
  ASSERT_GT(gathered.size(), 1200U);
  ASSERT_TRUE(far->write(gathered));
  ASSERT_TRUE(link.poll(kStart));
  EXPECT_EQ(link.received().frames, 100U);
  EXPECT_EQ(link.received().skipped_bytes, 0U);
}

// What the link must not do, where nothing else would show it.

TEST_F(LinkTest, BelievesNoTelemetryBeforeTheVehiclesHeartbeat) {
  say_and_poll(mavlink::LocalPositionNed{.time_boot_ms = 1, .x = 3});
  EXPECT_FALSE(link_.telemetry().local_state.at(kStart));
  introduce_vehicle();
  say_and_poll(mavlink::LocalPositionNed{.time_boot_ms = 2, .x = 3});
  EXPECT_TRUE(link_.telemetry().local_state.at(kStart));
}

TEST_F(LinkTest, SendsNothingToANewPortThatWaitedForTheOldOne) {
  introduce_vehicle();
  for (int n = 0; n < 2000 && link_.transmit().waiting() < 4; ++n) link_.send_heartbeat();  // nobody reads
  ASSERT_GE(link_.transmit().waiting(), 4U);
  PseudoTerminal replacement;
  link_.reconnect(open(replacement.path()), kStart);
  EXPECT_EQ(link_.transmit().waiting(), 0U);
  EXPECT_TRUE(link_.poll(kStart));
  ::usleep(20'000);
  EXPECT_TRUE(replacement.read().empty());
}

TEST_F(LinkTest, NoticesAnUnpluggedPortWhereItWrites) {
  introduce_vehicle();
  far_.hang_up();
  EXPECT_FALSE(link_.send_heartbeat());
  EXPECT_EQ(link_.fault(kStart), LinkFault::port_lost);
}

/// ms of the controller's clock at 1 ms after kStart: its 32 bits wrap soon.
constexpr std::int64_t kBoot_ms = (std::int64_t{1} << 32) - 50;

struct StampTest : LinkTest {
  /// One exchange of TIMESYNC that takes so long.
  void measure(std::chrono::milliseconds round_trip) {
    introduce_vehicle();
    ASSERT_TRUE(link_.send_timesync(kStart));
    const auto question = heard_one<mavlink::Timesync>();
    say_and_poll(mavlink::Timesync{.tc1 = kBoot_ms * 1'000'000, .ts1 = question.ts1}, kStart + round_trip);
    ASSERT_TRUE(link_.clock(kStart));
  }
  /// How old the position counts that comes 101 ms later and is `age_ms` old by the controller's clock, ms.
  std::int64_t counted_ms(std::int64_t age_ms) {
    const Time now = kStart + 102ms;
    say_and_poll(mavlink::LocalPositionNed{.time_boot_ms = static_cast<std::uint32_t>(kBoot_ms + 101 - age_ms)}, now);
    return std::chrono::duration_cast<std::chrono::milliseconds>(*link_.telemetry().local_state.age(now)).count();
  }
};

// However old it is: a line that stores what it carries gives old poses a new arrival. One of the future has no stamp.
TEST_F(StampTest, APositionIsAsOldAsItsStampSaysAlsoWhereThatWraps) {
  measure(2ms);
  for (const auto& [stamped, counted] : {std::pair(100'000, 100'000), std::pair(201, 201), std::pair(60, 60),
                                         std::pair(1, 1), std::pair(0, 0), std::pair(-1, 0), std::pair(-300, 0)})
    EXPECT_EQ(counted_ms(stamped), counted) << stamped;
}

// Two clocks drift apart: by what was measured long ago an old pose may look young.
TEST_F(StampTest, OfAClockThatWasMeasuredLongAgoNoAgeIsTaken) {
  measure(2ms);
  EXPECT_TRUE(link_.clock(kStart + 10s));
  EXPECT_FALSE(link_.clock(kStart + 11s));
  const Time now = kStart + 11s;
  say_and_poll(mavlink::LocalPositionNed{.time_boot_ms = static_cast<std::uint32_t>(kBoot_ms + 10'000)}, now);
  EXPECT_EQ(link_.telemetry().local_state.age(now), Time::duration::zero());
}

TEST_F(StampTest, OfAClockThatIsNotKnownWellNoAgeIsTaken) {
  measure(11ms);
  EXPECT_EQ(counted_ms(60), 0);
}

TEST_F(StampTest, AnotherPortIsAnotherClock) {
  measure(2ms);
  PseudoTerminal replacement;
  link_.reconnect(open(replacement.path()), kStart);
  EXPECT_FALSE(link_.clock(kStart));
}

TEST_F(LinkTest, AnswersNoTimesyncThatAsksAnotherSystem) {
  introduce_vehicle();
  say_and_poll(mavlink::Timesync{.tc1 = 0, .ts1 = 1, .target_system = kVehicle + 1, .target_component = 191});
  say_and_poll(mavlink::Timesync{.tc1 = 0, .ts1 = 2, .target_system = kVehicle, .target_component = 191});
  EXPECT_EQ(heard_one<mavlink::Timesync>().ts1, 2);
}

TEST(Telemetry, Px4PutsTheBytesOfAnIntegerWhereTheFloatIs) {
  mavlink::ParamValue four{.param_value = std::bit_cast<float>(4), .param_type = 6};
  std::ranges::copy(std::string_view("COM_OBL_RC_ACT"), four.param_id.begin());
  Telemetry t;
  t.take(px4_heartbeat(false, 1), kStart);
  t.take(four, kStart);
  EXPECT_EQ(t.parameters()[1].value, 4);
}

TEST(SerialPort, ForgetsWhatCameBeforeItWasOpened) {
  PseudoTerminal far;
  const FileDescriptor earlier(::open(far.path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK));
  ASSERT_GE(earlier.get(), 0);
  termios raw{};
  ASSERT_EQ(::tcgetattr(earlier.get(), &raw), 0);
  ::cfmakeraw(&raw);
  ASSERT_EQ(::tcsetattr(earlier.get(), TCSANOW, &raw), 0);
  far.write(Bytes{1, 2, 3});
  int waiting = 0;
  for (int i = 0; i < 1000 && waiting < 3; ++i) {
    ::usleep(1000);
    ASSERT_EQ(::ioctl(earlier.get(), FIONREAD, &waiting), 0);
  }
  ASSERT_EQ(waiting, 3);
  auto port = SerialPort::open(far.path(), 921600);
  ASSERT_TRUE(port);
  std::array<std::uint8_t, 8> bytes;
  EXPECT_EQ(port->read(bytes), 0U);
}

// A datagram of somebody else that waited already when the peer was found.
TEST(UdpPort, KeepsItsPeerWhoeverSpeaksAfterIt) {
  auto port = UdpPort::open({"127.0.0.1", 0}, std::nullopt);
  ASSERT_TRUE(port);
  const UdpPort::Endpoint to{"127.0.0.1", port->local_port()};
  auto peer = UdpPort::open({"127.0.0.1", 0}, to), other = UdpPort::open({"127.0.0.1", 0}, to);
  ASSERT_TRUE(peer && other);
  ASSERT_EQ(peer->write(Bytes{0xFD}), 1U);
  ASSERT_EQ(other->write(Bytes{2}), 1U);
  std::array<std::uint8_t, 8> bytes;
  for (int n = 0; n < 3; ++n) ASSERT_TRUE(port->read(bytes));
  ASSERT_EQ(port->write(Bytes{3}), 1U);
  EXPECT_EQ(peer->read(bytes), 1U);
  EXPECT_EQ(other->read(bytes), 0U);
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
