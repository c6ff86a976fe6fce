// SPDX-License-Identifier: BSD-3-Clause
// Rows 17 to 20 of docs/faults.md in lockstep: the line.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <random>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/link_watch.hpp"
#include "tests/bridge/pseudo_terminal.hpp"
#include "tests/daemon/lockstep/heartbeats.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

const ServiceManager kNobody;

// But for odometry, which is a sensor and no command.
int frames_out(const Lockstep& rig, std::size_t from) {
  int count = 0;
  for (std::size_t i = from; i < rig.log.size(); ++i) {
    const auto& r = rig.log[i];
    const auto id = [&] { return r.bytes[7] | r.bytes[8] << 8 | r.bytes[9] << 16; };
    count += r.header.kind == log::RecordKind::frame_out && id() != mavlink::Odometry::kId;
  }
  return count;
}

TEST(PortLossFault, UnpluggedIsQuietAtOnceAndAFreshPortResumesNothing) {
  InFlight rig;
  rig.hang_up();
  rig.tick();
  EXPECT_EQ(rig.mode(), Mode::quiet);
  EXPECT_EQ(rig.reason(), Reason::port_lost);
  EXPECT_EQ(rig.channels->link_fault.load(), firmware_bridge::LinkFault::port_lost);
  const std::size_t from = rig.log.size();
  rig.ticks(10);
  EXPECT_EQ(frames_out(rig, from), 0);
  rig.plug_in();
  for (int n = 0; n < 150; ++n) EXPECT_TRUE(rig.tick().silent());
  EXPECT_EQ(rig.mode(), Mode::quiet);
  EXPECT_EQ(rig.channels->link_fault.load(), std::nullopt);
  // The line works again: an operator can take control anew.
  EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
  EXPECT_EQ(rig.ticks_until(Mode::enabling, 3), 1) << to_string(rig.reason());
}

decltype(config::Daemon::link) serial(const std::string& path) {
  decltype(config::Daemon::link) link;
  link.device = path;
  link.endpoint = {config::LinkDevice::Kind::serial, path, 0};
  link.baud = 921600;
  return link;
}

TEST(PortLossFault, TheLinkWatchOpensTheLostPortAgain) {
  firmware_bridge::test::PseudoTerminal line;
  Channels channels;
  LinkWatch watch(channels, serial(line.path()), kNobody);
  watch.step();
  EXPECT_EQ(channels.ports.take(), nullptr);
  channels.link_fault = firmware_bridge::LinkFault::port_lost;
  channels.port_losses = 1;
  watch.step();
  const auto* port = channels.ports.take();
  ASSERT_NE(port, nullptr);
  watch.step();
  EXPECT_EQ(channels.ports.take(), nullptr) << "opened twice";
  channels.ports.give_back(port);
  channels.ports.collect();
}

// Lost from the start: a controller that boots after its companion.
TEST(PortLossFault, APortThatIsMissingAtTheStartIsOpenedWhenItAppears) {
  firmware_bridge::test::PseudoTerminal line;
  const auto path = std::filesystem::temp_directory_path() / ("backwash_late_port_" + std::to_string(::getpid()));
  auto channels = std::make_unique<Channels>();
  firmware_bridge::AutopilotLink link(firmware_bridge::ClosedPort{}, std::uint8_t{1}, firmware_bridge::Time{});
  ControlLoop loop(*channels, link, vehicle_5in(), 0.15);
  LinkWatch watch(*channels, serial(path), kNobody);
  const auto together = [&](std::int64_t t_ns) {
    loop.tick(t_ns, 0, 0);
    watch.step();
  };
  for (std::int64_t n = 0; n < 5; ++n) together(n * 20'000'000);
  EXPECT_EQ(channels->link_fault.load(), firmware_bridge::LinkFault::port_lost);
  std::filesystem::create_symlink(line.path(), path);
  for (std::int64_t n = 5; n < 10; ++n) together(n * 20'000'000);
  std::filesystem::remove(path);
  EXPECT_EQ(channels->link_fault.load(), std::nullopt);
  EXPECT_EQ(channels->port_losses, 1u);
  EXPECT_EQ(loop.view().mode, Mode::passive);
  channels->ports.collect();
}

// Lost, opened again and lost again between two looks of the watch: the fault that it sees has not changed.
TEST(PortLossFault, APortThatIsLostAgainBeforeTheWatchLooksIsOpenedAgain) {
  InFlight rig;
  rig.hang_up();
  rig.ticks(3);
  EXPECT_EQ(rig.channels->port_losses, 1u);
  rig.plug_in();
  rig.hang_up();
  rig.ticks(3);
  EXPECT_EQ(rig.channels->link_fault.load(), firmware_bridge::LinkFault::port_lost);
  EXPECT_EQ(rig.channels->port_losses, 2u);

  firmware_bridge::test::PseudoTerminal line;
  Channels channels;
  LinkWatch watch(channels, serial(line.path()), kNobody);
  for (std::uint32_t losses = 1; losses <= 3; ++losses) {
    channels.link_fault = firmware_bridge::LinkFault::port_lost;
    channels.port_losses = losses;
    watch.step();
    const auto* port = channels.ports.take();
    ASSERT_NE(port, nullptr) << "after loss " << losses;
    channels.ports.give_back(port);
    channels.ports.collect();
  }
}

TEST(LineNoiseFault, GarbageBetweenFramesCostsNoGoodFrameAndNoTick) {
  InFlight rig(0.5);
  std::mt19937 rng(3);
  std::size_t good = 0;
  rig.noise = [&](std::vector<std::uint8_t>& out) {
    // Whole frames of the controller, each behind noise that is full of start bytes and false headers.
    std::vector<std::uint8_t> dirty;
    mavlink::Parser parser;
    parser.feed(out, [&](const mavlink::Frame& f) {
      for (unsigned n = rng() % 40; n > 0; --n) dirty.push_back(rng() % 4 ? static_cast<std::uint8_t>(rng()) : 0xFD);
      dirty.insert(dirty.end(), f.bytes.begin(), f.bytes.end());
      ++good;
    });
    out = dirty;
  };
  const auto accepted = [&](std::size_t from) {
    std::size_t n = 0;
    for (; from < rig.log.size(); ++from) n += rig.log[from].header.kind == log::RecordKind::frame_in;
    return n;
  };
  const std::size_t from = rig.log.size();
  rig.ticks(150);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  EXPECT_EQ(rig.view().shown.samples_outside, 0u);
  rig.noise = nullptr;
  const std::size_t dirty = good;
  const std::size_t until = rig.log.size();
  rig.ticks(20);
  // What a false header held back came with the next bytes: none is lost, none was invented.
  EXPECT_GE(accepted(from), dirty + 20);
  // A false header waits for at most 280 bytes, 13 of the shortest frames.
  EXPECT_LE(dirty - std::min(dirty, accepted(from) - accepted(until)), 13u);
  EXPECT_GT(rig.view().shown.frames_bad, 0u);
}

TEST(LineNoiseFault, AFrameWithABitFlippedIsNeverActedOn) {
  InFlight rig(0.5);
  std::mt19937 rng(4);
  rig.noise = [&](std::vector<std::uint8_t>& out) {
    // Every tick a heartbeat that says "disarmed, manual", damaged in one bit, and a good half of one.
    const auto frame = mavlink::encode_frame({1, 1, 0}, heartbeat(false, 1u << 16));
    std::vector<std::uint8_t> damaged(frame.view().begin(), frame.view().end());
    damaged[1 + rng() % (damaged.size() - 1)] ^= static_cast<std::uint8_t>(1u << rng() % 8);
    out.insert(out.begin(), damaged.begin(), damaged.end());
    out.insert(out.begin(), frame.view().begin(), frame.view().begin() + 12);
  };
  rig.ticks(200);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  EXPECT_GE(rig.view().shown.frames_bad, 150u);
}

TEST(BaudRateFault, AWrongBaudRateIsANamedErrorAfterTwoSeconds) {
  Lockstep rig;
  std::mt19937 rng(5);
  rig.noise = [&](std::vector<std::uint8_t>& out) {
    for (auto& byte : out) byte = static_cast<std::uint8_t>(rng());
  };
  rig.ticks(99);
  EXPECT_EQ(rig.channels->link_fault.load(), std::nullopt);
  rig.ticks(2);
  ASSERT_EQ(rig.channels->link_fault.load(), firmware_bridge::LinkFault::no_valid_frame);
  EXPECT_EQ(name(firmware_bridge::LinkFault::no_valid_frame), "no valid frame (wrong baud rate?)");
  EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
  rig.tick();
  EXPECT_EQ(rig.mode(), Mode::passive);
  EXPECT_EQ(rig.reason(), Reason::autopilot_silent);
}

TEST(FullLineFault, ALineThatTakesNothingIsQuietAtTheSecondMissedSetpointAndTheTickNeverWaits) {
  InFlight rig;
  // Its own failsafe would answer first: of it only its pose is heard.
  int missed_since = 0, ticks = 0;
  mavlink::Parser parser;
  rig.noise = [&](std::vector<std::uint8_t>& out) {
    std::vector<std::uint8_t> kept;
    parser.feed(out, [&](const mavlink::Frame& f) {
      if (f.id == mavlink::LocalPositionNed::kId || f.id == mavlink::AttitudeQuaternion::kId)
        kept.insert(kept.end(), f.bytes.begin(), f.bytes.end());
    });
    if (++ticks % 50 == 1) {
      const auto said = mavlink::encode_frame({1, 1, 0}, heartbeat(true, kOffboard));
      kept.insert(kept.end(), said.view().begin(), said.view().end());
    }
    out = kept;
  };
  rig.unread = true;
  while (rig.mode() != Mode::quiet && ticks < 3000) {
    rig.tick();
    if (rig.mode() != Mode::quiet && rig.link().transmit().missed_setpoints() >= 1) ++missed_since;
  }
  ASSERT_EQ(rig.mode(), Mode::quiet) << to_string(rig.reason());
  EXPECT_EQ(rig.reason(), Reason::transmit_full);
  EXPECT_EQ(missed_since, 2) << "ticks between the first missed set-point and QUIET";
  EXPECT_GT(rig.link().transmit().dropped(), 0u);
  const std::string told = std::to_string(rig.link().transmit().dropped()) + " gave way";
  EXPECT_NE(traffic(rig.link()).find(told), std::string::npos) << traffic(rig.link());
  EXPECT_EQ(rig.link().transmit().waiting(), 0u) << "an old set-point could still follow";
  const std::size_t from = rig.log.size();
  rig.ticks(50);
  EXPECT_EQ(frames_out(rig, from), 0);
}

}  // namespace
}  // namespace backwash::daemon::test
