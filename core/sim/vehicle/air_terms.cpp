// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/vehicle/air_terms.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::sim {
namespace {

using Kind = SimulationTerm::Kind;

constexpr double kMeanBurst = 0.06;  // s: shorter than what a window tells from another variance
constexpr double kMostLoud = 0.07;   // of the time

/// A law as the simulation flies it: exactly as it was fitted.
ModelEffect exact(Law law, const std::vector<double>& x) {
  ModelEffect e{.kind = law};
  const std::size_t values = entry(law).values;
  for (std::size_t i = 0; i < values; ++i) e.value[static_cast<Eigen::Index>(i)] = x[i];
  if (entry(law).scaled) e.scale = x[values];
  return e;
}

/// What a term makes of the air; nothing for terms of other things. Walls count as far as they are seen.
Air air_of(const SimulationTerm& term, const FlightInstant& now, const Around& around) {
  const auto& x = term.value;
  Air air;
  if (const auto* kind = std::get_if<Law>(&term.kind)) {
    const LawEntry& law = entry(*kind);
    law.at ? law.at(exact(*kind, x), around, kSurfaceSight.level, air) : law.moving(exact(*kind, x), now.v_W, air);
  } else if (const SimulationKind& own = entry(std::get<Kind>(term.kind)); own.air) {
    own.air(x, now, air);
  }
  return air;
}

}  // namespace

AirTerms::AirTerms(const map::OccupancyGrid& grid, std::span<const SimulationTerm> terms, std::uint64_t seed)
    : grid_(&grid), terms_(terms.begin(), terms.end()), rng_(seed) {
  for (const auto& term : terms_) {
    if (const auto* law = std::get_if<Law>(&term.kind); law && entry(*law).sight) {
      const Sight sight = entry(*law).sight(exact(*law, term.value));
      if (sight.down > 0) sight_.down = kSurfaceSight.down;
      if (sight.up > 0) sight_.up = kSurfaceSight.up;
      if (sight.level > 0) sight_.level = kSurfaceSight.level;
    }
    if (!term.is(Kind::kurtosis) || !(term.value[0] > 0)) continue;
    // E m² = 1 and E m⁴ = e^K with m² = calm² + difference for a share of the time; calm² is not negative.
    const double excess = std::expm1(term.value[0]), share = std::min(kMostLoud, 0.8 / (1 + excess));
    const double difference = std::sqrt(excess / (share * (1 - share))), calm = 1 - share * difference;
    bursts_.push_back({std::sqrt(calm + difference), std::sqrt(calm), kMeanBurst, kMeanBurst * (1 - share) / share});
  }
}

const Around& AirTerms::around(const Vec3& p_W) {
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

AirTerms::Now AirTerms::step(const FlightInstant& now, double dt) {
  if (terms_.empty()) return {.place_W = now.p_W};
  const Around& seen = around(now.p_W);
  Vec3 push_W = Vec3::Zero(), offset_W = Vec3::Zero();
  double ln_variance = 0;
  for (const auto& term : terms_) {
    const Air air = air_of(term, now, seen);
    push_W += air.push_W;
    ln_variance += air.ln_variance;
    if (term.is(Kind::variance_elsewhere)) offset_W += term.value[0] * Vec3(term.value[1], term.value[2], 0);
  }
  Now then{push_W, std::exp(0.5 * ln_variance), offset_W.isZero() ? now.p_W : moved(now.p_W, offset_W)};
  for (auto& b : bursts_) {
    if (std::generate_canonical<double, 53>(rng_) < 1 - std::exp(-dt / (b.on ? b.mean_on : b.mean_off))) b.on = !b.on;
    then.gust *= b.on ? b.loud : b.calm;
  }
  return then;
}

}  // namespace backwash::sim
