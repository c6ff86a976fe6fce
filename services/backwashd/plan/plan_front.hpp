// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "core/track/tracker.hpp"
#include "services/backwashd/control/controlled.hpp"

namespace backwash::daemon {

/// The planner's side of what it hands to the control thread: under which epoch something is planned, whether it may
/// still be flown, and what became of what was offered. Pure: it sees what the control thread shows and nothing else.
class PlanFront {
 public:
  /// Of a plan, as the control thread stands.
  enum class Standing {
    early,    ///< the control thread has not yet taken the order that it was made under
    current,  ///< it may be flown
    ended,    ///< something later ended it: it must not be offered, and work on it is in vain
  };
  /// Of a segment that was offered.
  enum class Fate { open, accepted, refused };

  /// A plan is begun under this epoch: the job's, or that of the flight that it continues.
  void begin(const track::Epoch& epoch) noexcept { epoch_ = epoch; }
  Standing standing(const ControlView& view) const noexcept;
  /// Gives the segment its number and its epoch, for an offer.
  void stamp(track::AcceptedSegment& segment) noexcept;
  /// Of the segment that was stamped last.
  Fate fate(const ControlView& view) const noexcept;

 private:
  track::Epoch epoch_;
  std::uint64_t last_id_ = 0;
};

}  // namespace backwash::daemon
