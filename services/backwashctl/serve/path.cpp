// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/path.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::ctl {
namespace {

constexpr std::size_t kEvery = 5;

long mm(double metres) { return std::lround(metres * 1e3); }

/// The smallest set around the next one's centre that holds both.
ShownSet around(const ShownSet& one, const ShownSet& next) {
  ShownSet both = next;
  for (std::size_t d = 0; d < kDirections; ++d) {
    const double off = std::abs(unit(static_cast<Direction>(d)).dot(one.center_W - next.center_W));
    both.half_widths[d] = std::max(next.half_widths[d], off + one.half_widths[d]);
  }
  return both;
}

}  // namespace

std::optional<OverBound> error_over_bound(const ShownPath& path, const Vec3& measured_W, const Vec3& setpoint_W) {
  constexpr double kSame = 1e-3;  // m
  if (path.tube.size() != path.commands_W.size() + 1) return std::nullopt;
  const auto last = std::find_if(path.commands_W.rbegin(), path.commands_W.rend(),
                                 [&](const Vec3& p) { return (p - setpoint_W).norm() < kSame; });
  if (last == path.commands_W.rend()) return std::nullopt;
  const auto at = static_cast<std::size_t>(path.commands_W.rend() - last) - 1;
  const ShownSet &to = path.tube[at], &from = path.tube[at > 0 ? at - 1 : 0];
  const Vec3 way = to.center_W - from.center_W;
  const double length2 = way.squaredNorm();
  const double share = length2 > 0 ? std::clamp((measured_W - from.center_W).dot(way) / length2, 0.0, 1.0) : 1;
  const Vec3 error = measured_W - (from.center_W + share * way);
  OverBound over{};
  for (std::size_t d = 0; d < kDirections; ++d)
    over[d] = unit(static_cast<Direction>(d)).dot(error) / to.half_widths[d];
  return over;
}

nlohmann::json json_of(const ShownPath& path) {
  nlohmann::json line = nlohmann::json::array(), tube = nlohmann::json::array();
  for (std::size_t n = 0; n < path.commands_W.size(); ++n) {
    const Vec3& p = path.commands_W[n];
    if (n % kEvery == 0 || n + 1 == path.commands_W.size()) line.push_back({mm(p.x()), mm(p.y()), mm(p.z())});
  }
  for (std::size_t begin = 0; begin < path.tube.size(); begin += kEvery) {
    ShownSet set = path.tube[begin];
    for (std::size_t n = begin + 1; n < std::min(begin + kEvery, path.tube.size()); ++n)
      set = around(set, path.tube[n]);
    const Vec3& c = set.center_W;
    nlohmann::json row{mm(c.x()), mm(c.y()), mm(c.z())};
    for (const double h : set.half_widths) row.push_back(mm(h));
    tube.push_back(std::move(row));
  }
  return {{"path", std::move(line)}, {"tube", std::move(tube)}};
}

}  // namespace backwash::ctl
