// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace backwash::fuzz {

/// One thing that happens to the daemon from outside, at a tick. `n`, `a` … `d`: as its kind says.
struct Event {
  enum class Kind : std::uint8_t {
    // The operator; a, b, c: shares of the room, 0…1.
    operate,      ///< what an operator would ask for next, by the daemon's state; n: a draw
    command,      ///< verb n, whatever the state
    foreign,      ///< verb n of another station
    repeated,     ///< the last command once more
    old_number,   ///< verb n with an old sequence number
    new_session,  ///< verb n of a new session of the same station
    departed,     ///< writer n of commands is gone
    // The VIO, for n ticks.
    vio_off,
    vio_shift,  ///< by a, b, c m
    vio_turn,   ///< position, velocity and attitude, by a rad
    vio_scale,  ///< by the factor a, about the place where it begins
    vio_drift,  ///< at a, b, c m/s
    vio_freeze,
    vio_late,    ///< stamp and values a s old
    vio_stamp,   ///< its clock is a s ahead
    vio_repeat,  ///< the stamp stands still
    vio_nan,     ///< member b of position, velocity, quaternion (0…9)
    vio_huge,    ///< member b is a
    // The map.
    closure,  ///< by a, b, c m and d rad
    map_same,
    map_box,        ///< with a box at a, b, c (shares of the room)
    map_elsewhere,  ///< of another place
    map_damaged,    ///< n changed bytes
    map_resolution,
    scan_box,  ///< a scan that finds one
    // The line; for n ticks where it lasts.
    noise,      ///< n bytes that are no frames
    damage,     ///< every a-th byte is changed
    swap,       ///< the two halves of what the autopilot sends change places
    mute,       ///< the autopilot says nothing
    deaf,       ///< no LOCAL_POSITION_NED or ATTITUDE arrives
    heartbeat,  ///< a forged one: n bit 0 armed, bit 1 offboard
    take_over,
    disarm,
    ack,            ///< of command n, result b
    position,       ///< a LOCAL_POSITION_NED with a in member b (0…5)
    attitude,       ///< an ATTITUDE_QUATERNION that is none
    battery,        ///< a of it remains
    timesync,       ///< asks for our clock
    reset,          ///< the autopilot's frame moves by a, b, c m and d rad
    reset_counter,  ///< an ODOMETRY that counts n resets
    parameter,      ///< PARAM_VALUE of a
    // The stop switch, for n ticks; a sequence without these has none.
    switch_pressed,
    switch_broken,  ///< b modulo 3: lost, untested, chattering
    // The daemon's own.
    missed,        ///< n periods
    slow_planner,  ///< n ticks until it looks again
    late_segment,  ///< what it offers arrives n ticks later
    slow_mission,  ///< n ticks without a look at commands and outcomes
    restart,
    hang_up,
    plug_in,
    kinds
  };
  int tick = 0;
  Kind kind = Kind::operate;
  int n = 0;
  double a = 0, b = 0, c = 0, d = 0;
};

/// `ticks` long: an operator who flies, and what disturbs him. The same for a seed each time.
std::vector<Event> sequence(std::uint64_t seed, int ticks);

/// One line that a regression test can hold: `{tick, Kind::name, n, a, b, c, d},`.
std::string describe(const Event& event);

}  // namespace backwash::fuzz
