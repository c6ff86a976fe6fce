// SPDX-License-Identifier: BSD-3-Clause
#include <arpa/inet.h>
#include <asm/termbits.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "firmware_bridge/port/serial_port.hpp"
#include "firmware_bridge/port/udp_port.hpp"
#include "tests/bridge/port_bytes.hpp"

namespace backwash::firmware_bridge::test {
namespace {

using mavlink::test::operator+;
using Kind = PortError::Kind;

TEST(SerialPort, CarriesEveryByteValueUnchangedBothWays) {
  PseudoTerminal far;
  auto port = SerialPort::open(far.path(), 921600);
  ASSERT_TRUE(port);
  ASSERT_EQ(port->write(every_byte()), 256U);
  EXPECT_EQ(far.await(), every_byte());
  far.write(every_byte());
  EXPECT_EQ(read_all(*port, 256), every_byte());
  EXPECT_TRUE(far.read().empty()) << "nothing is echoed";
}

TEST(SerialPort, ReadsNothingWithoutWaiting) {
  PseudoTerminal far;
  auto port = SerialPort::open(far.path(), 57600);
  ASSERT_TRUE(port);
  std::array<std::uint8_t, 8> bytes;
  const auto n = port->read(bytes);
  ASSERT_TRUE(n);
  EXPECT_EQ(*n, 0U);
}

TEST(SerialPort, ReportsAHangUpOnReadAndOnWrite) {
  PseudoTerminal far;
  auto port = SerialPort::open(far.path(), 115200);
  ASSERT_TRUE(port);
  far.hang_up();
  std::array<std::uint8_t, 8> bytes{};
  const auto read = port->read(bytes);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, Kind::lost);
  const auto written = port->write(bytes);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, Kind::lost);
}

TEST(SerialPort, TakesNoMoreThanTheKernelHasRoomForAndNeverBlocks) {
  PseudoTerminal far;
  auto port = SerialPort::open(far.path(), 115200);
  ASSERT_TRUE(port);
  const Bytes block(1000, 0x5A);
  std::size_t taken = 0;
  int refused = 0;
  for (int i = 0; i < 200; ++i) {
    const auto n = port->write(block);
    ASSERT_TRUE(n);
    taken += *n;
    refused += *n == 0;
  }
  EXPECT_GT(refused, 10);
  EXPECT_LT(taken, 200'000U);
  std::size_t arrived = 0;
  for (Bytes b; !(b = far.read()).empty();) arrived += b.size();
  EXPECT_EQ(arrived, taken);
}

TEST(SerialPort, DiscardsWhatTheKernelHasNotSent) {
  PseudoTerminal far;
  auto port = SerialPort::open(far.path(), 115200);
  ASSERT_TRUE(port);
  std::size_t taken = 0;
  while (const auto n = port->write(Bytes(1000, 1)).value_or(0)) taken += n;
  port->discard_output();
  ASSERT_EQ(port->write(Bytes{7}), 1U);
  Bytes arrived;
  while (arrived.empty() || (arrived.back() != 7 && arrived.size() <= taken)) arrived = arrived + far.await();
  // What the far end's line discipline holds (4096 bytes) counts as received.
  EXPECT_GT(taken, 8000U);
  EXPECT_LE(arrived.size(), 4097U);
  EXPECT_EQ(arrived.back(), 7);
}

TEST(SerialPort, NamesWhyItCannotBeOpened) {
  PseudoTerminal far;
  EXPECT_EQ(SerialPort::open("/nonexistent/tty", 115200).error().kind, Kind::open);
  EXPECT_EQ(SerialPort::open("/dev/null", 115200).error().kind, Kind::not_serial);
  EXPECT_EQ(SerialPort::open(far.path(), 0).error().kind, Kind::baud_rate);
  EXPECT_NE(describe(SerialPort::open("/nonexistent/tty", 115200).error()).find("No such file"), std::string::npos);
}

// Two daemons on one line would each get half of what the autopilot says, and both would command it.
TEST(SerialPort, IsBusyForAnyOtherProcessRootsToo) {
  PseudoTerminal far;
  auto port = SerialPort::open(far.path(), 921600);
  ASSERT_TRUE(port);
  const pid_t other = ::fork();
  if (other == 0) {
    const auto second = SerialPort::open(far.path(), 57600);
    ::_exit(!second && second.error().kind == Kind::busy ? 5 : 1);
  }
  int status = 0;
  ::waitpid(other, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 5);
  EXPECT_TRUE(SerialPort::open(far.path(), 921600) || ::geteuid() != 0) << "the daemon itself opens a lost port again";
}

TEST(SerialPort, RunsAtRatesThatHaveNoName) {
  for (const unsigned baud : {9600U, 57'600U, 100'000U, 115'201U, 420'000U, 921'600U, 3'700'000U}) {
    PseudoTerminal far;
    auto port = SerialPort::open(far.path(), baud);
    ASSERT_TRUE(port) << baud;
    termios2 settings{};  // of the line: both ends show it
    ASSERT_EQ(::ioctl(far.master(), TCGETS2, &settings), 0);
    EXPECT_EQ(settings.c_ospeed, baud);
    EXPECT_EQ(settings.c_ispeed, baud);
    EXPECT_EQ(settings.c_cflag & static_cast<unsigned>(CSIZE | CSTOPB | PARENB | CRTSCTS), static_cast<unsigned>(CS8));
    ASSERT_EQ(port->write(every_byte()), 256U);
    EXPECT_EQ(far.await(), every_byte());
  }
}

TEST(UdpPort, TalksToAGivenPeerAndHearsNobodyElse) {
  auto a = UdpPort::open({"127.0.0.1", 0}, std::nullopt);
  ASSERT_TRUE(a);
  auto b = UdpPort::open({"127.0.0.1", 0}, UdpPort::Endpoint{"127.0.0.1", a->local_port()});
  auto stranger = UdpPort::open({"127.0.0.1", 0}, UdpPort::Endpoint{"127.0.0.1", a->local_port()});
  ASSERT_TRUE(b);
  ASSERT_TRUE(stranger);
  EXPECT_EQ(a->write(every_byte()), 0U) << "no peer yet";
  Bytes frame = every_byte();
  frame.front() = 0xFD;
  ASSERT_EQ(b->write(frame), 256U);
  EXPECT_EQ(read_all(*a, 256), frame);
  ASSERT_EQ(stranger->write(Bytes{1, 2, 3}), 3U);
  ASSERT_EQ(b->write(Bytes{4}), 1U);
  EXPECT_EQ(read_all(*a, 1), Bytes{4}) << "the first sender stays the only peer";
  ASSERT_EQ(a->write(Bytes{9}), 1U);
  EXPECT_EQ(read_all(*b, 1), Bytes{9});
}

// Whoever scans ports, or any other stray datagram, must not take the autopilot's place before it has spoken.
TEST(UdpPort, WhatIsNoFrameMakesNoPeer) {
  auto a = UdpPort::open({"127.0.0.1", 0}, std::nullopt);
  ASSERT_TRUE(a);
  const UdpPort::Endpoint to{"127.0.0.1", a->local_port()};
  auto stray = UdpPort::open({"127.0.0.1", 0}, to), autopilot = UdpPort::open({"127.0.0.1", 0}, to);
  ASSERT_TRUE(stray && autopilot);
  ASSERT_EQ(stray->write(Bytes{'h', 'i'}), 2U);
  std::array<std::uint8_t, 8> bytes{};
  EXPECT_EQ(a->read(bytes), 0U);
  ASSERT_EQ(autopilot->write(Bytes{0xFE, 1}), 2U);
  EXPECT_EQ(a->read(bytes), 2U);
  ASSERT_EQ(a->write(Bytes{9}), 1U);
  EXPECT_EQ(autopilot->read(bytes), 1U);
  EXPECT_EQ(stray->read(bytes), 0U);
}

// A simulator that is started anew has another port of its own.
TEST(UdpPort, ItsPeerIsLetGoOfWhenItHasBeenSilentAndNotBefore) {
  std::uint16_t number = 0;
  {
    const auto any = UdpPort::open({"127.0.0.1", 0}, std::nullopt);
    ASSERT_TRUE(any);
    number = any->local_port();
  }
  constexpr std::chrono::milliseconds kPatience{500};
  auto a = UdpPort::open({"127.0.0.1", number}, std::nullopt, kPatience);
  ASSERT_TRUE(a);
  const UdpPort::Endpoint to{"127.0.0.1", number};
  auto first = UdpPort::open({"127.0.0.1", 0}, to), second = UdpPort::open({"127.0.0.1", 0}, to);
  ASSERT_TRUE(first && second);
  std::array<std::uint8_t, 8> bytes{};
  const Bytes frame{0xFD, 1, 2};
  ASSERT_EQ(first->write(frame), 3U);
  auto heard = UdpPort::Clock::now();  // before the read, so that what follows is never later than it says
  ASSERT_EQ(a->read(bytes), 3U);
  for (int again = 0; again < 2; ++again) {
    // However often it is read: the daemon does so every 2 ms.
    while (UdpPort::Clock::now() - heard < kPatience / 5) ASSERT_EQ(a->read(bytes), 0U);
    static_cast<void>(second->write(frame));  // refused by the kernel: a is connected to the first
    ASSERT_EQ(first->write(frame), 3U);
    heard = UdpPort::Clock::now();
    ASSERT_EQ(a->read(bytes), 3U);
  }
  const auto silent = UdpPort::Clock::now();
  while (UdpPort::Clock::now() - silent <= kPatience) ASSERT_EQ(a->read(bytes), 0U);
  ASSERT_EQ(a->read(bytes), 0U);
  EXPECT_EQ(a->write(Bytes{9}), 0U) << "no peer";
  for (int n = 0; n < 3; ++n) static_cast<void>(second->write(frame));
  EXPECT_EQ(a->read(bytes), 3U);
  ASSERT_EQ(a->write(Bytes{9}), 1U);
  EXPECT_EQ(second->read(bytes), 1U);
}

TEST(UdpPort, OutlivesAPeerThatIsNotThere) {
  std::uint16_t closed_port = 0;
  {
    const auto gone = UdpPort::open({"127.0.0.1", 0}, std::nullopt);
    ASSERT_TRUE(gone);
    closed_port = gone->local_port();
  }
  auto port = UdpPort::open({"127.0.0.1", 0}, UdpPort::Endpoint{"127.0.0.1", closed_port});
  ASSERT_TRUE(port);
  std::array<std::uint8_t, 8> bytes{};
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(port->write(bytes));
    EXPECT_TRUE(port->read(bytes));
  }
}

TEST(UdpPort, NamesAnAddressThatIsNone) {
  EXPECT_EQ(UdpPort::open({"nowhere", 0}, std::nullopt).error().kind, Kind::address);
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
