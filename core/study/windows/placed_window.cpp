// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/observer.hpp"

#include <algorithm>
#include <cmath>

#include "core/loop/position_loop.hpp"
#include "core/study/windows/signals/instrument.hpp"

namespace backwash::study {
namespace {

/// The attitude without its tilt, which answers the gusts as the thrust does.
Mat3 heading(const Mat3& R_WB) {
  return Eigen::AngleAxisd(std::atan2(R_WB(1, 0), R_WB(0, 0)), Vec3::UnitZ()).toRotationMatrix();
}

/// Σ along the window (a moving vehicle crosses different air), as it is and with the window moved; surfaces too.
void look_along(WindowRow& row, SampleRange w, const std::vector<Vec3>& p, const std::vector<Vec3>& v,
                MapView& surroundings) {
  const auto sample = [&](std::size_t k) { return w.begin + (2 * k + 1) * w.size() / (2 * kPoints); };
  const auto at = [&](std::size_t k) -> const Vec3& { return p[sample(k)]; };
  const bool still = (at(0) - at(kPoints - 1)).norm() + (at(0) - at(kPoints / 2)).norm() < kWindowRules.one_place;
  // An offset that puts the craft into a solid says nothing of the air there: as far along it as is free.
  const auto sigma = [&](const Vec3& from_W, const Vec3& offset_W) {
    double share = 1;
    while (share > 0 && surroundings.inside_solid(from_W + share * offset_W)) share -= kWindowRules.offset_retreat;
    return surroundings.sigma(from_W + share * offset_W);
  };
  const auto along = [&](const Vec3& offset_W) {
    if (still) return sigma(row.p_W, offset_W);
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < kPoints; ++k) sum += sigma(at(k), offset_W) / kPoints;
    return sum;
  };
  row.sigma = along(Vec3::Zero());
  for (std::size_t k = 0; k < kPoints; ++k) {
    row.speeds[k] = v[sample(k)].norm();
    row.climbs[k] = v[sample(k)].z();
    row.shares[k] = still ? 1.0 / kPoints : surroundings.sigma(at(k)).sum() / (kPoints * row.sigma.sum());
  }
  for (std::size_t k = 0; k < kPoints && !still && surroundings.has_map(); ++k)
    row.path.push_back(surroundings.around(at(k)));
  for (std::size_t n = 0; n < row.ln_sigma_moved.size(); ++n) {
    constexpr std::size_t kMiddle = (kOffsetsAside - 1) / 2;
    const std::size_t x = n / kOffsetsAside, y = n % kOffsetsAside;
    const Vec3 offset_W = kOffsetStep * (Vec3(static_cast<double>(x), static_cast<double>(y), 0) -
                                         Vec3(static_cast<double>(kMiddle), static_cast<double>(kMiddle), 0));
    row.ln_sigma_moved[n] = (along(offset_W).array() / row.sigma.array())
                                .log()
                                .max(-kWindowRules.offset_limit)
                                .min(kWindowRules.offset_limit);
  }
}

}  // namespace

Vec3 WindowRow::ln_sigma_at(const Vec3& offset_W) const {
  constexpr double kHalf = (kOffsetsAside - 1) / 2.0;
  Vec3 ln = Vec3::Zero();
  std::array<std::size_t, 2> low;
  std::array<double, 2> share;
  for (int i = 0; i < 2; ++i) {
    const double q = std::clamp(offset_W[i] / kOffsetStep + kHalf, 0.0, 2 * kHalf);
    const auto k = static_cast<std::size_t>(i);
    low[k] = std::min(static_cast<std::size_t>(q), kOffsetsAside - 2);
    share[k] = q - static_cast<double>(low[k]);
  }
  for (std::size_t n = 0; n < 4; ++n) {
    const std::size_t i = n / 2, j = n % 2;
    const double weight = (i ? share[0] : 1 - share[0]) * (j ? share[1] : 1 - share[1]);
    ln += weight * ln_sigma_moved[(low[0] + i) * kOffsetsAside + low[1] + j];
  }
  return ln;
}

WindowRow placed(const log::FlightLog& log, const Series& s, SampleRange w, const Vehicle& vehicle,
                 MapView& surroundings) {
  WindowRow row{};
  const auto column_mean = [&](const char* name) {
    if (!log.has(name)) return 0.0;
    const auto& column = log.column(name);
    return mean_over(w, 0.0, [&](std::size_t i) { return column[s.row[i]]; });
  };
  const auto mean_of = [&](const std::vector<Vec3>& x) -> Vec3 {
    return mean_over(w, Vec3(Vec3::Zero()), [&](std::size_t i) -> Vec3 { return x[i]; });
  };
  row.segment = s.segment[w.begin];
  row.t = 0.5 * (s.t[w.begin] + s.t[w.end - 1]);
  row.duration = s.t[w.end - 1] - s.t[w.begin];
  // A gust that pushes the craft up is in its mean residual and in its measured height: a place that answers the gusts
  // would explain them. Where the set-points lead is known without them, unless the craft flies elsewhere.
  const bool as_told = !s.p_nominal.empty() && (mean_of(s.p_nominal) - mean_of(s.p)).norm() < kWindowRules.stray;
  const auto &p = as_told ? s.p_nominal : s.p, &v = as_told ? s.v_nominal : s.v;
  row.p_W = mean_of(p);
  row.v_W = mean_of(v);
  row.held_off = vehicle.controller.velocity_integrator.horizontal > 0;
  const auto varied2 = [&](const std::vector<Vec3>& x) {
    Vec3 square = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis)
      for (const double off : detrended_values(w, [&](std::size_t i) { return x[i][axis]; }))
        square[axis] += off * off / static_cast<double>(w.size());
    return square;
  };
  row.varied2 = varied2(v);
  if (as_told)
    row.led = {.give = loop::PositionLoop(vehicle).kp.cwiseInverse(),
               .slowed = (row.v_W - mean_of(s.v_dragged)) / kWindowRules.loop_drag,
               .asked_W = mean_of(s.a_nominal),
               .asked2 = varied2(s.a_nominal),
               .off_W = mean_of(s.p) - row.p_W};
  // The mean of the measured speed would hold every gust rectified: without set-points, the way made good.
  row.speed = as_told ? mean_over(w, 0.0, [&](std::size_t i) { return v[i].norm(); }) : row.v_W.norm();
  if (!s.R_WB.empty()) row.R_WB = mean_over(w, Mat3(Mat3::Zero()), [&](std::size_t i) { return heading(s.R_WB[i]); });
  row.thrust_acc = s.thrust_acc.empty() ? kGravity : mean_over(w, 0.0, [&](std::size_t i) { return s.thrust_acc[i]; });
  row.voltage = column_mean("battery_v");
  row.temperature = column_mean("temperature_c");
  row.around = surroundings.around(row.p_W);
  if (!surroundings.has_map()) {  // imported recordings say what stood below and above (backwash import)
    if (log.has("surface_z_m")) row.around.height = row.p_W.z() - column_mean("surface_z_m");
    if (log.has("ceiling") && column_mean("ceiling") > 0.5)
      row.around.ceiling_gap = kCeilingReference;  // they do not say how far
  }
  look_along(row, w, p, v, surroundings);
  if (!as_told) row.speeds.fill(row.speed);
  return row;
}

}  // namespace backwash::study
