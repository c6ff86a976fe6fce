// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/map_window.hpp"

#include <cmath>

#include "core/config/ros_name.hpp"

namespace backwash::config {
namespace {

/// What the last name of a topic says that it holds, if that is neither occupied nor free voxels: ROG-Map's unk and
/// inf_unk, distances of nvblox and voxblox.
std::optional<std::string_view> holds_other(std::string_view topic) {
  const std::string_view last = topic.substr(topic.rfind('/') + 1);
  for (const std::string_view other : {"unk", "esdf", "tsdf", "slice", "frontier"})
    if (last.find(other) != last.npos) return other;
  return std::nullopt;
}

}  // namespace

std::optional<std::pair<std::string_view, std::string>> wrong_window(const MapWindow& w, double max_mib) {
  constexpr std::string_view kOccupied = "map.window.occupied", kFree = "map.window.free";
  for (const auto& [key, topic] : {std::pair(kOccupied, &w.occupied), std::pair(kFree, &w.free)}) {
    if (key == kFree && topic->empty()) continue;
    if (!ros_name(*topic, kLongestTopic))
      return std::pair(key, "needs a ROS 2 topic on the wire, as rt/rog_map/occ, up to 255 characters");
    if (const auto other = holds_other(*topic))
      return std::pair(key, "needs a cloud of " + std::string(key == kFree ? "free" : "occupied") +
                                " voxels: by its name this one holds others (" + std::string(*other) + ")");
  }
  if (w.occupied == w.free) return std::pair(kFree, std::string("needs another topic than map.window.occupied"));
  constexpr double kMib = 1 << 20;
  const double world = w.world().cast<double>().prod(), window = w.voxels().cast<double>().prod();
  const double mib = world * static_cast<double>(kWorldBytesPerVoxel) / kMib;
  if (mib > max_mib)
    return std::pair(std::string_view("map.window"), "needs a map.max_mib of " +
                                                         std::to_string(static_cast<long>(std::ceil(mib))) +
                                                         " or more for the world around it, or a smaller size");
  if (w.keep_voxels < window)
    return std::pair(std::string_view("map.window.keep_voxels"),
                     "needs " + std::to_string(static_cast<long>(window)) + " or more: those of one window");
  return std::nullopt;
}

}  // namespace backwash::config
