// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

double exponential(double d, double length) { return near_surface(d, kSurfaceReference, length); }
double power(double d, double n) { return power_of_distance(d, kSurfaceReference, n); }

/// Columns of a pull amount(distance, scale) towards each wall; whole: towards those from floor to ceiling alone.
auto pull(bool whole, double (*amount)(double, double)) {
  return [whole, amount](const Windows& ws, const Scale& scale) {
    return std::vector{level(ws, [&](auto& w) {
      return along(w, [&](auto& at) {
        return towards(whole ? at.whole_walls : at.walls, [&](double d) { return amount(d, scale.value); });
      });
    })};
  };
}

std::optional<std::string> not_near_one(const Observations& seen) {
  if (any(seen, [](auto& w) { return !w.around.walls.empty(); })) return std::nullopt;
  return "no wall within 3 m of the flights";
}

double nearest(const WindowRow& w) {
  double least = kNoSurface;
  for (const auto& [distance, direction] : w.around.walls) least = std::min(least, distance);
  return least;
}

}  // namespace

/// Walls pull: the wash between rotor and wall is faster than that on the other side.
Effect wall_attraction() {
  const std::string formula = "push A exp(-(d - 0.4 m)/L) towards each wall at distance d";
  const auto lengths = scales_of({0.08, 0.15, 0.3, 0.6}), exponents = scales_of({1.0, 3.0});
  return {.name = "wall_attraction",
          .forms = {{.formula = formula,
                     .parameters = {"A_mps2"},
                     .priors = {{kPriors.typical_push}},
                     .reference = Reference{kSurfaceReference, "m from the wall", nearest},
                     .scale_name = "L_m",
                     .scales = lengths,
                     .by_place = true,
                     .floor = 0.02,
                     .needs = {Source::map},
                     .not_flown = not_near_one,
                     .columns = pull(false, exponential),
                     .shapes = {{.formula = "push A (0.4 m/d)^n towards each wall",
                                 .parameters = {},
                                 .scale_name = "n",
                                 .scales = exponents,
                                 .columns = pull(false, power)},
                                {.formula = formula + ", from floor to ceiling alone",
                                 .parameters = {},
                                 .scale_name = "n",
                                 .scales = lengths,
                                 .columns = pull(true, exponential)},
                                {.formula = "push A (0.4 m/d)^n towards walls from floor to ceiling",
                                 .parameters = {},
                                 .scale_name = "n",
                                 .scales = exponents,
                                 .columns = pull(true, power)}},
                     .extend = extends(Law::push_to_walls),
                     .simulate = simulates(Law::push_to_walls)}},
          .axis = {"distance to the nearest wall, m", false, nearest},
          .towards_walls = true,
          .manoeuvres = {{"approach a wall to 0.35 m from both sides", [](WindowRow& w, double s) {
                            const double d = 0.35 + 1.2 * std::abs(std::fmod(2 * s, 1.0) - 0.5) * 2;
                            w.around.walls = {{d, s < 0.5 ? Vec3(Vec3::UnitX()) : Vec3(-Vec3::UnitX())}};
                          }}}};
}

}  // namespace backwash::study
