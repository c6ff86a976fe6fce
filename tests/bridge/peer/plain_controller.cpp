// SPDX-License-Identifier: BSD-3-Clause
// A flight controller of the plain link for the tests: firmware_bridge/plain on the line, as a microcontroller would
// use it, and the bench's emulated vehicle behind it.
//   plain_controller BENCH_PTY PLAIN_PTY
// Ends with SIGTERM; says at its end how many frames it took and refused.
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "firmware_bridge/autopilot_link.hpp"
#include "firmware_bridge/plain/plain.h"
#include "services/bench/pty.hpp"

using namespace backwash;
using namespace backwash::firmware_bridge;
using namespace std::chrono_literals;

namespace {

volatile std::sig_atomic_t stopped = 0;

template <std::size_t N>
Vec3 vec(const float (&v)[N]) {
  return {v[0], v[1], v[2]};
}
template <std::size_t N>
void store(const Vec3& v, float (&into)[N]) {
  for (int i = 0; i < 3; ++i) into[i] = static_cast<float>(v(i));
}

class Controller {
 public:
  Controller(SerialPort vehicle, const std::string& line)
      : line_(line), vehicle_(std::move(vehicle), std::nullopt, std::chrono::steady_clock::now()) {}

  void step(int tick, Time now) {
    now_ = now;
    if (!vehicle_.poll(now)) stopped = 1;
    for (const auto byte : line_.read()) take(plain_receive(&receiver_, byte));
    if (tick % 10 == 0) say_state();
    if (tick % 500 == 0) {
      vehicle_.send_heartbeat();
      for (const auto id : {32U, 31U}) vehicle_.send_message_interval(id, 50);
      for (const auto id : {245U, 331U}) vehicle_.send_message_interval(id, 5);
    }
  }
  void tell() const {
    std::printf("%d set-points, %d poses, %d requests, %d refused\n", setpoints_, poses_, requests_, refused_);
  }

 private:
  void take(plain_event_t event) {
    if (event == PLAIN_REFUSED) ++refused_;
    if (event == PLAIN_COMMAND) {
      plain_command_t c;
      plain_read_command(&receiver_, &c);
      if (c.has_setpoint) {
        ++setpoints_;
        vehicle_.send_setpoint({vec(c.position), vec(c.velocity), vec(c.acceleration), c.yaw}, now_);
      }
      if (c.request != PLAIN_REQUEST_NONE) request(c);
    }
    if (event == PLAIN_POSE) {
      plain_pose_t p;
      plain_read_pose(&receiver_, &p);
      ++poses_;
      VioSample vio{};
      const auto taken = now_.time_since_epoch() - std::chrono::microseconds(100 * p.age_tenths_ms);
      vio.time_us = static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(taken).count());
      vio.p_O = vec(p.position);
      vio.q_OB = Eigen::Quaterniond(p.attitude[0], p.attitude[1], p.attitude[2], p.attitude[3]);
      vio.v_B = vec(p.velocity_b);
      vio.reset_counter = p.reset_counter;
      vehicle_.send_odometry(vio);
    }
  }

  void request(const plain_command_t& c) {
    ++requests_;
    asked_ = {c.sequence, 0, now_};
    // Our duty, whatever the daemon believes (docs/plain_link.md): nothing is disarmed that may be in the air.
    if (c.request == PLAIN_REQUEST_DISARM && !on_ground()) return;
    if (c.request == PLAIN_REQUEST_FOLLOW) {
      vehicle_.send_follow_setpoints();
      asked_.command = kCommandSetMode;
    }
    if (c.request == PLAIN_REQUEST_ARM) {
      vehicle_.send_arm(true);
      asked_.command = kCommandArm;
    }
    if (c.request == PLAIN_REQUEST_DISARM) {
      vehicle_.send_arm(false);
      asked_.command = kCommandArm;
    }
    if (c.request == PLAIN_REQUEST_LAND) {
      vehicle_.send_land();
      asked_.command = kCommandLand;
    }
  }

  bool on_ground() const {
    const auto said = vehicle_.telemetry().landed_state.at(now_);
    return said && said->value == LandedState::on_ground;
  }

  void say_state() {
    const auto& t = vehicle_.telemetry();
    const auto status = t.status.at(now_);
    if (!status) return;
    plain_state_t s{};
    s.sequence = ++sequence_;
    s.armed = status->value.armed;
    s.following = status->value.follows_setpoints;
    s.ground_known = t.landed_state.at(now_).has_value();
    s.on_ground = on_ground();
    if (const auto resets = t.reset_counter.at(now_)) resets_ = resets->value;
    s.reset_counter = resets_;
    if (requests_ > 0 && asked_.command == 0) {
      s.answered = asked_.sequence;
      s.answer = PLAIN_ANSWER_REFUSED;
    } else if (const auto result = t.result_of(asked_.command); result && result->at >= asked_.at) {
      s.answered = asked_.sequence;
      s.answer = result->value.result == 0 ? PLAIN_ANSWER_DONE : PLAIN_ANSWER_REFUSED;
    }
    const auto since = std::chrono::duration_cast<std::chrono::milliseconds>(now_.time_since_epoch());
    s.time_ms = static_cast<std::uint32_t>(since.count());
    const auto position = t.local_state.at(now_);
    const auto attitude = t.attitude.at(now_);
    s.pose_known = position && attitude;
    if (s.pose_known) say_pose(position->value, attitude->value, s);
    s.battery_percent = 255;
    std::array<std::uint8_t, PLAIN_STATE_SIZE> wire;
    plain_write_state(&s, wire.data());
    line_.write(wire);
  }

  static void say_pose(const State& position, const VehicleAttitude& attitude, plain_state_t& s) {
    store(position.p_W, s.position);
    store(position.v_W, s.velocity);
    const auto& q = attitude.q_LB;
    const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
    for (int i = 0; i < 4; ++i) s.attitude[i] = static_cast<float>(wxyz[i]);
    store(attitude.omega_B, s.rates);
  }

  struct Asked {
    std::uint16_t sequence = 0, command = 0;
    Time at{};
  };
  bench::Pty line_;
  AutopilotLink vehicle_;
  Time now_{};
  plain_receiver_t receiver_{};
  Asked asked_;
  std::uint16_t sequence_ = 0;
  std::uint8_t resets_ = 0;
  int setpoints_ = 0, poses_ = 0, requests_ = 0, refused_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 64;
  std::signal(SIGTERM, [](int) { stopped = 1; });
  auto vehicle = SerialPort::open(argv[1], 921600);
  if (!vehicle) {
    std::fprintf(stderr, "%s: %s\n", argv[1], describe(vehicle.error()).c_str());
    return 74;
  }
  Controller controller(std::move(*vehicle), argv[2]);
  for (int tick = 0; stopped == 0; ++tick) {
    controller.step(tick, std::chrono::steady_clock::now());
    ::usleep(2000);
  }
  controller.tell();
  return 0;
}
