// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/port/tcp_port.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/bridge/port_bytes.hpp"

namespace backwash::firmware_bridge::test {
namespace {

using Kind = PortError::Kind;

/// Listens on a free port of the loopback and takes one connection.
class Listener {
 public:
  Listener() {
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof a;
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&a), size), 0);
    EXPECT_EQ(::listen(socket_.get(), 1), 0);
    EXPECT_EQ(::getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&a), &size), 0);
    port_ = ntohs(a.sin_port);
  }
  std::uint16_t port() const { return port_; }
  FileDescriptor accepted() const { return FileDescriptor(::accept(socket_.get(), nullptr, nullptr)); }

 private:
  FileDescriptor socket_{::socket(AF_INET, SOCK_STREAM, 0)};
  std::uint16_t port_ = 0;
};

TEST(TcpPort, CarriesEveryByteValueUnchangedBothWaysAndReportsThatThePeerHasClosed) {
  const Listener listener;
  auto port = TcpPort::open("127.0.0.1", listener.port(), std::chrono::milliseconds(500));
  ASSERT_TRUE(port);
  std::array<std::uint8_t, 512> bytes{};
  EXPECT_EQ(port->read(bytes), 0U) << "nothing yet, and no waiting";
  {
    const FileDescriptor far = listener.accepted();
    ASSERT_EQ(port->write(every_byte()), 256U);
    ASSERT_EQ(::recv(far.get(), bytes.data(), bytes.size(), MSG_WAITALL | MSG_DONTWAIT), 256);
    EXPECT_TRUE(std::ranges::equal(std::span(bytes).first(256), every_byte()));
    ASSERT_EQ(::send(far.get(), every_byte().data(), 256, 0), 256);
    EXPECT_EQ(read_all(*port, 256), every_byte());
  }
  const auto n = port->read(bytes);
  ASSERT_FALSE(n) << "closed by the peer";
  EXPECT_EQ(n.error().kind, Kind::lost);
}

TEST(TcpPort, TakesNoMoreThanTheKernelHasRoomForAndNeverBlocks) {
  const Listener listener;
  auto port = TcpPort::open("127.0.0.1", listener.port(), std::chrono::milliseconds(500));
  ASSERT_TRUE(port);
  const Bytes block(10'000, 0x5A);
  int refused = 0;
  for (int i = 0; i < 2000 && refused == 0; ++i) {
    const auto n = port->write(block);
    ASSERT_TRUE(n);
    refused += *n == 0;
  }
  EXPECT_EQ(refused, 1) << "nobody reads at the far end";
}

// A controller behind a network bridge that was switched off and on while we were quiet: nobody closes, and nothing
// that we send would find out.
TEST(TcpPort, LosesAPeerThatVanishedWhileNothingWasSent) {
  const Listener listener;
  auto port = TcpPort::open("127.0.0.1", listener.port(), std::chrono::milliseconds(500));
  ASSERT_TRUE(port);
  {
    const FileDescriptor far = listener.accepted();
    constexpr int kOn = 1;  // closed so, a connection is gone without a word
    if (::setsockopt(far.get(), IPPROTO_TCP, TCP_REPAIR, &kOn, sizeof kOn) != 0)
      GTEST_SKIP() << "right: a connection cannot be made to vanish without CAP_NET_ADMIN";
  }
  std::array<std::uint8_t, 16> bytes;
  auto n = port->read(bytes);
  EXPECT_TRUE(n) << "it has not been noticed yet";
  for (int i = 0; i < 600 && n; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    n = port->read(bytes);
  }
  ASSERT_FALSE(n) << "after 6 s";
  EXPECT_EQ(n.error().kind, Kind::lost);
}

TEST(TcpPort, NamesWhyItCannotBeOpened) {
  std::uint16_t closed_port = 0;
  { closed_port = Listener().port(); }
  const auto refused = TcpPort::open("127.0.0.1", closed_port, std::chrono::milliseconds(500));
  EXPECT_EQ(refused.error().kind, Kind::open);
  EXPECT_NE(describe(refused.error()).find("refused"), std::string::npos);
  EXPECT_EQ(TcpPort::open("nowhere", 1, std::chrono::milliseconds(1)).error().kind, Kind::address);
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
