// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/regressors.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/effect_rules.hpp"

namespace backwash::study {
namespace {

constexpr double kStrayed = kEffectRules.strayed;

}  // namespace

std::vector<Regressor> regressors(const Observations& seen) {
  std::vector<Regressor> all = {{"z_m", false, [](const WindowRow& w) { return w.around.height; }},
                                {"x_m", false, [](const WindowRow& w) { return w.p_W.x(); }},
                                {"y_m", false, [](const WindowRow& w) { return w.p_W.y(); }},
                                {"speed_mps", false, [](const WindowRow& w) { return w.speed; }},
                                {"t_s", false, [](const WindowRow& w) { return w.t; }}};
  if (seen.has(Source::map)) {
    all.push_back({"ceiling_gap_m", false, [](const WindowRow& w) {
                     return std::min(w.around.ceiling_gap, kEffectRules.no_wall_nearer.value);
                   }});
    all.push_back({"wall_distance_m", false, [](const WindowRow& w) {
                     double least = kEffectRules.no_wall_nearer;
                     for (const auto& [distance, direction] : w.around.walls) least = std::min(least, distance);
                     return least;
                   }});
  }
  if (seen.has(Source::battery)) all.push_back({"battery_v", false, [](const WindowRow& w) { return w.voltage; }});
  if (seen.has(Source::temperature))
    all.push_back({"temperature_c", false, [](const WindowRow& w) { return w.temperature; }});
  if (seen.has(Source::attitude)) all.push_back({"yaw_rad", true, [](const WindowRow& w) { return w.yaw(); }});
  return all;
}

std::vector<double> ranks(const Regressor& along, const Windows& windows) {
  std::vector<double> u = values(windows, along.value);
  if (along.circular) return u;
  std::vector<double> sorted = u;
  std::sort(sorted.begin(), sorted.end());
  for (double& x : u) {
    const auto [low, high] = std::equal_range(sorted.begin(), sorted.end(), x);
    x = 0.5 * static_cast<double>((low - sorted.begin()) + (high - sorted.begin())) / static_cast<double>(u.size());
  }
  return u;
}

const std::vector<std::pair<std::string, std::vector<Channel>>>& channel_groups() {
  static const std::vector<std::pair<std::string, std::vector<Channel>>> all = {
      {"mean x, y", {kMeanX, kMeanY}}, {"mean z", {kMeanZ}}, {"ln variance", {kVarX, kVarY, kVarZ}}};
  return all;
}

std::vector<DesignColumn> companions(const Form& form, const Observations& seen) {
  return form.companions ? form.companions(seen.windows) : std::vector<DesignColumn>{};
}

Windows moved_by(const Windows& windows, const std::vector<DesignColumn>& columns, const Eigen::VectorXd& theta) {
  Windows moved = windows;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    Vec3 push = Vec3::Zero();
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const auto& part : columns[k].parts)
        if (part.channel <= kMeanZ)
          push[static_cast<Eigen::Index>(part.channel)] += theta[static_cast<Eigen::Index>(k)] * part.x[i];
    if (moved[i].held_off || !moved[i].led) continue;
    const Vec3 by = push.cwiseProduct(moved[i].led->give).cwiseMax(-kStrayed).cwiseMin(kStrayed);
    const auto move = [&](PlaceAround& place) {
      place.height += by.z();
      place.ceiling_gap -= by.z();
      for (auto* walls : {&place.walls, &place.whole_walls})
        for (auto& [distance, direction] : *walls) distance -= by.dot(direction);
    };
    move(moved[i].around);
    for (auto& place : moved[i].path) move(place);
  }
  return moved;
}

Windows moved_by_itself(const Form& form, const Windows& windows, const Scale& scale, const Eigen::VectorXd& theta) {
  Windows moved = windows;
  for (int i = 0; i < kEffectRules.place_turns && form.by_place; ++i)
    moved = moved_by(windows, form.columns(moved, scale), theta);
  return moved;
}

std::vector<DesignColumn> offsets(const std::vector<DesignColumn>& columns, const Observations& seen) {
  std::array<bool, kChannels> used{};
  for (const auto& column : columns)
    for (const auto& part : column.parts) used[part.channel] = true;
  const Windows& ws = seen.windows;
  std::vector<DesignColumn> free;
  if (used[kMeanX] || used[kMeanY]) {
    free.push_back(level(ws, [](auto&) -> Vec3 { return Vec3::UnitX(); }));
    free.push_back(level(ws, [](auto&) -> Vec3 { return Vec3::UnitY(); }));
    if (seen.has(Source::attitude))
      for (int i = 0; i < 2; ++i) free.push_back(level(ws, [i](auto& w) -> Vec3 { return w.body_axis(i); }));
  }
  if (used[kMeanZ]) free.push_back(in(kMeanZ, ws, [](auto&) { return 1.0; }));
  if (used[kVarX] || used[kVarY] || used[kVarZ]) {
    for (const Channel c : kVariances) free.push_back(in(c, ws, [](auto&) { return 1.0; }));
    DesignColumn noise;
    for (const Channel c : kVariances)
      noise.parts.push_back(
          {c, values(ws, [&](auto& w) { return kEffectRules.noise_unit / w.sigma[static_cast<int>(c - kVarX)]; })});
    free.push_back(std::move(noise));
  }
  return free;
}

}  // namespace backwash::study
