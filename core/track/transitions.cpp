// SPDX-License-Identifier: BSD-3-Clause
// The supervisor's tables: which mode follows which, when, and what an enable request is refused for.
#include "core/track/supervisor.hpp"

namespace backwash::track {
namespace {

constexpr ModeSet kEnabling = set_of({Mode::enabling}), kTracking = set_of({Mode::tracking});
constexpr ModeSet kHold = set_of({Mode::hold}), kLand = set_of({Mode::land}), kLifting = set_of({Mode::lifting});

// docs/modes.md shows this table; a test compares the two.
constexpr Transition kTransitions[] = {
    // Without a working link or a working clock nothing may be streamed.
    {kCommanding, Reason::port_lost, Mode::quiet},
    {kCommanding, Reason::transmit_full, Mode::quiet},
    {kCommanding, Reason::autopilot_silent, Mode::quiet},
    {kCommanding, Reason::clock_stopped, Mode::quiet},
    {kEnabling, Reason::operator_request, Mode::passive},
    // It is in the air in our mode, as after a restart, and nobody else has it in hand.
    {kEnabling, Reason::land_requested, Mode::land},
    {kEnabling, Reason::stop_requested, Mode::land},
    {kEnabling, Reason::offboard_left, Mode::passive},
    {kEnabling, Reason::odometry_lost, Mode::passive},
    {kEnabling, Reason::odometry_jump, Mode::passive},
    {kEnabling, Reason::odometry_inconsistent, Mode::passive},
    {kEnabling, Reason::pose_silent, Mode::passive},
    {kEnabling, Reason::closure_refused, Mode::passive},
    {kEnabling, Reason::line_slow, Mode::passive},
    {kEnabling, Reason::frame_mismatch_x, Mode::passive},
    {kEnabling, Reason::frame_mismatch_y, Mode::passive},
    {kEnabling, Reason::frame_mismatch_z, Mode::passive},
    {kEnabling, Reason::frame_mismatch_yaw, Mode::passive},
    {kEnabling, Reason::frame_mismatch_roll, Mode::passive},
    {kEnabling, Reason::frame_mismatch_pitch, Mode::passive},
    {kEnabling, Reason::autopilot_follows, Mode::tracking},
    {kEnabling, Reason::enable_timeout, Mode::passive},
    // Below the lowest safe hover height no hold is verified: what ends a lift-off lands.
    {kLifting, Reason::offboard_left, Mode::passive},
    {kLifting, Reason::disarmed, Mode::passive},
    {kLifting, Reason::not_armed, Mode::passive},
    {kLifting, Reason::land_requested, Mode::land},
    {kLifting, Reason::stop_requested, Mode::land},
    {kLifting, Reason::pose_silent, Mode::land},
    {kLifting, Reason::line_slow, Mode::land},
    {kLifting, Reason::odometry_jump, Mode::land},
    {kLifting, Reason::odometry_inconsistent, Mode::land},
    {kLifting, Reason::odometry_frozen, Mode::land},
    {kLifting, Reason::odometry_disorder, Mode::land},
    {kLifting, Reason::odometry_lost, Mode::land},
    {kLifting, Reason::frames_disagree, Mode::land},
    {kLifting, Reason::autopilot_reset, Mode::land},
    {kLifting, Reason::closure_refused, Mode::land},
    {kLifting, Reason::battery_low, Mode::land},
    {kLifting, Reason::obstacle_ahead, Mode::land},
    {kLifting, Reason::air_rougher, Mode::land},
    {kLifting, Reason::outside_map, Mode::land},
    {kLifting, Reason::map_late, Mode::land},
    {kLifting, Reason::outside_column, Mode::land},
    {kLifting, Reason::lift_timeout, Mode::land},
    {kLifting, Reason::lifted_off, Mode::tracking},
    // The autopilot, its pilot and the operator come before everything that we notice.
    {kFollowed, Reason::offboard_left, Mode::passive},
    {kFollowed, Reason::disarmed, Mode::passive},
    {kFollowed, Reason::land_requested, Mode::land},
    {kFollowed, Reason::operator_request, Mode::passive},
    {kHold, Reason::pose_untrusted, Mode::land},
    {kFollowed, Reason::pose_lost, Mode::land},
    {kFollowed, Reason::odometry_jump, Mode::hold},
    {kFollowed, Reason::odometry_inconsistent, Mode::hold},
    {kFollowed, Reason::odometry_frozen, Mode::hold},
    {kFollowed, Reason::odometry_disorder, Mode::hold},
    {kFollowed, Reason::odometry_lost, Mode::hold},
    {kFollowed, Reason::line_slow, Mode::hold},
    {kFollowed, Reason::frames_disagree, Mode::hold},
    {kFollowed, Reason::frames_apart, Mode::hold},
    {kFollowed, Reason::battery_low, Mode::land},
    {kFollowed, Reason::autopilot_reset, Mode::hold},
    {kFollowed, Reason::pose_silent, Mode::hold},
    {kFollowed, Reason::closure_refused, Mode::hold},
    {kFollowed, Reason::stop_requested, Mode::hold},
    {kTracking, Reason::obstacle_ahead, Mode::hold},
    {kTracking, Reason::air_rougher, Mode::hold},
    {kTracking, Reason::outside_map, Mode::hold},
    {kTracking, Reason::map_late, Mode::hold},
    {kTracking, Reason::outside_set, Mode::hold},
    {kTracking, Reason::deadline_missed, Mode::hold},
    {kTracking, Reason::takeoff_accepted, Mode::lifting},
    {kHold, Reason::segment_accepted, Mode::tracking},
    {kLand, Reason::landed, Mode::passive},
    {kLand, Reason::land_sent, Mode::quiet},
};

constexpr Reason kRefusals[] = {
    Reason::port_lost,        Reason::autopilot_silent,   Reason::odometry_lost,       Reason::pose_silent,
    Reason::map_missing,      Reason::outside_map,        Reason::frame_mismatch_x,    Reason::frame_mismatch_y,
    Reason::frame_mismatch_z, Reason::frame_mismatch_yaw, Reason::frame_mismatch_roll, Reason::frame_mismatch_pitch,
    Reason::line_slow,
};

}  // namespace

std::span<const Transition> transitions() noexcept { return kTransitions; }
std::span<const Reason> refusals() noexcept { return kRefusals; }

}  // namespace backwash::track
