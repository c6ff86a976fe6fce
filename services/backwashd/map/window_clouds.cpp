// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/window_clouds.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

#include "services/backwashd/map/map_change.hpp"
#include "services/backwashd/text.hpp"

namespace backwash::daemon {
namespace {

constexpr double kOffCentre = 0.1;  // of a voxel's edge: what float32 rounds off at 10 km is a tenth of it
constexpr std::int64_t kClocks_ns = 1'000'000'000;  // that a free cloud's clock may be ahead
constexpr std::size_t kTold = 16;                   // points that tell a lattice
constexpr std::size_t kCompared = 4096;             // points whose distance apart is looked at

std::string number(double value, const char* unit = " m") {
  char text[48];
  std::snprintf(text, sizeof text, "%.4g%s", value, unit);
  return text;
}

/// The smallest distance between two coordinates of the points along one axis, m; nothing: they have one alone.
std::optional<double> apart(std::span<const Vec3> points) {
  double least = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Vec3& p : points.first(std::min(points.size(), kCompared))) along.push_back(p[axis]);
    std::ranges::sort(along);
    for (std::size_t n = 1; n < along.size(); ++n)
      if (const double d = along[n] - along[n - 1]; d > 1e-3) least = std::min(least, d);
  }
  return std::isfinite(least) ? std::optional(least) : std::nullopt;
}

/// By what all voxels lie apart along every axis: 1 of a cloud of voxels of that size, 0 of one voxel.
int common_step(std::span<const Index3> voxels) {
  int step = 0;
  for (const Index3& v : voxels)
    for (int axis = 0; axis < 3 && step != 1; ++axis) step = std::gcd(step, v[axis] - voxels[0][axis]);
  return step;
}

}  // namespace

std::string WindowClouds::window_text(const Vec3& p) const {
  char text[160];
  std::snprintf(text, sizeof text, "the window of %.3g x %.3g x %.3g m around the vehicle at %.1f, %.1f, %.1f",
                told_.size.x(), told_.size.y(), told_.size.z(), p.x(), p.y(), p.z());
  return text;
}

/// Points that are no centres of voxels of the stated size.
std::optional<std::string> WindowClouds::off_lattice(std::span<const Vec3> points,
                                                     const std::vector<Index3>& voxels) const {
  const double a = told_.resolution;
  const auto wanted = [&] { return ", wanted " + number(a) + " (map.window.resolution, that of the mapper)"; };
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Vec3 off = points[n] / a - voxels[n].cast<double>() - Vec3::Constant(0.5);
    if (off.cwiseAbs().maxCoeff() <= kOffCentre) continue;
    const auto seen = apart(points);
    if (seen && std::abs(*seen - a) > kOffCentre * a)
      return "resolution: its points lie " + number(*seen) + " apart" + wanted();
    return "x, y, z: " + number(off.cwiseAbs().maxCoeff() * a) + " off a voxel's centre, wanted (n + 0.5) x " +
           number(a) + " (map.window.resolution; ROG-Map: ORIGIN_AT_CORNER)";
  }
  if (const int step = common_step(voxels); voxels.size() >= kTold && step > 1)
    return "resolution: its points lie " + number(step * a) + " apart" + wanted();
  return std::nullopt;
}

std::optional<std::string> WindowClouds::wrong(bool free, const dds::PointCloud& m, const Cloud& cloud) const {
  if (cloud.left_out > 0) return "x, y, z: " + std::to_string(cloud.left_out) + " points are not finite, wanted none";
  const char* const key = free ? "map.window.free" : "map.window.occupied";
  for (const char* const field : {"distance", "sdf", "esdf", "tsdf", "intensity"}) {
    const auto range = range_of(m, field);
    if (!range) continue;
    // nvblox's static_occupancy lists what is occupied with its probability; XYZI that nobody fills is 0.
    const bool occupied = range->first > 0.5 && range->second <= 1, unfilled = range->first == 0 && range->second == 0;
    if (std::string_view(field) == "intensity" && (unfilled || (!free && occupied))) continue;
    return std::string("field ") + field + " " + number(range->first, "") + " to " + number(range->second, "") +
           " looks like distances, wanted x, y, z of voxels alone (" + key + ")";
  }
  return std::nullopt;
}

std::optional<std::string> WindowClouds::wrong_stamp(bool free, std::int64_t stamp_ns, std::int64_t late_ns) const {
  if (stamp_ns < newest_ns_[free])
    return "header.stamp " + number(seconds(newest_ns_[free] - stamp_ns), " s") +
           " before the one before it, wanted rising stamps";
  // Else what it frees would count as later than what is seen to be occupied, however old it is.
  if (free && occupied_late_ns_ && *occupied_late_ns_ - late_ns > kClocks_ns)
    return "header.stamp: its clock is " + number(seconds(*occupied_late_ns_ - late_ns), " s") + " ahead of that of " +
           told_.occupied + ", or those come so much later after their stamps; wanted one clock and alike delays";
  return std::nullopt;
}

tl::expected<WindowCloud, std::string> WindowClouds::judge(bool free, const dds::PointCloud& m, const dds::Guid& writer,
                                                           const std::optional<Vec3>& vehicle_W,
                                                           std::int64_t received_ns) {
  const auto refused = [&](const std::string& why) {
    return tl::unexpected((free ? told_.free : told_.occupied) + " of writer " + dds::text(writer) + ": " + why);
  };
  beyond_.reset();
  const std::string frame = printable(m.header.frame_id ? m.header.frame_id : "");
  if (frame != frame_) return refused("header.frame_id '" + frame + "', wanted '" + frame_ + "' (frames.map)");
  const std::int64_t stamp_ns = dds::nanoseconds(m.header.stamp);
  const std::int64_t late_ns = received_ns - stamp_ns;
  if (const auto why = wrong_stamp(free, stamp_ns, late_ns)) return refused(*why);
  if (!vehicle_W) return refused("it came before the first odometry, which says where the window is");
  const Index3 size = told_.voxels();
  const auto most = 2 * static_cast<std::size_t>(size.cast<double>().prod());
  const auto cloud = decode_cloud(m, most);
  if (!cloud) return refused(cloud.error() + " (map.window.size_x, size_y, size_z)");
  if (const auto why = wrong(free, m, *cloud)) return refused(*why);

  WindowCloud result{free, {}, {}, stamp_ns, received_ns};
  const double a = told_.resolution;
  const Vec3 middle = *vehicle_W / a;
  if (!(middle.cwiseAbs().maxCoeff() < 1e7)) return refused("the vehicle is beyond any map");
  result.window.low = ((*vehicle_W - told_.size / 2) / a).array().floor().cast<int>();
  result.window.high = result.window.low + size - Index3::Ones();
  result.voxels.reserve(cloud->points.size());
  for (const Vec3& p : cloud->points) {
    if (!((p / a).cwiseAbs().maxCoeff() < 1e7)) return refused("x, y, z: a point beyond any map");
    result.voxels.push_back((p / a).array().floor().cast<int>());
  }
  if (const auto why = off_lattice(cloud->points, result.voxels)) return refused(*why);
  // Some of another place's may lie in the window by chance, but none of what surrounds it lies far from all of it.
  const map::VoxelBox around{result.window.low - size, result.window.high + size};
  const bool near = std::ranges::any_of(result.voxels, [&](const Index3& v) { return around.contains(v); });
  const auto beyond = std::erase_if(result.voxels, [&](const Index3& v) { return !result.window.contains(v); });
  if (beyond > 0) {
    const std::string what = std::to_string(beyond) + " of " + std::to_string(cloud->points.size()) +
                             " points lie outside " + window_text(*vehicle_W) + " (map.window.size_x, size_y, size_z)";
    if (!near) return refused(what);
    // A mapper's box is that of a moment ago, and may be wider by a voxel.
    if (3 * beyond > cloud->points.size())
      beyond_ = (free ? told_.free : told_.occupied) + ": " + what + ": they are left out";
  }
  result.first = newest_ns_[free] == INT64_MIN;
  newest_ns_[free] = stamp_ns;
  // A new writer's clock counts from its first cloud on; until then the one before is believed.
  if (!free) occupied_late_ns_ = result.first ? late_ns : std::min(occupied_late_ns_.value_or(late_ns), late_ns);
  return result;
}

NewVoxels new_voxels(const map::OccupancyGrid& known, const WindowCloud& cloud) {
  const Index3 low = (known.origin() / known.resolution()).array().round().cast<int>();
  std::vector<Index3> voxels;
  for (const Index3& v : cloud.voxels) voxels.push_back(v - low);
  return news(known, voxels, cloud.received_ns);
}

}  // namespace backwash::daemon
