// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"

#include <algorithm>

namespace backwash::study {

double power_of_distance(double distance, double reference, double n) {
  return std::isfinite(distance) ? std::pow(reference / std::max(distance, kSurfaceNearest), n) : 0.0;
}

std::vector<DesignColumn> body_drift(const Windows& ws, const std::function<double(const WindowRow&)>& amount) {
  std::vector<DesignColumn> columns;
  for (int i = 0; i < 3; ++i) {
    DesignColumn c = level(ws, [&](auto& w) -> Vec3 { return amount(w) * w.body_axis(i); });
    c.parts.push_back({kMeanZ, values(ws, [&](auto& w) { return amount(w) * w.body_axis(i).z(); })});
    columns.push_back(std::move(c));
  }
  return columns;
}

namespace {

/// T/m of all windows together: a window's own answers its mean gust, so it would explain the residual by itself.
double mean_thrust(const Windows& ws) {
  double thrust_acc = 0;
  for (const auto& w : ws) thrust_acc += w.thrust_acc / static_cast<double>(ws.size());
  return thrust_acc;
}

}  // namespace

DesignColumn missing_thrust(const Windows& ws, const std::function<double(const WindowRow&)>& share) {
  const double thrust_acc = mean_thrust(ws);
  return {{{kMeanZ, values(ws, [&](auto& w) { return -share(w) * thrust_acc; })},
           {kThrustDelay, values(ws, [&](auto& w) { return -share(w) * w.delay_gain[1]; })},
           {kThrustSlope, values(ws, [&](auto& w) { return -share(w) * w.slope_gain[1]; })}}};
}

DesignColumn missing_thrust(const Windows& ws, double m) {
  DesignColumn column = missing_thrust(ws, [](auto&) { return 1.0; });
  // To be met, what the set-points ask for was commanded as much more as the hover's thrust was.
  const double more = mean_thrust(ws) / kGravity;
  for (Eigen::Index axis = 0; axis < 3 && m != 0; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (axis < 2)
      column.parts.push_back({static_cast<Channel>(kMeanX + a),
                              values(ws, [&](auto& w) { return w.led ? -more * w.led->asked_W[axis] : 0; }), true});
    column.parts.push_back(
        {kVariances[a],
         values(ws,
                [&](auto& w) {
                  return w.led ? std::log1p(std::pow(m * more, 2) * w.led->asked2[axis] / w.sigma[axis]) / m : 0;
                }),
         true});
  }
  return column;
}

std::vector<Scale> rotors() { return scales_of({0, 1, 2, 3}); }

DesignColumn one_rotor(Channel first, const Windows& ws, const Scale& rotor, bool contrast) {
  DesignColumn column;
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = (i == static_cast<std::size_t>(rotor.value) ? 1.0 : 0.0) - (contrast ? 0.25 : 0.0);
    if (x != 0) column.parts.push_back({static_cast<Channel>(first + i), std::vector<double>(ws.size(), x)});
  }
  return column;
}

}  // namespace backwash::study
