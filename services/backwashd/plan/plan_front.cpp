// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/plan/plan_front.hpp"

namespace backwash::daemon {

PlanFront::Standing PlanFront::standing(const ControlView& view) const noexcept {
  if (view.epoch == epoch_) return Standing::current;
  return view.epoch.order < epoch_.order && view.epoch.lapse == epoch_.lapse ? Standing::early : Standing::ended;
}

void PlanFront::stamp(track::AcceptedSegment& segment) noexcept {
  segment.id = ++last_id_;
  segment.epoch = epoch_;
}

PlanFront::Fate PlanFront::fate(const ControlView& view) const noexcept {
  if (view.segment == last_id_) return Fate::accepted;
  return view.refused_segment == last_id_ ? Fate::refused : Fate::open;
}

}  // namespace backwash::daemon
