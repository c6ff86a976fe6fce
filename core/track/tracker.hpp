// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "core/reach/reach_tube.hpp"
#include "core/types/state.hpp"

namespace backwash::track {

/// An accepted piece of flight: commands every 20 ms and the tube propagated once, at acceptance.
struct AcceptedSegment {
  std::vector<Setpoint> commands;
  reach::ReachTube tube;  ///< commands.size() + 1 entries; past its end the last entry holds
};

/// What one tick says about the measured position (model.md section 5.4).
struct Inside {
  bool inside = true;          ///< |e_n| ≤ h_n in all five directions
  PerDirection error{};        ///< e_n = unit(n)·(measured − centre), m
  PerDirection half_widths{};  ///< h_n, m
};

/// Steps through accepted segments, one command a tick; holds the last position at rest after the end. In a tick: judge
/// the measurement taken now, then step.
class Tracker {
 public:
  explicit Tracker(const Setpoint& hold);
  /// Takes over at the next step. Not real-time (moves memory).
  void accept(std::shared_ptr<const AcceptedSegment> segment);
  /// Judges the measured position at this tick, before its step(), against the set predicted for it. Past the end of
  /// the segment the last set holds. Before the first accepted segment nothing is claimed: inside, with half widths 0.
  /// Real-time: wait-free, no allocation.
  Inside judge(const Vec3& measured_W) const noexcept;
  /// Command of this tick, then moves on. Real-time: wait-free, no allocation.
  Setpoint step() noexcept;
  bool finished() const noexcept;

 private:
  std::shared_ptr<const AcceptedSegment> segment_;
  std::size_t next_ = 0;
  Setpoint hold_;
};

}  // namespace backwash::track
