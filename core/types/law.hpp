// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "core/types/around.hpp"

/// The laws of place and velocity by which a model is extended (docs/model.md 6-1 to 6-6). This file alone knows them:
/// what reads and writes model files, field, reach, plan and simulation go through kLaws. Another law: its name in Law,
/// its function, its entry in kLaws and its equation in docs/model.md.
namespace backwash {

enum class Law {
  push,                       ///< x, y, z m/s² of W, everywhere
  push_over_surface,          ///< m/s² up, 0.4 m over the surface below; scale m
  push_under_surface,         ///< m/s² up, 0.3 m under the surface above; scale m
  push_to_walls,              ///< m/s² towards each wall, 0.4 m from it; scale m
  push_against_velocity,      ///< 1/s, level
  push_against_climb,         ///< 1/s, along z
  push_with_speed,            ///< m/s² up at 1 m/s
  ln_variance,                ///< of Σ, everywhere
  ln_variance_under_surface,  ///< 0.3 m under the surface above; scale m
  ln_variance_with_speed,     ///< at 1 m/s; scale: exponent
  count
};

/// A law with its numbers, in the units of docs/model.md: what an accepted cause of the study adds to the model
/// (core/study/README.md, "Extension"), an entry of [[extension.term]].effect. `error`: half width of the value's 95 %
/// interval, what stays unknown.
struct ModelEffect {
  Law kind = Law::push;
  Vec3 value = Vec3::Zero(), error = Vec3::Zero();  ///< as many as the law has values; x alone, but for `push`
  double scale = 0;                                 ///< of a scaled law: m, or an exponent
};

/// What effects make of the air: a mean push, what of it stays unknown, and a factor of Σ.
struct Air {
  Vec3 push_W = Vec3::Zero();      ///< m/s²
  double level = 0, vertical = 0;  ///< the push is known up to this, horizontally and along z, m/s²
  double ln_variance = 0;          ///< ln of the factor of Σ
};

inline constexpr double kSurfaceReference = 0.4;  ///< m, floors and walls
inline constexpr double kCeilingReference = 0.3;  ///< m
inline constexpr double kSurfaceNearest = 0.15;   ///< m: what was flown does not say how it goes on
inline constexpr Sight kSurfaceSight{20, 20, 3};  ///< as far as the study looks for surfaces

/// e^{−(max(distance, kSurfaceNearest) − reference)/length}; 0 where there is no surface.
inline double near_surface(double distance, double reference, double length) noexcept {
  return std::isfinite(distance) ? std::exp(-(std::max(distance, kSurfaceNearest) - reference) / length) : 0.0;
}

/// Each adds to `air` what its law makes of it; `reach`: walls farther than this push with nothing, m.
namespace laws {

inline Sight below(const ModelEffect&) { return {kSurfaceSight.down, 0, 0}; }
inline Sight above(const ModelEffect&) { return {0, kSurfaceSight.up, 0}; }
/// Walls as far as their push is worth looking for, by its larger end.
inline Sight to_walls(const ModelEffect& e) {
  constexpr double kNegligible = 2e-3;  // m/s²
  const double size = std::max(std::abs(e.value.x()) + e.error.x(), kNegligible);
  const double reach = kSurfaceReference + e.scale * std::log(size / kNegligible);
  return {0, 0, std::clamp(reach, kSurfaceNearest, kSurfaceSight.level)};
}

inline void lift(const ModelEffect& e, double share, Air& air) noexcept {
  air.push_W.z() += e.value.x() * share;
  air.vertical += e.error.x() * share;
}
inline void scatter(const ModelEffect& e, double share, Air& air) noexcept {
  air.ln_variance += (e.value.x() + e.error.x()) * share;
}

inline void push(const ModelEffect& e, const Vec3&, Air& air) noexcept {
  air.push_W += e.value;
  air.level += std::hypot(e.error.x(), e.error.y());
  air.vertical += e.error.z();
}
inline void push_over_surface(const ModelEffect& e, const Around& around, double, Air& air) {
  lift(e, near_surface(around.height, kSurfaceReference, e.scale), air);
}
inline void push_under_surface(const ModelEffect& e, const Around& around, double, Air& air) {
  lift(e, near_surface(around.ceiling_gap, kCeilingReference, e.scale), air);
}
inline void push_to_walls(const ModelEffect& e, const Around& around, double reach, Air& air) {
  for (const auto& [distance, direction] : around.walls) {
    if (distance > reach) continue;
    const double share = near_surface(distance, kSurfaceReference, e.scale);
    air.push_W += e.value.x() * share * direction;
    air.level += e.error.x() * share;
  }
}
inline void push_against_velocity(const ModelEffect& e, const Vec3& v_W, Air& air) noexcept {
  air.push_W -= e.value.x() * Vec3(v_W.x(), v_W.y(), 0);
  air.level += e.error.x() * std::hypot(v_W.x(), v_W.y());
}
inline void push_against_climb(const ModelEffect& e, const Vec3& v_W, Air& air) noexcept {
  air.push_W.z() -= e.value.x() * v_W.z();
  air.vertical += e.error.x() * std::abs(v_W.z());
}
inline void push_with_speed(const ModelEffect& e, const Vec3& v_W, Air& air) noexcept {
  lift(e, v_W.squaredNorm(), air);
}
inline void ln_variance(const ModelEffect& e, const Vec3&, Air& air) noexcept { scatter(e, 1, air); }
inline void ln_variance_under_surface(const ModelEffect& e, const Around& around, double, Air& air) {
  scatter(e, near_surface(around.ceiling_gap, kCeilingReference, e.scale), air);
}
inline void ln_variance_with_speed(const ModelEffect& e, const Vec3& v_W, Air& air) noexcept {
  scatter(e, std::pow(v_W.norm(), e.scale), air);
}

}  // namespace laws

/// All that other code knows of a law. Either by place (`sight` and `at`) or by velocity (`moving`, which is real-time:
/// wait-free, no allocation).
struct LawEntry {
  Law law;
  std::string_view name;  ///< `kind` in a model file
  std::size_t values = 1;
  bool scaled = false;
  bool of_variance = false;  ///< no push
  Sight (*sight)(const ModelEffect&) = nullptr;
  void (*at)(const ModelEffect&, const Around&, double reach, Air&) = nullptr;
  void (*moving)(const ModelEffect&, const Vec3& v_W, Air&) noexcept = nullptr;
};

/// In the order of Law.
inline constexpr std::array<LawEntry, static_cast<std::size_t>(Law::count)> kLaws = {
    LawEntry{.law = Law::push, .name = "push", .values = 3, .moving = laws::push},
    LawEntry{.law = Law::push_over_surface,
             .name = "push_over_surface",
             .scaled = true,
             .sight = laws::below,
             .at = laws::push_over_surface},
    LawEntry{.law = Law::push_under_surface,
             .name = "push_under_surface",
             .scaled = true,
             .sight = laws::above,
             .at = laws::push_under_surface},
    LawEntry{.law = Law::push_to_walls,
             .name = "push_to_walls",
             .scaled = true,
             .sight = laws::to_walls,
             .at = laws::push_to_walls},
    LawEntry{.law = Law::push_against_velocity, .name = "push_against_velocity", .moving = laws::push_against_velocity},
    LawEntry{.law = Law::push_against_climb, .name = "push_against_climb", .moving = laws::push_against_climb},
    LawEntry{.law = Law::push_with_speed, .name = "push_with_speed", .moving = laws::push_with_speed},
    LawEntry{.law = Law::ln_variance, .name = "ln_variance", .of_variance = true, .moving = laws::ln_variance},
    LawEntry{.law = Law::ln_variance_under_surface,
             .name = "ln_variance_under_surface",
             .scaled = true,
             .of_variance = true,
             .sight = laws::above,
             .at = laws::ln_variance_under_surface},
    LawEntry{.law = Law::ln_variance_with_speed,
             .name = "ln_variance_with_speed",
             .scaled = true,
             .of_variance = true,
             .moving = laws::ln_variance_with_speed},
};

/// Real-time: wait-free, no allocation.
constexpr const LawEntry& entry(Law law) noexcept { return kLaws[static_cast<std::size_t>(law)]; }

static_assert(
    [] {
      for (const LawEntry& e : kLaws)
        if (&entry(e.law) != &e || !e.at == !e.moving || !e.at != !e.sight || e.name.empty()) return false;
      return true;
    }(),
    "kLaws holds each Law once, in their order, by place with what it sees or by velocity");

}  // namespace backwash
