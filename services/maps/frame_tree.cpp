// SPDX-License-Identifier: BSD-3-Clause
#include "services/maps/frame_tree.hpp"

#include <algorithm>

#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

}  // namespace

std::string FrameTree::add(const std::string& parent, const std::string& child, std::int64_t stamp_ns, const Pose& pose,
                           bool always) {
  if (parent == child) return "frame " + shown(child) + " is placed in itself";
  Link& link = links_[child];
  if (link.parent.empty()) link.parent = parent;
  if (link.parent != parent)
    return "frame " + shown(child) + " is placed in " + shown(parent) + " and in " + shown(link.parent) +
           "; record one of them";
  link.always = always;
  link.poses.emplace_back(stamp_ns, pose);
  return "";
}

void FrameTree::sort() {
  for (auto& [child, link] : links_) std::ranges::stable_sort(link.poses, {}, &std::pair<std::int64_t, Pose>::first);
}

std::string FrameTree::root_of(const std::string& frame) const {
  std::string root = frame;
  std::size_t steps = 0;
  for (auto link = links_.find(root); link != links_.end(); link = links_.find(root)) {
    if (++steps > links_.size()) return "";
    root = link->second.parent;
  }
  return root;
}

std::optional<Pose> FrameTree::at(const Link& link, std::int64_t stamp_ns) {
  if (link.always) return link.poses.back().second;
  const auto after = std::ranges::lower_bound(link.poses, stamp_ns, {}, &std::pair<std::int64_t, Pose>::first);
  if (after != link.poses.end() && after->first == stamp_ns) return after->second;
  if (after == link.poses.begin() || after == link.poses.end()) {
    const auto& [t, pose] = after == link.poses.end() ? link.poses.back() : link.poses.front();
    return std::abs(seconds(stamp_ns - t)) > kLongestBeyond ? std::nullopt : std::optional(pose);
  }
  const auto& [t0, a] = *(after - 1);
  const auto& [t1, b] = *after;
  if (seconds(t1 - t0) > kLongestGap) return std::nullopt;
  const double part = seconds(stamp_ns - t0) / seconds(t1 - t0);
  return Pose{a.turn.slerp(part, b.turn), a.place + part * (b.place - a.place)};
}

std::optional<Pose> FrameTree::pose(const std::string& frame, std::int64_t stamp_ns) const {
  Pose pose;
  std::size_t steps = 0;
  for (auto link = links_.find(frame); link != links_.end(); link = links_.find(link->second.parent)) {
    const auto in_parent = at(link->second, stamp_ns);
    if (!in_parent || ++steps > links_.size()) return std::nullopt;
    pose = *in_parent * pose;
  }
  return pose;
}

}  // namespace backwash::maps
