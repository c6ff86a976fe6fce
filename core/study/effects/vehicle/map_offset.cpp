// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <numbers>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/effect_rules.hpp"

namespace backwash::study {
namespace {

/// Around, near and far.
std::vector<Scale> tried_offsets() {
  std::vector<Scale> offsets;
  constexpr double kTurn = 2 * std::numbers::pi / kEffectRules.offset_directions;
  for (const double length : {kEffectRules.offset_near.value, 2 * kEffectRules.offset_near})
    for (int k = 0; k < kEffectRules.offset_directions; ++k)
      offsets.push_back({0, whole_millimetres(length * Vec3(std::cos(kTurn * k), std::sin(kTurn * k), 0))});
  return offsets;
}

}  // namespace

Vec3 whole_millimetres(const Vec3& offset_W) {
  return {(std::round(500 + 1000 * offset_W.x()) - 500) / 1000, (std::round(500 + 1000 * offset_W.y()) - 500) / 1000,
          0};
}

std::vector<DesignColumn> displaced(const Windows& ws, const Vec3& offset_W) {
  DesignColumn column;
  for (const Channel c : kVariances)
    column.parts.push_back(
        {c, values(ws, [&](auto& w) { return w.ln_sigma_at(offset_W)[static_cast<int>(c - kVarX)]; })});
  return {column};
}

/// The map lies beside where it says: gusts are where the vehicle believes that no surface is.
Effect map_offset() {
  return {.name = "map_offset",
          .forms = {{.formula = "ln variance as modelled at the position plus a level offset",
                     .parameters = {"share"},
                     .priors = {{kPriors.typical_ln, 0, HUGE_VAL, "a share of what the map says there"}},
                     .scale_name = "offset",
                     .scales = tried_offsets(),
                     .integer_scale = true,
                     .displaces_map = true,
                     .floor = 0.12,
                     .one_sided = true,
                     .needs = {Source::map},
                     .columns = [](const Windows& ws, const Scale& scale) { return displaced(ws, scale.offset_W); },
                     .simulate =
                         [](const FittedForm& fitted, const Observations&) {
                           const Vec3& offset_W = fitted.scale.offset_W;
                           return std::vector<SimulationTerm>{{SimulationTerm::Kind::variance_elsewhere,
                                                               {fitted.theta[0], offset_W.x(), offset_W.y()}}};
                         }}},
          .remedy = [](auto& fitted, auto&) {
            char text[96];
            const Vec3& by = fitted.scale.offset_W;
            std::snprintf(text, sizeof text, "Move the map by %.2f m along x and %.2f m along y.", -by.x(), -by.y());
            return Remedy{RemedyIn::map, {}, text};
          }};
}

}  // namespace backwash::study
