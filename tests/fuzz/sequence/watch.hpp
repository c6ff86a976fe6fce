// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/track/supervisor.hpp"
#include "core/types/state.hpp"

namespace backwash::fuzz {

/// What a tick of the daemon showed to the outside.
struct Seen {
  int tick = 0;
  Mode mode = Mode::passive;
  bool armed = false, offboard = false;  ///< as the autopilot's last heartbeat said
  std::size_t bytes = 0;                 ///< sent; 0 if it was odometry alone, a sensor and no command
  int setpoints = 0, commands = 0;       ///< sent; commands without those to disarm
  Vec3 setpoint = Vec3::Zero();          ///< the last one, in the autopilot's local frame, m
  Vec3 velocity = Vec3::Zero();          ///< of that set-point, m/s
  bool arms = false, disarms = false;    ///< the vehicle was told to
  bool switched_off = false;             ///< the stop switch does not let the vehicle be flown
  bool accepted = false;                 ///< a new segment was accepted
  bool inside = true;                    ///< the command lies in the newest map
};

/// What must hold at every tick, whatever happens.
class Watch {
 public:
  /// `v_max` of the vehicle, m/s.
  explicit Watch(double v_max) : v_max_(v_max) {}

  /// Verb (COMMAND_…) of the holder's command that was accepted in this tick.
  void acknowledged(std::uint8_t verb, int tick);
  /// A stop that is answered by no more than what is already so (landing): it may still disarm what stands.
  void stop_given(int tick);
  /// The autopilot's estimator was reset or leapt, or a message of it said so: for three ticks a leap is not judged.
  void frame_moved(int tick) { frame_moved_ = tick; }
  /// From now on nothing but an operator disturbs the flight: the set-point goes on where its velocity leads, which an
  /// acceleration that `a_max`, m/s², allows may change.
  void operated_only(double a_max) { a_max_ = a_max; }
  /// The daemon was started anew.
  void restarted();
  /// The first promise that this tick broke.
  std::optional<std::string> check(const Seen& now);

 private:
  enum class Licence { none, stopping, slowing, flying };
  std::optional<std::string> silence(const Seen& now) const;
  std::optional<std::string> arming(const Seen& now);
  std::optional<std::string> motion(const Seen& now);
  std::optional<std::string> smoothness(const Seen& now) const;
  void hear_pilot(const Seen& now);
  std::optional<std::string> hear_switch(const Seen& now);

  double v_max_;
  std::optional<double> a_max_;
  Seen last_;
  bool started_ = false;
  Licence licence_ = Licence::none;
  int stopped_ = -1;  ///< tick of the last stop that no later command has ended
  int left_ = -1;     ///< tick in which the autopilot, or its pilot, took control or was asked to land
  int rested_ = 0;    ///< ticks in a row in which the set-point did not move
  int frame_moved_ = -1000;
  int disarm_from_ = -1000;  ///< tick of the last stop or disable
  bool may_arm_ = false;     ///< a take-off was asked for, and neither flown yet nor cancelled
};

}  // namespace backwash::fuzz
