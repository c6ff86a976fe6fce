// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/recorder.hpp"

namespace backwash::daemon {

/// Called with each segment that the control thread accepted.
using SegmentAccepted = std::function<void(const track::AcceptedSegment&)>;

/// Thread body: plans what the mission asks for, verifies the whole swept tube from the state estimated now, and offers
/// the segment to the control thread, again from a fresh state if that has moved on meanwhile.
void run_planner(Channels& channels, Recorder& recorder, const SegmentAccepted& accepted);

}  // namespace backwash::daemon
