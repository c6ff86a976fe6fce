// SPDX-License-Identifier: BSD-3-Clause
// Our end of the test against an independent MAVLink library: an AutopilotLink at 50 Hz on a serial line (two
// pseudo-terminals and a relay between them) or on UDP. Says where the other end is to be found, and at its end, as one
// line of JSON, what it heard.
//   link_peer pty|udp [KEY_HEX]
// Ends with SIGTERM.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <string>

#include "firmware_bridge/autopilot_link.hpp"
#include "services/bench/pty.hpp"

using namespace backwash;
using namespace backwash::firmware_bridge;
using namespace std::chrono_literals;

namespace {

volatile std::sig_atomic_t stopped = 0;

/// A serial line of two pseudo-terminals: what is written into one comes out of the other.
struct Line {
  std::string name = std::filesystem::temp_directory_path() / ("backwash_link_peer_" + std::to_string(::getpid()));
  bench::Pty ours{name + "a"}, theirs{name + "b"};
  void carry() {
    ours.write(theirs.read());
    theirs.write(ours.read());
  }
};

mavlink::SigningKey key_of(const std::string& hex) {
  mavlink::SigningKey key{};
  for (std::size_t i = 0; i < key.size(); ++i)
    key[i] = static_cast<std::uint8_t>(std::stoul(hex.substr(2 * i, 2), nullptr, 16));
  return key;
}

Setpoint setpoint() {
  Setpoint s;
  s.p_W = {1, 2, 3};
  s.v_W = {0.5, -0.25, 0.125};
  s.a_W = {-1, 0, 1};
  s.yaw = 0.5;
  return s;
}

void speak(AutopilotLink& link, int tick, Time now) {
  link.send_setpoint(setpoint(), now);
  if (tick % 50 == 0) link.send_heartbeat();
  if (tick % 10 == 1) link.send_timesync(now);
  if (tick % 50 == 2) link.send_arm(true);
  if (tick % 50 == 3) link.send_statustext(5, "of an independent peer");
  if (tick % 50 == 4) link.send_parameter_request(0);
  VioSample vio{};
  vio.p_O = {4, 5, 6};
  vio.q_OB = Eigen::Quaterniond::Identity();
  vio.v_B = Vec3::Zero();
  if (tick % 5 == 0) link.send_odometry(vio);
}

void tell(const AutopilotLink& link, Time now) {
  const auto& t = link.telemetry();
  const auto status = t.status.at(now);
  const auto position = t.local_state.at(now);
  const auto battery = t.battery.at(now);
  const Vec3 p = position ? position->value.p_W : Vec3::Zero();
  const auto ack = t.result_of(kCommandArm);
  const auto parameter = t.parameters()[0].value;
  const mavlink::SigningCounters none;
  const auto& counted = link.signing() ? link.signing()->counters() : none;
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf(R"({"vehicle": %d, "armed": %d, "position": [%g, %g, %g], "attitude": %d, "arm": %d, "parameter": %g, )"
              R"("voltage": %g, "clock": %d, "frames": %llu, "bad_crc": %llu, "skipped": %llu, "sent": %llu, )"
              R"("good": %llu, "unsigned": %llu, "wrong": %llu, "replayed": %llu})"
              "\n",
              link.vehicle().value_or(0), status && status->value.armed, p.x(), p.y(), p.z(),
              t.attitude.at(now).has_value(), ack ? ack->value.result : -1, parameter.value_or(-1),
              battery && battery->value.voltage ? *battery->value.voltage : -1, link.clock(now).has_value(),
              count(link.received().frames), count(link.received().bad_crc), count(link.received().skipped_bytes),
              count(link.transmit().sent()), count(counted.good), count(counted.unsigned_frames),
              count(counted.wrong_signature), count(counted.replayed));
}

tl::expected<Port, PortError> open(const std::optional<Line>& line) {
  const auto as_port = [](auto&& p) { return Port(std::move(p)); };
  if (line) return SerialPort::open(line->name + "a", 921600).map(as_port);
  auto port = UdpPort::open({"127.0.0.1", 0}, std::nullopt);
  if (port) std::printf("%d\n", port->local_port());
  return std::move(port).map(as_port);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 64;
  std::signal(SIGTERM, [](int) { stopped = 1; });
  const std::string kind = argv[1];
  std::optional<Line> line;
  if (kind == "pty") {
    line.emplace();
    std::printf("%sb\n", line->name.c_str());
  }
  auto port = open(line);
  std::fflush(stdout);
  if (!port) {
    std::fprintf(stderr, "%s\n", describe(port.error()).c_str());
    return 74;
  }
  const Time start = std::chrono::steady_clock::now();
  AutopilotLink link(std::move(*port), std::nullopt, start);
  if (argc > 2) {
    const auto since_2015 = std::chrono::system_clock::now().time_since_epoch() - 1'420'070'400s;
    const auto time = std::chrono::duration_cast<std::chrono::microseconds>(since_2015).count() / 10;
    link.require_signatures(mavlink::Signing(key_of(argv[2]), 0, static_cast<mavlink::SigningTime>(time)), start);
  }
  for (int tick = 0; stopped == 0; ++tick) {
    for (int i = 0; i < 4; ++i) {
      if (line) line->carry();
      ::usleep(5000);
    }
    const Time now = std::chrono::steady_clock::now();
    if (!link.poll(now)) return 74;
    speak(link, tick, now);
  }
  tell(link, std::chrono::steady_clock::now());
  return 0;
}
