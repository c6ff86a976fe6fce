// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace study_worlds {
namespace {

/// Minimum-jerk line, sampled at kStep.
void append_line(std::vector<Command>& plan, const Vec3& from, const Vec3& to, double yaw_from, double yaw_to,
                 double a_max, double v_max = 1.3) {
  const double length = (to - from).norm();
  const double time = std::max({std::sqrt(5.78 * length / a_max), 1.875 * length / v_max, 1.0});
  const int n = static_cast<int>(time / kStep);
  const double turn = std::remainder(yaw_to - yaw_from, 2 * M_PI);
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n;
    const double q = s * s * s * (10 + s * (6 * s - 15)), dq = 30 * s * s * (1 - s) * (1 - s) / time,
                 ddq = 60 * s * (1 - s) * (1 - 2 * s) / (time * time);
    plan.push_back({from + q * (to - from), dq * (to - from), ddq * (to - from), yaw_from + q * turn, -1});
  }
}

/// Hover points: near the floor, a ceiling, a wall, and anywhere; at least 0.35 m from everything but by intent.
Vec3 draw_spot(const Room& room, Rng& rng, int kind, bool two_heights) {
  const auto u = [&](double low, double high) { return std::uniform_real_distribution(low, high)(rng); };
  const Box& in = room.inside;
  if (two_heights)
    return {u(0.5, in.high.x() - 0.5), u(0.5, in.high.y() - 0.5), u(0, 1) < 0.5 ? 0.4 : in.high.z() - 0.4};
  for (;;) {
    Vec3 p(u(0.5, in.high.x() - 0.5), u(0.5, in.high.y() - 0.5), u(0.5, in.high.z() - 0.5));
    if (kind == 0) p.z() = u(0.3, 0.45);
    if (kind == 2) (u(0, 1) < 0.5 ? p.x() : p.y()) = u(0.3, 0.45);
    if (kind == 3) p.y() = in.high.y() - u(0.3, 0.45);
    bool inside_solid = false;
    for (const Box& b : room.solids)
      inside_solid = inside_solid || Box{b.low - Vec3::Constant(0.25), b.high + Vec3::Constant(0.25)}.contains(p);
    const double gap = room.gap_to_ceiling(p), height = room.height_above_solid(p);
    if (kind == 1 && std::isfinite(gap)) {
      p.z() += gap - u(0.22, 0.4);
      inside_solid = p.z() < 0.9;
    }
    if (!inside_solid && height > 0.25) return p;
  }
}

/// Up and down on a sine at one spot: where the craft is low it accelerates upwards.
void append_bob(std::vector<Command>& plan, const Vec3& bottom, double amplitude, double period, int cycles, double yaw,
                int segment) {
  const double omega = 2 * M_PI / period;
  const int n = static_cast<int>(cycles * period / kStep);
  for (int i = 0; i < n; ++i) {
    const double phase = omega * (i + 0.5) * kStep;
    plan.push_back({bottom + Vec3(0, 0, amplitude * (1 - std::cos(phase))),
                    {0, 0, amplitude * omega * std::sin(phase)},
                    {0, 0, amplitude * omega * omega * std::cos(phase)},
                    yaw,
                    segment});
  }
}

/// Flights that go up and down at six to eight spots, all about the same height.
std::vector<Command> bobbing_plan(const HiddenWorld& world, Rng& rng) {
  const auto u = [&](double low, double high) { return std::uniform_real_distribution(low, high)(rng); };
  const Vec3& far = world.room.inside.high;
  const auto spot = [&] {
    const double x = u(0.7, far.x() - 0.7), y = u(0.7, far.y() - 0.7);  // in an order that no compiler may change
    return Vec3(x, y, u(0.35, 0.5));
  };
  std::vector<Command> plan;
  Vec3 at = spot();
  double yaw = u(-M_PI, M_PI);
  const int dwells = static_cast<int>(u(6, 9));
  for (int i = 0; i < dwells; ++i) {
    const double amplitude = u(0.25, 0.4);
    append_bob(plan, at, amplitude, u(3, 5), 2, yaw, i);
    const Vec3 next = spot();
    const double turned = u(-M_PI, M_PI);
    append_line(plan, at, next, yaw, turned, 1.0);
    at = next;
    yaw = turned;
  }
  return plan;
}

}  // namespace

std::vector<Command> draw_plan(const HiddenWorld& world, Rng& rng) {
  const auto u = [&](double low, double high) { return std::uniform_real_distribution(low, high)(rng); };
  if (world.request.confound == "bob") return bobbing_plan(world, rng);
  const bool turns = world.request.confound != "yaw", two_heights = world.request.confound == "height";
  const bool fast = world.request.confound == "fast";
  const int dwells = static_cast<int>(u(9, 13));
  std::vector<int> kinds;
  for (int i = 0; i < dwells; ++i) kinds.push_back(i % 5);
  std::shuffle(kinds.begin(), kinds.end(), rng);
  std::vector<Command> plan;
  Vec3 at = draw_spot(world.room, rng, 4, two_heights);
  double yaw = turns ? u(-M_PI, M_PI) : 0;
  for (int i = 0; i < dwells; ++i) {
    const int n = static_cast<int>(u(4, 7) / kStep);
    for (int k = 0; k < n; ++k) plan.push_back({at, Vec3::Zero(), Vec3::Zero(), yaw, i});
    const Vec3 next = draw_spot(world.room, rng, kinds[static_cast<std::size_t>(i)], two_heights);
    const double turned = turns ? u(-M_PI, M_PI) : 0;
    const double a_max = fast ? u(3, 5) : u(0.8, 2.0), v_max = fast ? u(2, 4) : 1.3, z = 1.2;
    if (two_heights) {
      append_line(plan, at, next, yaw, turned, a_max);
    } else {
      append_line(plan, at, {at.x(), at.y(), z}, yaw, yaw, a_max);
      append_line(plan, {at.x(), at.y(), z}, {next.x(), next.y(), z}, yaw, turned, a_max, v_max);
      append_line(plan, {next.x(), next.y(), z}, next, turned, turned, a_max);
    }
    at = next;
    yaw = turned;
  }
  return plan;
}

double acts_since(const Request& request, int flight) {
  const auto& in = request.in_flights;
  if (in.empty()) return 0;
  if (std::find(in.begin(), in.end(), flight) == in.end()) return std::numeric_limits<double>::infinity();
  return request.in_each || flight == *std::min_element(in.begin(), in.end()) ? request.since_s : 0;
}

backwash::map::OccupancyGrid true_grid(const Room& room) {
  const double a = 0.1;
  const Vec3 low = room.inside.low - Vec3::Constant(0.4), high = room.inside.high + Vec3::Constant(0.4);
  const Eigen::Vector3i size = ((high - low) / a).array().round().cast<int>();
  backwash::map::OccupancyGrid grid(low, a, size);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const auto v = grid.voxel(n);
    const Vec3 p = grid.center(v);
    bool solid = !room.inside.contains(p);
    for (const Box& b : room.solids) solid = solid || b.contains(p);
    grid.set(v, solid ? backwash::map::Cell::occupied : backwash::map::Cell::free);
  }
  return grid;
}

}  // namespace study_worlds
