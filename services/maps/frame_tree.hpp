// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::maps {

/// Where a frame is in another, m.
struct Pose {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Vec3 place = Vec3::Zero();

  Vec3 operator*(const Vec3& p) const { return turn * p + place; }
  Pose operator*(const Pose& inner) const { return {turn * inner.turn, *this * inner.place}; }
};

/// The frames of a recording and where each was in its parent, over time.
class FrameTree {
 public:
  /// Longest time between two poses that a third is read between, and from a stamp to the first or last, s.
  static constexpr double kLongestGap = 0.5, kLongestBeyond = 0.1;

  /// What is wrong, or nothing: a frame in itself, or in another one than before.
  std::string add(const std::string& parent, const std::string& child, std::int64_t stamp_ns, const Pose& pose,
                  bool always);
  /// Once, after the last add().
  void sort();
  bool has(const std::string& frame) const { return links_.contains(frame); }
  /// The frame that all parents of this one lead to; "" where they lead in a circle.
  std::string root_of(const std::string& frame) const;
  /// Where the frame was in its root: places on a line and turns along the shortest arc between two stamps. Nothing: it
  /// is not known for that time.
  std::optional<Pose> pose(const std::string& frame, std::int64_t stamp_ns) const;

 private:
  struct Link {
    std::string parent;
    bool always = false;                               // at all times, where the newest says
    std::vector<std::pair<std::int64_t, Pose>> poses;  // ns
  };
  static std::optional<Pose> at(const Link& link, std::int64_t stamp_ns);

  std::map<std::string, Link> links_;  // by child
};

}  // namespace backwash::maps
