// SPDX-License-Identifier: BSD-3-Clause
// TIMESYNC is answered between ticks: an autopilot takes an answer that waits for the tick for useless.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/control_loop.hpp"
#include "services/parallel/real_time.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

using namespace std::chrono_literals;

/// An autopilot on UDP.
class Peer {
 public:
  explicit Peer(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in daemon{};
    daemon.sin_family = AF_INET;
    daemon.sin_port = htons(port);
    daemon.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&daemon), sizeof daemon), 0);
  }
  ~Peer() { ::close(socket_); }

  template <typename Message>
  void say(const Message& message) {
    const auto frame = mavlink::encode_frame({1, 1, sequence_++}, message);
    EXPECT_EQ(::send(socket_, frame.view().data(), frame.view().size(), 0), static_cast<ssize_t>(frame.view().size()));
  }
  /// Whether this question's answer has come.
  bool answered(std::int64_t question) {
    std::array<std::uint8_t, 2048> bytes;
    bool found = false;
    for (ssize_t n = 0; (n = ::recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0;)
      parser_.feed(std::span(bytes).first(static_cast<std::size_t>(n)), [&](const mavlink::Frame& frame) {
        if (frame.id != mavlink::Timesync::kId) return;
        const auto m = mavlink::decode<mavlink::Timesync>(frame.payload);
        found = found || (m.ts1 == question && m.tc1 != 0);
      });
    return found;
  }

 private:
  int socket_;
  std::uint8_t sequence_ = 0;
  mavlink::Parser parser_;
};

TEST(Timesync, IsAnsweredBetweenTwoTicks) {
  auto channels = std::make_unique<Channels>();
  auto port = firmware_bridge::UdpPort::open({"127.0.0.1", 0}, std::nullopt).value();
  Peer peer(port.local_port());
  firmware_bridge::AutopilotLink link(std::move(port), std::nullopt, std::chrono::steady_clock::now());
  ControlLoop loop(*channels, link, vehicle_5in(), 0);
  std::thread control([&] {
    set_fifo(50);
    run_control(*channels, loop);
  });
  const auto ticks = [&] { return channels->pulse.ticks.load(); };
  const auto wait_for_tick = [&] {
    for (const auto before = ticks(); ticks() == before;) std::this_thread::sleep_for(200us);
  };
  peer.say(mavlink::Heartbeat{.autopilot = 12, .base_mode = 1});
  wait_for_tick();
  wait_for_tick();
  constexpr int kQuestions = 40;
  int all = 0, between = 0;
  for (int n = 1; n <= kQuestions; ++n) {
    wait_for_tick();
    const auto asked_in = ticks();
    peer.say(mavlink::Timesync{0, n});
    const auto until = std::chrono::steady_clock::now() + 1s;
    bool answered = false;
    while (!(answered = peer.answered(n)) && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(200us);
    all += answered;
    between += answered && ticks() == asked_in;
  }
  channels->stop = true;
  control.join();
  EXPECT_EQ(all, kQuestions);
  EXPECT_GE(between, kQuestions / 2) << "answers that did not wait for the next tick";
  RecordProperty("between_ticks", between);
}

}  // namespace
}  // namespace backwash::daemon::test
