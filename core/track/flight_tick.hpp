// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "core/track/frame_alignment.hpp"
#include "core/track/odometry_gate.hpp"
#include "core/track/supervisor.hpp"
#include "core/track/tracker.hpp"
#include "core/types/angle.hpp"

namespace backwash::track {

/// What the autopilot says, as far as a tick decides by it. What it has not said lately enough is not known.
struct AutopilotFacts {
  bool port_open = true;
  bool transmit_failed = false;  ///< two set-points in a row did not get out
  bool line_slow = false;        ///< what it says, or what it is told, takes longer than the sets are computed for
  bool armed = false;            ///< unless it says that it is not
  bool offboard = false;
  std::optional<bool> landed, in_air;                              ///< as it says itself; neither: between the two
  bool lifts_itself = false;                                       ///< takes off by a command of its own
  bool takeoff_taken = false;                                      ///< and has acknowledged that one since it was asked
  double heartbeat_age = std::numeric_limits<double>::infinity();  ///< s
  struct Pose {
    std::int64_t at_ns = 0;  ///< when the controller took the position; when it arrived, if its clock is not known
    State state;             ///< in the controller's local frame, z-up
    std::array<double, 4> q{1, 0, 0, 0};  ///< body to local: w, x, y, z
    std::int64_t attitude_at_ns = 0;      ///< the same of the attitude
    Vec3 omega_B = Vec3::Zero();          ///< rad/s, as the gyros measure it
  };
  std::optional<Pose> pose;
  /// s, of the older of its position and its attitude; infinite before the first.
  double pose_age(std::int64_t now_ns) const noexcept;
  std::optional<std::uint8_t> reset_counter;  ///< of its estimator
  std::optional<double> battery;              ///< remaining share, 0…1
};

/// What the map says about this tick.
struct Surroundings {
  bool missing = false;       ///< no map was received yet
  bool outside = false;       ///< the newest pose is outside the map (outside counts as occupied)
  bool late = false;          ///< a live map is older than it may be
  bool tube_blocked = false;  ///< new occupied voxels reach into Tracker::ahead()
  bool stop_blocked = false;  ///< and into Tracker::next_stop()
  bool rougher = false;       ///< what is ahead is not clear any more in the air as it was learnt
};

/// Everything that a tick decides from. Two ticks with equal inputs in equal states decide bit for bit alike.
struct TickInput {
  std::int64_t now_ns = 0;                   ///< CLOCK_MONOTONIC
  int missed_periods = 0;                    ///< whole periods skipped before this tick
  std::optional<OdometrySample> odometry;    ///< newest since the last tick
  Request request = Request::none;           ///< of the operator
  std::uint64_t order = 0;                   ///< number of the newest order, 0: none new
  const AcceptedSegment* segment = nullptr;  ///< offered since the last tick
  AutopilotFacts autopilot;
  Surroundings surroundings;
  /// Of odometry and autopilot's estimate against each other, as both say themselves, m; none: one does not say.
  std::optional<float> position_sigma;
};

/// What a tick decided.
struct TickOutput {
  SupervisorOutput supervisor;
  Setpoint command;        ///< sent or held, map frame
  Setpoint command_local;  ///< the same in the controller's frame
  bool finite = true;      ///< command_local is all numbers; else it must not be sent
  OdometryGate::Verdict verdict = OdometryGate::Verdict::good;  ///< of the tick's sample, if there was one
  bool fresh = false;                                           ///< there was a good sample
  bool arm = false;                                             ///< ask the autopilot to arm
  bool disarm = false;                                          ///< ask it to disarm: it stands on the ground
  /// On the ground or not, by the autopilot's words and the vehicle's height; none: nobody knows.
  std::optional<bool> landed;
  std::optional<double> takeoff;     ///< ask it to take off by itself to this height above here, m
  bool forward_odometry = false;     ///< the tick's sample is good: the autopilot's estimator gets it
  std::uint8_t odometry_resets = 0;  ///< times that the odometry began anew elsewhere
  Inside inside;
  std::uint64_t judged_segment = 0, judged_index = 0;  ///< the set that `inside` is about
  bool accepted = false, refused = false;              ///< the offered segment
  /// Segments that are not used any more, to be given back to their owner; null where there are fewer.
  std::array<const AcceptedSegment*, 2> released{};
};

/// A state and an attitude (body to its frame: w, x, y, z) as a pose in that frame; the heading's rate is not known.
FramePose pose_of(const State& state, const std::array<double, 4>& q) noexcept;

/// The decisions of the 50 Hz tick: odometry gate, frames, tracker, supervisor and set-point, without any input or
/// output of its own. The daemon's control thread and `backwash replay` run the same object.
class FlightTick {
 public:
  /// A loop closure that moves a flying vehicle in the map by more is not flown: drift is corrected in steps of
  /// decimetres and degrees, and the tubes of a room are narrower than this.
  static constexpr double kMaxClosure = 1.0;               ///< m
  static constexpr double kMaxClosureTurn = 10 * kDegree;  ///< rad
  /// More samples in a row whose stamp does not rise are as no odometry at all (docs/faults.md row 5).
  static constexpr int kDisorder = 3;
  /// What the frames may come apart in flight, whatever the two estimates claim, m: one that boasts is not believed to
  /// the millimetre, and one that knows nothing excuses nothing.
  static constexpr double kLeastApart = 0.10, kMostApart = 0.25;

  /// `battery_land`: remaining share below which LAND is asked for once; 0: never. `timing`: of the odometry. `law`: of
  /// its pose against its twist.
  FlightTick(const Vehicle& vehicle, double battery_land, const OdometryTiming& timing = {}, const DriftLaw& law = {});

  /// One tick. Real-time: wait-free, no allocation.
  TickOutput step(const TickInput& in) noexcept;

  Mode mode() const noexcept { return supervisor_.mode(); }
  /// The last good odometry.
  const std::optional<OdometrySample>& odometry() const noexcept { return gate_.last(); }
  const FrameAlignment& alignment() const noexcept { return alignment_; }
  const Tracker& tracker() const noexcept { return tracker_; }
  double odometry_age() const noexcept { return odometry_age_; }  ///< s, at the last tick, beyond the latency
  const OdometryTiming& timing() const noexcept { return timing_; }
  /// s without a good sample until HOLD.
  double odometry_lost_after() const noexcept { return supervisor_.hold_after(); }
  /// A segment of another one is refused.
  const Epoch& epoch() const noexcept { return epoch_; }

 private:
  struct Odometry {
    OdometryGate::Verdict verdict = OdometryGate::Verdict::good;
    bool fresh = false;
  };
  struct Judged {
    Inside inside{};
    std::uint64_t segment = 0, index = 0;
  };
  struct Motors {
    bool arm = false, disarm = false;
    std::optional<double> takeoff;  // m
  };

  std::optional<OdometrySample> in_frame_flown(std::optional<OdometrySample> sample) noexcept;
  Odometry believed(const TickInput& in, const std::optional<OdometrySample>& sample) noexcept;
  void align(const TickInput& in, bool fresh) noexcept;
  bool accepts(const TickInput& in) noexcept;
  void watch_floor(const TickInput& in, bool fresh) noexcept;
  Judged judge(const TickInput& in, bool fresh) noexcept;
  SupervisorInput facts(const TickInput& in, OdometryGate::Verdict verdict, bool accepted) noexcept;
  /// Whether the segment stays the tracker's.
  bool follow(const TickInput& in, Mode before, bool accepted, const SupervisorOutput& reaction) noexcept;
  void remember(const TickInput& in, const SupervisorOutput& reaction) noexcept;
  Setpoint commanded(Mode now) noexcept;
  Motors ask_of_motors(const TickInput& in, Mode before, bool accepted, const SupervisorOutput& s) noexcept;
  bool stands(const TickInput& in) const noexcept;
  bool lifted(const TickInput& in) noexcept;
  bool feeds(const TickInput& in, bool fresh, Mode now) noexcept;

  double sample_age(std::int64_t now_ns) const noexcept;
  void remember_tilt(const AutopilotFacts::Pose& pose, const Vec3& up_B) noexcept;
  Vec3 tilt_at(std::int64_t ns, const Vec3& newest_B) const noexcept;
  double apart(const TickInput& in) const noexcept;
  bool frames_apart(const TickInput& in) const noexcept;

  struct Tilt {
    std::int64_t at_ns = 0;
    Vec3 up_B = Vec3::UnitZ();
  };
  static constexpr std::size_t kTilts = 16;  ///< 0.3 s of the autopilot's attitude at 50 Hz

  double battery_land_, sigma_;
  OdometryTiming timing_;
  OdometryGate gate_;
  FrameAlignment alignment_;
  Supervisor supervisor_;
  Tracker tracker_;
  const AcceptedSegment* segment_ = nullptr;  ///< the tracker's
  Epoch epoch_;
  int arming_ = 0;     ///< ticks left in which the autopilot may yet say that it armed
  int abandoned_ = 0;  ///< ticks left in which motors that start for a take-off that was stopped are stopped again
  /// Height at which the vehicle stood when it was last seen disarmed, m, map frame; none: it was not seen, or the
  /// odometry began anew since. And whether it was elsewhere since, or a flight was begun.
  std::optional<double> floor_;
  bool left_floor_ = false;
  bool battery_low_ = false;           ///< when it was last said
  std::uint32_t closures_ = 0;         ///< of the map frame that is flown in
  RigidShift map_from_odom_;           ///< of that
  std::uint32_t closure_refused_ = 0;  ///< the last one that is not flown; closures_: none
  bool closure_refused_now_ = false;
  double closed_m_ = 0, closed_rad_ = 0;  ///< by the closures that were flown lately, fading
  Setpoint command_;                      ///< of the last tick
  bool was_commanding_ = false, reset_ = false;
  bool odometry_distrusted_ = false;  ///< since a fault of the odometry, until nothing is commanded any more
  bool feed_distrusted_ = false;      ///< since then, until the vehicle is disarmed or follows us again
  std::uint8_t odometry_resets_ = 0;
  std::size_t lift_ticks_ = 0;                ///< since the take-off was accepted
  int off_ground_ = 0;                        ///< ticks of a lift-off that the autopilot does not call landed
  int settled_ = 0;                           ///< ticks in the air at its height
  int disorder_ = 0;                          ///< samples in a row whose stamp did not rise
  std::optional<std::int64_t> last_good_ns_;  ///< reception, less what it was late
  std::optional<std::int64_t> last_pose_ns_, last_attitude_ns_;
  std::optional<std::uint8_t> reset_counter_;
  double odometry_age_ = std::numeric_limits<double>::infinity();
  Inside verdict_;                    ///< of the newest sample that was judged against what flies
  std::array<Tilt, kTilts> tilts_{};  ///< the autopilot's newest, as a ring; of late odometry alone
  std::size_t next_tilt_ = 0;
};

}  // namespace backwash::track
