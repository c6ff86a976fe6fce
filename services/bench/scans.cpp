// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/scans.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace backwash::bench {
namespace {

/// The point of a ray that has just entered an occupied voxel, 3 cm behind the face it came through: deeper than the
/// VIO's error, so that the mapper finds it in the same voxel.
Vec3 inside(const map::OccupancyGrid& room, const Vec3& before, Vec3 p) {
  constexpr double kDeep = 0.03;
  const Index3 from = room.index(before), to = room.index(p);
  const Vec3 center = room.center(to);
  const double most = room.resolution() / 2 - kDeep;
  for (int axis = 0; axis < 3; ++axis)
    if (from[axis] != to[axis]) p[axis] = std::clamp(p[axis], center[axis] - most, center[axis] + most);
  return p;
}

}  // namespace

builtin_interfaces_msg_dds__Time_ stamp(double t) {
  const auto ns = static_cast<std::int64_t>(t * 1e9);
  return {static_cast<std::int32_t>(ns / 1'000'000'000), static_cast<std::uint32_t>(ns % 1'000'000'000)};
}

std::vector<Vec3> seen_of_crate(const Vec3& center_W, double edge, const Vec3& from_W) {
  std::vector<Vec3> points;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = from_W[axis] > center_W[axis] ? 1 : -1;
    if (std::abs(from_W[axis] - center_W[axis]) <= edge / 2) continue;  // looks at this face from neither side
    for (double u = 0.02; u < edge; u += 0.04)
      for (double v = 0.02; v < edge; v += 0.04) {
        Vec3 p = center_W - Vec3::Constant(edge / 2);
        p[axis] = center_W[axis] + side * (edge / 2 - 0.01);
        p[(axis + 1) % 3] += u;
        p[(axis + 2) % 3] += v;
        points.push_back(p);
      }
  }
  return points;
}

std::vector<Vec3> seen_of_room(const map::OccupancyGrid& room, const Vec3& from_W) {
  constexpr int kRays = 1200;
  constexpr double kRange = 4, kFar = 20, kStep = 0.03, kGoldenAngle = 2.399963;
  std::vector<Vec3> points;
  for (int n = 0; n < kRays; ++n) {  // a spiral over the sphere
    const double z = 1 - (2 * n + 1.0) / kRays, across = std::sqrt(1 - z * z);
    const Vec3 ray(across * std::cos(n * kGoldenAngle), across * std::sin(n * kGoldenAngle), z);
    double s = 0;
    while (s < kRange && !room.occupied(room.index(from_W + s * ray))) s += kStep;
    points.push_back(s < kRange ? inside(room, from_W + (s - kStep) * ray, from_W + s * ray) : from_W + kFar * ray);
  }
  return points;
}

void Scans::send(const std::vector<Vec3>& points_W, const State& truth, const Eigen::Quaterniond& q, double t) {
  static const std::string frame = "base_link";
  static const std::array<std::string, 3> names{"x", "y", "z"};
  constexpr std::uint8_t kFloat32 = 7;
  std::vector<float> data;
  for (const Vec3& p : points_W) {
    const Vec3 seen = q.conjugate() * (p - truth.p_W);
    for (const double x : seen) data.push_back(static_cast<float>(x));
  }
  std::array<dds::PointField, 3> fields{};
  for (std::uint32_t n = 0; n < 3; ++n) fields[n] = {dds::c_string(names[n]), 4 * n, kFloat32, 1};
  dds::PointCloud m{};
  m.header = {stamp(t), dds::c_string(frame)};
  m.height = 1;
  m.width = static_cast<std::uint32_t>(points_W.size());
  m.fields = {3, 3, fields.data(), false};
  m.point_step = 12;
  m.row_step = m.width * m.point_step;
  m.data = {m.row_step, m.row_step, reinterpret_cast<std::uint8_t*>(data.data()), false};
  m.is_dense = true;
  writer_.write(m);
}

}  // namespace backwash::bench
