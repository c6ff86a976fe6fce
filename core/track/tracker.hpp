// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/plan/verified_stops.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/track/rebase.hpp"
#include "core/types/air_class.hpp"
#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::track {

/// What a plan was made under. It is flown only while nothing has ended that since: an operator's command, or an event
/// after which the vehicle moves on at a later command alone (docs/faults.md row 39).
struct Epoch {
  std::uint64_t order = 0;  ///< number of the operator's newest order to the control thread
  std::uint64_t lapse = 0;  ///< times that the mode itself ended what was planned: every mode but tracking, and every
                            ///< hold but the one for an obstacle
  friend bool operator==(const Epoch&, const Epoch&) = default;
};

/// A piece of flight whose swept tube was verified: commands every 20 ms and the tube propagated once, from the state
/// estimated at acceptance. A segment that `continues` another shares its start and its first `branch` commands and
/// differs after them, so that it can take over in flight without a new start.
struct AcceptedSegment {
  std::uint64_t id = 0;         ///< unique, > 0
  std::uint64_t continues = 0;  ///< id of the segment it continues; 0: starts at its first command
  std::size_t branch = 0;       ///< first command that differs from the continued segment's
  std::vector<Setpoint> commands;
  reach::ReachTube tube;            ///< commands.size() + 1 entries; past its end the last entry holds
  std::vector<plan::Stop> stops{};  ///< ascending by branch; may be empty
  std::uint32_t closures = 0;       ///< loop closures that the map frame it is in has seen
  Epoch epoch{};                    ///< that it was planned under
  bool arms = false;                ///< a take-off that was found clear: the vehicle is armed when it is accepted, and
                                    ///< lifted to where it ends
  std::int64_t seen_ns = 0;         ///< reception of the newest data in the map that it was verified in
  double clearance = 0;             ///< smallest of its swept tube in the map it was verified in, m
  /// By how much the autopilot's frame was off the map when the vehicle rested last, m. No set shrinks that error, so
  /// that clearance is left for it, on the way and at rest. In motion most of what is measured is delay.
  double apart_m = 0;
  AirFactors air = kModelledAir;  ///< of the world that it and its stops were verified in
  /// By a stated risk a position is judged by sets so many times as wide, on the way and at rest: κ of the worst case.
  double worst = 1, worst_at_rest = 1;
  /// Entry n: the same of its sets from command kClearanceEvery · n on, rising; may be empty.
  std::vector<double> clearance_ahead{};
  static constexpr std::size_t kClearanceEvery = 50;
};

/// What one tick says about the measured position (docs/model.md section 5.4).
struct Inside {
  bool judged = false;         ///< false before the first segment: nothing is claimed
  bool inside = true;          ///< |e_n| ≤ h_n in all five directions
  PerDirection error{};        ///< e_n = unit(n)·(measured − centre), m
  PerDirection half_widths{};  ///< h_n, m
  Vec3 center = Vec3::Zero();  ///< m, W
};

/// Steps through accepted segments, one command a tick; holds the last position at rest after the end. In a tick:
/// accept if there is something new, judge the measurement taken now, then step.
class Tracker {
 public:
  /// `initial`: half axes of the first set (docs/model.md section 5): how far the state may have moved since the tube's
  /// start.
  Tracker(const Setpoint& hold, const Vehicle& vehicle);
  /// Takes a segment over, or refuses it: a new one must start where the vehicle is now (its state within the ellipsoid
  /// Q_0 around the tube's start), a continued one must be of the current segment and not yet past its branch. While
  /// braking it must leave the stop on its way, with the commands that are flown until then: one that was made before
  /// the stop began is refused. The segment must outlive its use. `age`: of the state, s. A new segment is then begun
  /// so many commands late, all of which must be at rest where the vehicle was held (docs/model.md 4-14). Real-time:
  /// wait-free, no allocation.
  bool accept(const AcceptedSegment& segment, const State& measured, double age = 0) noexcept;
  /// Holds this command's position from now on; the set of the last segment is no longer judged. Real-time: wait-free,
  /// no allocation.
  void hold_at(const Setpoint& setpoint) noexcept;
  /// The first verified stop that has not been passed, or null. Real-time: wait-free, no allocation.
  const plan::Stop* next_stop() const noexcept;
  /// Flies next_stop() instead of the rest; false, and nothing changes, if there is none. Real-time: wait-free, no
  /// allocation.
  bool brake() noexcept;
  /// The sets still to be flown, in order: those of the segment, then those of the stop it is braking on. Past the end
  /// the last one. Real-time: wait-free, no allocation.
  std::array<std::span<const reach::TubeStep>, 2> ahead() const noexcept;
  /// The map moved under the vehicle (loop closure number `closures`): what was accepted goes on where it physically
  /// is. D = map_new ← map_old. Segments of an older map frame are refused from now on. Real-time: wait-free, no
  /// allocation.
  void rebase(const RigidShift& D, std::uint32_t closures) noexcept;
  /// From the frame of the segment, its stops and ahead() into the map's present one: not the identity only between a
  /// loop closure and the next segment.
  const RigidShift& shift() const noexcept { return shift_; }
  std::uint32_t closures() const noexcept { return closures_; }
  /// Judges the measured position against the set predicted for the moment that it is of, `age` s before this tick
  /// (docs/model.md 4-15), that of the worst case: by a stated risk, errors leave the planner's sets as promised.
  /// Real-time: wait-free, no allocation.
  Inside judge(const Vec3& measured_W, double age = 0) const noexcept;
  /// Judges the measured position against the accepted tube as a whole: the region that was found clear, whenever the
  /// vehicle is where in it. Real-time: wait-free, no allocation; 3 ns per set.
  bool within(const Vec3& measured_W) const noexcept;
  /// Command k of the segment, at rest past its end, in the map frame. Real-time: wait-free, no allocation.
  Setpoint at(std::size_t k) const noexcept { return segment_ ? shift_.setpoint(command(k)) : hold_; }
  /// The tube's last set, or null. Real-time: wait-free, no allocation.
  const reach::TubeStep* last_set() const noexcept { return segment_ ? &segment_->tube.back() : nullptr; }
  /// Command of this tick, then moves on. Real-time: wait-free, no allocation.
  Setpoint step() noexcept;
  bool finished() const noexcept { return !segment_ || next_ >= end(); }
  bool braking() const noexcept { return stop_ != nullptr; }
  std::size_t stop_branch() const noexcept { return stop_ ? stop_->branch : 0; }  ///< of the stop it is braking on
  std::uint64_t segment() const noexcept { return segment_ ? segment_->id : 0; }
  std::int64_t seen_ns() const noexcept { return segment_ ? segment_->seen_ns : 0; }
  std::size_t index() const noexcept { return next_; }  ///< of the command that the next step() gives
  /// Of the accepted tube from the next command on, to a second, beyond what the frames are apart, m.
  double clearance() const noexcept;
  double apart_m() const noexcept { return segment_ ? segment_->apart_m : 0; }  ///< the segment's
  const Setpoint& held() const noexcept { return hold_; }

 private:
  std::size_t end() const noexcept;
  Setpoint command(std::size_t k) const noexcept;  // in the segment's frame, at rest past the end
  bool leaves_stop(const AcceptedSegment& segment) const noexcept;
  const reach::TubeStep& set(std::size_t k) const noexcept;
  double worst(std::size_t k) const noexcept;
  Inside judge(const Vec3& measured_W, const Vec3& center, const PerDirection& half_widths,
               double worst) const noexcept;

  const AcceptedSegment* segment_ = nullptr;
  const plan::Stop* stop_ = nullptr;  ///< of segment_: what is flown from its branch on
  static constexpr std::size_t kMostPast = 1000;
  std::size_t next_ = 0;
  std::size_t past_ = 0;  ///< commands given after next_ came to lie past the end, at most kMostPast
  Setpoint hold_;
  RigidShift shift_;  ///< map ← the segment's frame
  std::uint32_t closures_ = 0;
  double position_, velocity_;
};

}  // namespace backwash::track
