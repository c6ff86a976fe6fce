// SPDX-License-Identifier: BSD-3-Clause
// What the link must not do, where nothing else would show it.
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <bit>
#include <cerrno>
#include <limits>

#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

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
  EXPECT_EQ(link_.fault(kStart), LinkFault::kPortLost);
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

TEST_F(LinkTest, AsksForNoRateThatIsNone) {
  introduce_vehicle();
  for (const double rate : {0.0, -1.0, static_cast<double>(kNan)})
    EXPECT_FALSE(link_.send_message_interval(32, rate)) << rate;
  EXPECT_EQ(link_.transmit().sent(), 0U);
}

TEST(Telemetry, Px4PutsTheBytesOfAnIntegerWhereTheFloatIs) {
  mavlink::ParamValue four{.param_value = std::bit_cast<float>(4), .param_type = 6};
  std::ranges::copy(std::string_view("COM_OBL_RC_ACT"), four.param_id.begin());
  Telemetry t;
  t.take(px4_heartbeat(false, 1), kStart);
  t.take(four, kStart);
  EXPECT_EQ(t.parameters()[1].value, 4);
}

TEST(Telemetry, DropsRatesAndParametersThatAreNoNumbers) {
  Telemetry t;
  t.take(mavlink::AttitudeQuaternion{1, 1, 0, 0, 0, kNan, 0, 0}, kStart);
  t.take(mavlink::AttitudeQuaternion{1, 1, 0, 0, 0, 0, 0, kNan}, kStart);
  EXPECT_FALSE(t.attitude.at(kStart));
  mavlink::ParamValue parameter{.param_value = kNan};
  std::ranges::copy(std::string_view("COM_OF_LOSS_T"), parameter.param_id.begin());
  t.take(parameter, kStart);
  EXPECT_FALSE(t.parameters()[0].value);
  EXPECT_EQ(t.broken, 3U);
}

// Root may open it all the same: the flag itself is asked for.
TEST(SerialPort, IsOursAlone) {
  PseudoTerminal far;
  const auto port = SerialPort::open(far.path(), 921600);
  ASSERT_TRUE(port);
  const FileDescriptor second(::open(far.path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK));
  if (second.get() < 0) {
    EXPECT_EQ(errno, EBUSY);
    return;
  }
  int exclusive = 0;
  ASSERT_EQ(::ioctl(second.get(), TIOCGEXCL, &exclusive), 0);
  EXPECT_NE(exclusive, 0);
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
