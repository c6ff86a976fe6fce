// SPDX-License-Identifier: BSD-3-Clause
#include "tests/fuzz/sequence/watch.hpp"

#include <cmath>
#include <cstdio>

#include "backwash_msgs.h"

namespace backwash::fuzz {
namespace {

constexpr int kRequests = 16 + 2;        // ticks until the control thread has taken every request that can wait
constexpr int kBraking = 100;            // ticks that a verified stop takes at most, with the way to its branch
constexpr int kRest = 25;                // ticks without motion: the way is over
constexpr int kDisarming = 170;          // ticks for which a stop on the ground asks to disarm
constexpr int kNewFrame = 3;             // ticks in which a reset of the autopilot's frame shows
constexpr double kStill = 2e-5;          // m in a tick: single precision some metres from the origin
constexpr double kRounding = 1e-3;       // m in a tick; v_max is per axis
constexpr double kDecelerations = 1.75;  // of a_max, in all three axes
constexpr double kOffWay = 3e-3;         // m in a tick

std::string line(const char* format, auto... values) {
  char text[200];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace

void Watch::acknowledged(std::uint8_t verb, int tick) {
  switch (verb) {
    case backwash_msgs_msg_dds__COMMAND_STOP:
      licence_ = Licence::stopping;
      stopped_ = disarm_from_ = tick;
      may_arm_ = false;
      break;
    case backwash_msgs_msg_dds__COMMAND_LAND:
    case backwash_msgs_msg_dds__COMMAND_DISABLE:
      licence_ = Licence::stopping;
      stopped_ = left_ = tick;
      if (verb == backwash_msgs_msg_dds__COMMAND_DISABLE) disarm_from_ = tick;
      may_arm_ = false;
      break;
    case backwash_msgs_msg_dds__COMMAND_HOLD:
      if (licence_ == Licence::flying) licence_ = Licence::slowing;
      may_arm_ = false;
      rested_ = 0;
      break;
    case backwash_msgs_msg_dds__COMMAND_ENABLE:
      licence_ = Licence::none;
      stopped_ = left_ = -1;
      may_arm_ = false;
      break;
    case backwash_msgs_msg_dds__COMMAND_TAKEOFF:
    case backwash_msgs_msg_dds__COMMAND_GOTO:
    case backwash_msgs_msg_dds__COMMAND_GOTO_FACING:
    case backwash_msgs_msg_dds__COMMAND_FOLLOW:
    case backwash_msgs_msg_dds__COMMAND_FOLLOW_FACING:
      licence_ = Licence::flying;
      stopped_ = -1;
      may_arm_ = verb == backwash_msgs_msg_dds__COMMAND_TAKEOFF;
      break;
    default:
      break;
  }
}

void Watch::stop_given(int tick) {
  if (last_.mode != Mode::passive && last_.mode != Mode::quiet) disarm_from_ = tick;
}

void Watch::restarted() {
  const int moved = frame_moved_;
  const auto a_max = a_max_;
  *this = Watch(v_max_);
  a_max_ = a_max;
  frame_moved_ = moved;
}

// A pilot's change of mode, and a disarmed vehicle, end whatever was asked for.
void Watch::hear_pilot(const Seen& now) {
  // A lift-off that ended may disarm what stands.
  if (last_.mode == Mode::lifting && now.mode == Mode::land) disarm_from_ = now.tick;
  const bool followed = last_.mode == Mode::tracking || last_.mode == Mode::hold || last_.mode == Mode::lifting;
  if (!followed || !((last_.offboard && !now.offboard) || (last_.armed && !now.armed))) return;
  licence_ = Licence::none;
  left_ = now.tick;
  may_arm_ = false;
}

// A switch that is pressed or broken is a STOP, of no latency, for as long as it is so.
std::optional<std::string> Watch::hear_switch(const Seen& now) {
  if (!now.switched_off) return std::nullopt;
  if (last_.mode != Mode::passive && last_.mode != Mode::quiet && last_.mode != Mode::land) {
    if (licence_ != Licence::none) licence_ = Licence::stopping;
    if (stopped_ < 0) stopped_ = now.tick;
    disarm_from_ = now.tick;
  }
  may_arm_ = false;
  if (now.mode == Mode::enabling || now.mode == Mode::lifting || now.mode == Mode::tracking)
    return line("%s beside a stop switch that does not let it", to_string(now.mode));
  return std::nullopt;
}

std::optional<std::string> Watch::silence(const Seen& now) const {
  if (now.mode == Mode::quiet && last_.mode == Mode::quiet && now.bytes > 0)
    return line("QUIET sent %zu bytes", now.bytes);
  if (now.mode == Mode::quiet && now.setpoints > 0) return "QUIET sent a set-point";
  if (now.mode == Mode::passive && now.setpoints > 0) return "passive sent a set-point";
  if (now.mode == Mode::passive && now.armed && now.commands > 0) return "passive commanded an armed vehicle";
  if (now.mode == Mode::land && now.setpoints > 0) return "landing sent a set-point";
  if (left_ >= 0 && now.tick > left_ + kRequests && now.setpoints > 0)
    return line("a set-point %d ticks after control was given away", now.tick - left_);
  if (now.setpoints > 1) return line("%d set-points in one tick", now.setpoints);
  return std::nullopt;
}

std::optional<std::string> Watch::arming(const Seen& now) {
  if (now.disarms && now.tick > disarm_from_ + kDisarming) return "disarmed without a stop or disable";
  if (!now.arms) return std::nullopt;
  if (!may_arm_) return "armed without a take-off that was asked for";
  if (!now.accepted) return "armed in a tick that accepted no segment";
  may_arm_ = false;
  return std::nullopt;
}

std::optional<std::string> Watch::motion(const Seen& now) {
  if (stopped_ >= 0 && now.tick > stopped_ + kRequests &&
      (now.mode == Mode::tracking || now.mode == Mode::enabling || now.mode == Mode::lifting))
    return line("%s %d ticks after an acknowledged stop", to_string(now.mode), now.tick - stopped_);
  if (now.setpoints == 0 || last_.setpoints == 0) {
    rested_ = 0;
    return std::nullopt;
  }
  const double step = (now.setpoint - last_.setpoint).norm();
  rested_ = step > kStill ? 0 : rested_ + 1;
  if (now.tick <= frame_moved_ + kNewFrame) return std::nullopt;  // the same place, told in another frame
  // A take-off begins where the vehicle stands, whatever was held above it.
  if (now.accepted && !now.armed) return std::nullopt;
  if (!(step <= std::sqrt(3.0) * v_max_ * kControlPeriod + kRounding)) return line("a set-point step of %.3f m", step);
  if (licence_ == Licence::stopping && now.tick > stopped_ + kRequests + kBraking) licence_ = Licence::none;
  if (licence_ == Licence::slowing && rested_ >= kRest) licence_ = Licence::none;
  if (licence_ == Licence::none && step > kStill) return line("a set-point moved by %.4f m unasked", step);
  if (now.mode == Mode::tracking && last_.mode == Mode::tracking && step > kStill && !now.inside)
    return "a set-point outside the map";
  return std::nullopt;
}

// A stop within a hold asks for both their decelerations, along both axes of a flight.
std::optional<std::string> Watch::smoothness(const Seen& now) const {
  if (!a_max_) return std::nullopt;
  const bool flies = now.mode == Mode::tracking || now.mode == Mode::hold;
  if (!flies || now.setpoints == 0 || last_.setpoints == 0 || (now.accepted && !now.armed)) return std::nullopt;
  const double change = (now.velocity - last_.velocity).norm();
  if (!(change <= kDecelerations * *a_max_ * kControlPeriod))
    return line("the set-point's velocity changes by %.3f m/s", change);
  const double off = (now.setpoint - last_.setpoint - kControlPeriod / 2 * (now.velocity + last_.velocity)).norm();
  if (!(off <= kOffWay)) return line("a set-point %.4f m off its way", off);
  return std::nullopt;
}

std::optional<std::string> Watch::check(const Seen& now) {
  if (!started_) {
    last_ = now;
    started_ = true;
  }
  hear_pilot(now);
  auto broken = hear_switch(now);
  if (!broken) broken = silence(now);
  if (!broken) broken = arming(now);
  if (!broken) broken = motion(now);
  if (!broken) broken = smoothness(now);
  last_ = now;
  return broken;
}

}  // namespace backwash::fuzz
