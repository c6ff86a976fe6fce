// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

namespace backwash::firmware_bridge {

/// What the stop switch says. Only released may be flown on; without a configured switch nothing is asked.
enum class SwitchState : std::uint8_t {
  absent,      ///< none is configured
  lost,        ///< the line cannot be read
  untested,    ///< not yet seen in both positions: it may be stuck
  pressed,     ///< stop
  chattering,  ///< held no level for 20 ms, and that for 100 ms
  released,    ///< seen in both positions, and not pressed now
};
std::string_view name(SwitchState state) noexcept;

/// A stop switch behind a line that is pulled up: its contact to ground is closed while the vehicle may fly. So an open
/// contact, a cut cable and a missing connector all read as pressed. Pure: the caller passes the time in.
/// Real-time: no allocation.
class StopSwitch {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr auto kDebounce = std::chrono::milliseconds(20);  ///< docs/faults.md row 37
  static constexpr auto kChatter = std::chrono::milliseconds(100);

  /// The line's level at `at`, from an edge or read; both in the order of their times. Between edges a reading is
  /// wanted every few milliseconds: it lets a position count, and finds a level whose edge was lost.
  void see(bool open, Time at) noexcept;
  /// The line is gone. When it is seen again, it may be another one: it has to be tested anew.
  void lose() noexcept { *this = {}; }
  SwitchState state() const noexcept;

 private:
  std::optional<bool> level_, position_;  // as seen last; the last one that was held for kDebounce
  Time since_{}, unsettled_{};            // of level_; of the first change since a position was held
  bool settled_ = false, chatters_ = false;
  bool was_open_ = false, was_closed_ = false;
};

/// Strobe of an external watchdog: another level whenever the control thread has ticked since the last call, none
/// otherwise. The watchdog acts when the edges stop.
class Strobe {
 public:
  bool level(std::uint64_t ticks) noexcept {
    high_ = high_ != (ticks != ticks_);
    ticks_ = ticks;
    return high_;
  }

 private:
  std::uint64_t ticks_ = 0;
  bool high_ = false;
};

/// What the status LED tells.
enum class Signal : std::uint8_t {
  idle,        ///< 50 ms each second: nothing is commanded
  commanding,  ///< steady
  fault,       ///< 5 Hz: quiet, no ticks, or a stop switch that may not be flown on
};
/// Real-time: no allocation.
bool lit(Signal signal, std::chrono::steady_clock::time_point now) noexcept;

}  // namespace backwash::firmware_bridge
