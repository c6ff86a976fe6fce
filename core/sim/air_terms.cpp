// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/air_terms.hpp"

#include <algorithm>
#include <cmath>

#include "core/field/extension.hpp"

namespace backwash::sim {
namespace {

using Kind = SimulationTerm::Kind;
using field::kCeilingReference, field::kSurfaceReference, field::near_surface;

constexpr double kMeanBurst = 0.06;  // s: shorter than what a window tells from another variance
constexpr double kMostLoud = 0.07;   // of the time

/// What a term pushes with, m/s² in W; zero for terms of other things.
Vec3 push_of(const SimulationTerm& term, const Flying& now, const field::Around& around) {
  const auto& x = term.value;
  switch (term.kind) {
    case Kind::push:
      return {x[0], x[1], x[2]};
    case Kind::push_of_heading:
      return {x[0] * std::cos(now.yaw) - x[1] * std::sin(now.yaw), x[0] * std::sin(now.yaw) + x[1] * std::cos(now.yaw),
              0};
    case Kind::push_over_surface:
      return {0, 0, x[0] * near_surface(around.height, kSurfaceReference, x[1])};
    case Kind::push_under_surface:
      return {0, 0, x[0] * near_surface(around.ceiling_gap, kCeilingReference, x[1])};
    case Kind::push_to_walls: {
      Vec3 sum = Vec3::Zero();
      for (const auto& [distance, direction] : around.walls)
        sum += x[0] * near_surface(distance, kSurfaceReference, x[1]) * direction;
      return sum;
    }
    case Kind::push_against_velocity:
      return {-x[0] * now.v_W.x(), -x[0] * now.v_W.y(), 0};
    case Kind::push_against_climb:
      return {0, 0, -x[0] * now.v_W.z()};
    case Kind::push_with_speed:
      return {0, 0, x[0] * now.v_W.squaredNorm()};
    default:
      return Vec3::Zero();
  }
}

/// What a term adds to ln Σ.
double ln_variance_of(const SimulationTerm& term, const Flying& now, const field::Around& around) {
  const auto& x = term.value;
  if (term.kind == Kind::ln_variance_under_surface)
    return x[0] * near_surface(around.ceiling_gap, kCeilingReference, x[1]);
  if (term.kind == Kind::ln_variance_with_speed) return x[0] * std::pow(now.v_W.norm(), x[1]);
  if (term.kind == Kind::ln_variance_with_time) return x[0] * (1 - std::exp(-now.t / x[1]));
  return 0;
}

}  // namespace

AirTerms::AirTerms(const map::OccupancyGrid& grid, std::span<const SimulationTerm> terms, std::uint64_t seed)
    : grid_(&grid), terms_(terms.begin(), terms.end()), rng_(seed) {
  for (const auto& term : terms_) {
    if (term.kind == Kind::push_over_surface) sight_.down = 20;
    if (term.kind == Kind::push_under_surface || term.kind == Kind::ln_variance_under_surface) sight_.up = 20;
    if (term.kind == Kind::push_to_walls) sight_.level = 3;
    if (term.kind != Kind::kurtosis || !(term.value[0] > 0)) continue;
    // E m² = 1 and E m⁴ = e^K with m² = calm² + difference for a share of the time; calm² is not negative.
    const double excess = std::expm1(term.value[0]), share = std::min(kMostLoud, 0.8 / (1 + excess));
    const double difference = std::sqrt(excess / (share * (1 - share))), calm = 1 - share * difference;
    bursts_.push_back({std::sqrt(calm + difference), std::sqrt(calm), kMeanBurst, kMeanBurst * (1 - share) / share});
  }
}

const field::Around& AirTerms::around(const Vec3& p_W) {
  if (!last_look_ || (p_W - last_look_->first).norm() > kRecast)
    last_look_.emplace(p_W, field::around(*grid_, p_W, sight_));
  return last_look_->second;
}

/// The place moved by an offset; where that leads into what is not free, as far as is free.
Vec3 AirTerms::moved(const Vec3& p_W, const Vec3& offset_W) const {
  constexpr int kParts = 10;
  Vec3 reached = p_W;
  for (int k = 1; k <= kParts; ++k) {
    const Vec3 at = p_W + offset_W * (static_cast<double>(k) / kParts);
    if (!grid_->free(grid_->index(at))) break;
    reached = at;
  }
  return reached;
}

AirTerms::Now AirTerms::step(const Flying& now, double dt) {
  Now air{.place_W = now.p_W};
  if (terms_.empty()) return air;
  const field::Around& seen = around(now.p_W);
  double ln_variance = 0;
  Vec3 offset_W = Vec3::Zero();
  for (const auto& term : terms_) {
    air.push_W += push_of(term, now, seen);
    ln_variance += ln_variance_of(term, now, seen);
    if (term.kind == Kind::variance_elsewhere) offset_W += term.value[0] * Vec3(term.value[1], term.value[2], 0);
  }
  if (!offset_W.isZero()) air.place_W = moved(now.p_W, offset_W);
  air.gust = std::exp(0.5 * ln_variance);
  for (auto& b : bursts_) {
    if (std::generate_canonical<double, 53>(rng_) < 1 - std::exp(-dt / (b.on ? b.mean_on : b.mean_off))) b.on = !b.on;
    air.gust *= b.on ? b.loud : b.calm;
  }
  return air;
}

}  // namespace backwash::sim
