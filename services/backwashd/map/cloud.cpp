// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/cloud.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace backwash::daemon {
namespace {

constexpr std::uint8_t kFloat32 = 7, kFloat64 = 8;  // sensor_msgs/PointField

/// Where one coordinate lies within a point.
struct Coordinate {
  std::size_t offset;
  bool single;

  double read(const std::uint8_t* point) const noexcept {
    if (!single) {
      double value;
      std::memcpy(&value, point + offset, sizeof value);
      return value;
    }
    float value;
    std::memcpy(&value, point + offset, sizeof value);
    return static_cast<double>(value);
  }
};

struct Coordinates {
  Coordinate x, y, z;
  Vec3 read(const std::uint8_t* point) const noexcept { return {x.read(point), y.read(point), z.read(point)}; }
};

std::optional<Coordinate> find(const dds::PointCloud& m, const std::string& name) {
  for (std::uint32_t n = 0; n < m.fields._length; ++n) {
    const dds::PointField& field = m.fields._buffer[n];
    if (!field.name || name != field.name) continue;
    const std::size_t size = field.datatype == kFloat32 ? 4 : field.datatype == kFloat64 ? 8 : 0;
    if (size == 0 || field.count > 1 || std::size_t{field.offset} + size > m.point_step) return std::nullopt;
    return Coordinate{field.offset, size == 4};
  }
  return std::nullopt;
}

std::optional<Coordinates> find_three(const dds::PointCloud& m, const std::string& prefix) {
  const auto x = find(m, prefix + "x"), y = find(m, prefix + "y"), z = find(m, prefix + "z");
  if (!x || !y || !z) return std::nullopt;
  return Coordinates{*x, *y, *z};
}

}  // namespace

tl::expected<Cloud, std::string> decode_cloud(const dds::PointCloud& m, std::size_t most_points) {
  const auto wrong = [](const std::string& what) { return tl::unexpected<std::string>("point cloud: " + what); };
  if (m.fields._length > kMaxCloudFields || m.point_step > kMaxPointBytes)
    return wrong(std::to_string(m.fields._length) + " fields in points of " + std::to_string(m.point_step) +
                 " bytes, at most " + std::to_string(kMaxCloudFields) + " in " + std::to_string(kMaxPointBytes));
  if (m.is_bigendian) return wrong("big-endian data, expected little-endian");
  const auto xyz = find_three(m, "");
  if (!xyz) return wrong("fields x, y, z of type float32 or float64 within a point are needed");
  const std::uint64_t count = std::uint64_t{m.width} * m.height;
  if (count > most_points) return wrong(std::to_string(count) + " points, at most " + std::to_string(most_points));
  const std::uint64_t row = std::uint64_t{m.width} * m.point_step;
  if (m.row_step < row || std::uint64_t{m.row_step} * m.height > m.data._length)
    return wrong("its sizes do not agree: " + std::to_string(m.width) + " x " + std::to_string(m.height) +
                 " points of " + std::to_string(m.point_step) + " bytes, rows of " + std::to_string(m.row_step) +
                 ", data of " + std::to_string(m.data._length));
  Cloud cloud;
  if (count == 0) return cloud;
  if (const auto viewpoint = find_three(m, "vp_")) {
    const Vec3 sensor = viewpoint->read(m.data._buffer);
    if (!sensor.allFinite()) return wrong("its viewpoint is not finite");
    cloud.viewpoint = sensor;
  }
  cloud.points.reserve(count);
  for (std::uint32_t j = 0; j < m.height; ++j) {
    const std::uint8_t* point = m.data._buffer + std::size_t{j} * m.row_step;
    for (std::uint32_t i = 0; i < m.width; ++i, point += m.point_step)
      if (const Vec3 p = xyz->read(point); p.allFinite()) cloud.points.push_back(p);
  }
  cloud.left_out = count - cloud.points.size();
  return cloud;
}

std::optional<std::pair<double, double>> range_of(const dds::PointCloud& m, const std::string& field) {
  const auto found = find(m, field);
  if (!found || m.width == 0 || m.height == 0) return std::nullopt;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::pair range{kFar, -kFar};
  for (std::uint32_t j = 0; j < m.height; ++j)
    for (std::uint32_t i = 0; i < m.width; ++i) {
      const double value = found->read(m.data._buffer + std::size_t{j} * m.row_step + std::size_t{i} * m.point_step);
      if (std::isnan(value)) return std::pair{value, value};
      range = {std::min(range.first, value), std::max(range.second, value)};
    }
  return range;
}

}  // namespace backwash::daemon
