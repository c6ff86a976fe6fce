// SPDX-License-Identifier: BSD-3-Clause
#include "tests/daemon/lockstep/lockstep_line.hpp"

#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <termios.h>

#include "tests/bridge/pseudo_terminal.hpp"

namespace backwash::daemon::test {

/// A pseudo-terminal and an own look at the daemon's end of it: the kernel moves bytes in its own time.
struct Lockstep::Serial : Line {
  firmware_bridge::test::PseudoTerminal master;
  firmware_bridge::FileDescriptor own{::open(master.path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK)};

  Serial() {
    termios raw{};
    EXPECT_EQ(::tcgetattr(own.get(), &raw), 0);
    ::cfmakeraw(&raw);
    ::tcsetattr(own.get(), TCSANOW, &raw);
  }
  firmware_bridge::Port open() override {
    auto port = firmware_bridge::SerialPort::open(master.path(), 921600);
    if (!port) throw std::runtime_error(describe(port.error()));
    return std::move(*port);
  }
  void write(const std::vector<std::uint8_t>& bytes) override {
    int before = 0, now = 0;
    ::ioctl(own.get(), FIONREAD, &before);
    master.write(bytes);
    for (int i = 0; i < 5000 && now < before + static_cast<int>(bytes.size()); ++i) {
      ::ioctl(own.get(), FIONREAD, &now);
      if (i > 20) ::usleep(200);
    }
    ASSERT_EQ(now, before + static_cast<int>(bytes.size())) << "the pseudo-terminal did not deliver";
  }
  std::vector<std::uint8_t> read(std::size_t expected) override {
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < 5000 && bytes.size() < expected; ++i) {
      const auto more = master.read();
      bytes.insert(bytes.end(), more.begin(), more.end());
      if (i > 20) ::usleep(200);
    }
    const auto surplus = master.read();
    bytes.insert(bytes.end(), surplus.begin(), surplus.end());
    return bytes;
  }
};

/// The flight controller's socket; the daemon's knows it as its one peer.
struct Lockstep::Datagrams : Line {
  static constexpr std::size_t kMost = 480;  // bytes in one: the daemon reads 512
  firmware_bridge::UdpPort controller = firmware_bridge::UdpPort::open({"127.0.0.1", 0}, std::nullopt).value();

  firmware_bridge::Port open() override {
    auto port = firmware_bridge::UdpPort::open(
        {"127.0.0.1", 0}, firmware_bridge::UdpPort::Endpoint{"127.0.0.1", controller.local_port()});
    if (!port) throw std::runtime_error(describe(port.error()));
    // The same port again, which now knows its one peer, and does not let go of it when the daemon is quiet.
    const auto number = controller.local_port();
    controller = firmware_bridge::UdpPort::open({"127.0.0.1", 0}, std::nullopt).value();
    controller = firmware_bridge::UdpPort::open({"127.0.0.1", number},
                                                firmware_bridge::UdpPort::Endpoint{"127.0.0.1", port->local_port()})
                     .value();
    return std::move(*port);
  }
  void write(const std::vector<std::uint8_t>& bytes) override {
    for (std::size_t at = 0; at < bytes.size(); at += kMost) {
      const auto piece = std::span(bytes).subspan(at, std::min(kMost, bytes.size() - at));
      ASSERT_EQ(controller.write(piece).value_or(0), piece.size()) << "the loopback did not deliver";
    }
  }
  std::vector<std::uint8_t> read(std::size_t) override {
    std::vector<std::uint8_t> bytes;
    std::array<std::uint8_t, 2048> datagram;
    for (auto n = controller.read(datagram); n && *n > 0; n = controller.read(datagram))
      bytes.insert(bytes.end(), datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(*n));
    return bytes;
  }
};

std::unique_ptr<Lockstep::Line> Lockstep::make_line() const {
  if (medium_ == Medium::udp) return std::make_unique<Datagrams>();
  return std::make_unique<Serial>();
}

}  // namespace backwash::daemon::test
