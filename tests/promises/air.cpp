// SPDX-License-Identifier: BSD-3-Clause
#include "tests/promises/air.hpp"

#include <algorithm>
#include <numeric>

#include "core/reach/bound/bound_code.hpp"
#include "tests/field/brute_force.hpp"

namespace backwash::promises {
namespace {

/// An unknown floor: up elements of unknown voxels below free ones, below the map as well.
void add_unknown_floor(std::vector<oracle::Piece>& pieces, const map::OccupancyGrid& grid) {
  const double a = grid.resolution();
  for (int k = -1; k < grid.size().z(); ++k)
    for (int j = 0; j < grid.size().y(); ++j)
      for (int i = 0; i < grid.size().x(); ++i)
        if (grid.at({i, j, k}) == map::Cell::unknown && grid.free({i, j, k + 1}))
          pieces.push_back({true, grid.center({i, j, k}) + Vec3(0, 0, a / 2), Vec3(0, 0, 1), a * a, std::nullopt});
}

/// The factor of the class with the largest trace; nothing where two are about equal.
std::optional<double> factor(const Mat3& base, const oracle::Parts& parts, const AirFactors& factors) {
  const std::array<double, 4> traces{base.trace(), parts.ground.trace(), parts.wall.trace(), parts.corner.trace()};
  const auto most = std::ranges::max_element(traces);
  for (auto other = traces.begin(); other != traces.end(); ++other)
    if (other != most && *other > *most * (1 - 1e-4)) return std::nullopt;
  const double unnamed = factors[4], named = factors[static_cast<std::size_t>(most - traces.begin())];
  return unnamed > 1 ? std::max(unnamed, named) : named;
}

/// Largest deviation of w + i at some time after gusts of deviation `here` for a while, and before that of 0 or
/// `elsewhere`: variance of the sum over ages, with correlation e^{−|τ|/τ_w}.
double deviation_with_charge(const std::vector<double>& charge, double step, double tau_w, double here,
                             double elsewhere, Random& random) {
  const double rho = std::exp(-step / tau_w), recent = random.magnitude(1e-3, 10), rate = random.magnitude(1e-4, 0.1);
  const bool sided = random.chance(0.5);
  bool on = random.chance(0.5);
  double variance = here * here, correlated = here;
  for (std::size_t age = 1; age < charge.size(); ++age) {
    on = random.chance(rate) ? !on : on;
    const bool blows = sided ? charge[age] > 0 : on;
    const double x = charge[age] * (static_cast<double>(age) * step < recent ? here : blows ? elsewhere : 0);
    correlated *= rho;
    variance += x * x + 2 * x * correlated;
    correlated += x;
  }
  return std::sqrt(std::max(0.0, variance));
}

}  // namespace

Air::Air(Random& random, const Vehicle& vehicle)
    : drawn(draw_model(random, !reach::has_integrator(vehicle) || random.chance(0.5))) {
  const bool window = random.chance(0.4);
  drawn.model.unknown_floor = window;
  world = plan::build_world(draw_map(random, {5, 5, 4}, {14, 14, 9}, window), drawn.model, vehicle);
  if (drawn.factors != kModelledAir) world = plan::rebuilt(*world, {.air = drawn.factors});
  for (std::size_t n = 0; n < world->grid.cell_count(); ++n) w.push_back(world->bounds.at(world->grid.voxel(n)).w);
  demand_field(random);
}

void Air::demand_field(Random& random) const {
  const map::OccupancyGrid& grid = world->grid;
  const Model model = plan::with_vehicle(drawn.model, world->reach.vehicle);
  auto pieces = oracle::pieces(grid);
  if (model.unknown_floor) add_unknown_floor(pieces, grid);
  const auto occupied = oracle::occupied_centers(grid);
  const Mat3 base = Vec3(model.base.horizontal, model.base.horizontal, model.base.vertical).asDiagonal();
  for (int look = 0, seen = 0; look < 40 && seen < 3; ++look) {
    const auto n = static_cast<std::size_t>(random.whole(0, static_cast<int>(grid.cell_count()) - 1));
    if (!(w[n][kZ] > 0)) continue;
    ++seen;
    const oracle::Parts parts = oracle::evaluate(grid, pieces, occupied, model, grid.center(grid.voxel(n)));
    const auto rougher = factor(base, parts, drawn.factors);
    if (!rougher) continue;
    const Mat3 sigma = *rougher * (base + parts.ground + parts.corner + parts.wall);
    for (std::size_t d = 0; d < kDirections; ++d) {
      const Vec3 along = unit(static_cast<Direction>(d));
      const double mean = d == kZ ? model.bound.mean_vertical : model.bound.mean_horizontal;
      const double expected = mean + model.bound.kappa * std::sqrt(along.dot(sigma * along));
      const std::string what = "bound of voxel " + std::to_string(n) + ", direction " + std::to_string(d);
      demand_at_most(expected * (1 - 1e-5), w[n][d], what);
      demand_at_most(w[n][d], expected * (1 + 1e-5 + reach::kBoundGrowth), what);
    }
  }
}

PerDirection Air::largest(const Vec3& low, const Vec3& high) const {
  const map::OccupancyGrid& grid = world->grid;
  const double a = grid.resolution();
  PerDirection most{};
  std::size_t n = 0;
  for (int k = 0; k < grid.size().z(); ++k)
    for (int j = 0; j < grid.size().y(); ++j)
      for (int i = 0; i < grid.size().x(); ++i, ++n) {
        const Vec3 corner = grid.origin() + a * Vec3(i, j, k);
        if ((corner.array() > high.array()).any() || (corner.array() + a < low.array()).any()) continue;
        for (std::size_t d = 0; d < kDirections; ++d) most[d] = std::max(most[d], w[n][d]);
      }
  return most;
}

void Air::demand_bounds(const reach::ReachTube& tube, const std::vector<Answer>& charged, Random& random) const {
  for (int look = charged.empty() ? 0 : 2; look < 3; ++look) {
    const auto looked_at = static_cast<Direction>(random.whole(0, kDirections - 1));
    const auto k = static_cast<std::size_t>(random.whole(0, static_cast<int>(tube.size()) - 2));
    const PerDirection& h = tube[k].half_widths_interval;
    const Vec3 half(h[kX], h[kY], h[kZ]), a = tube[k].center.p_W, b = tube[k + 1].center.p_W;
    PerDirection least = largest(a.cwiseMin(b) - half, a.cwiseMax(b) + half);
    const PerDirection most = largest(a.cwiseMin(b) - 2 * half, a.cwiseMax(b) + 2 * half);
    const PerDirection all = charged.empty() ? PerDirection{} : world->bounds.largest().w;
    for (std::size_t d = 0; d < kDirections; ++d) {
      const std::string what = "bound of step " + std::to_string(k) + ", direction " + std::to_string(d);
      if (charged.empty()) {
        demand_at_most(tube[k].w_bar.w[d], most[d], what + ", too large");
      } else if (d == looked_at) {
        const BoundModel& model = drawn.model.bound;
        const double mean = d == kZ ? model.mean_vertical : model.mean_horizontal;
        const auto sigmas = [&](double bound) { return std::max(0.0, bound - mean) / model.kappa; };
        const double deviation =
            deviation_with_charge(charged[d == kZ].charge[0], kControlPeriod / charged[d == kZ].per_period,
                                  std::max(model.tau_w, kControlPeriod), sigmas(least[d]), sigmas(all[d]), random);
        least[d] = (mean + model.kappa * deviation) * 0.995;
      } else {
        continue;
      }
      demand_at_most(least[d], tube[k].w_bar.w[d], what + ", too small");
    }
  }
}

}  // namespace backwash::promises
