// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/study/calibrate/calibrate.hpp"
#include "core/study/calibrate/calibration_rules.hpp"
#include "core/study/calibrate/features.hpp"
#include "core/types/text.hpp"

namespace backwash::study::calibrate {
namespace {

constexpr auto kLeastHovers = static_cast<std::size_t>(kCalibrationRules.least_hovers);
constexpr double kLeastSpread = kCalibrationRules.least_spread;
const std::vector<Parameter> kGroundAll = {kGroundLambdaH, kGroundLambdaZ, kGroundK1H, kGroundK1Z, kGroundK2};
const std::vector<Parameter> kCornerAll = {kCornerN, kCornerT, kCornerZ};
const std::vector<Parameter> kWallAll = {kWallN, kWallT, kWallZ, kWallK2};

struct Range {
  double low = kFar, high = -kFar;
  std::size_t hovers = 0;
  void include(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
    hovers += 1;
  }
  double spread() const { return hovers > 0 ? high - low : 0; }
};

std::string metres(double x) { return to_text(x, 2) + " m"; }

std::vector<Refusal> too_few_flights(const Data& data) {
  std::map<std::size_t, std::size_t> flights;
  for (const auto place : data.place) flights[place] += 1;
  std::size_t fewest = data.place.size();
  for (const auto& [place, count] : flights) fewest = std::min(fewest, count);
  if (static_cast<double>(data.place.size()) >= kCalibrationRules.least_flights &&
      static_cast<double>(fewest) >= kCalibrationRules.least_of_place && !data.hovers.empty())
    return {};
  std::vector<Parameter> all;
  for (std::size_t p = 0; p < kParameters; ++p) all.push_back(static_cast<Parameter>(p));
  return {{"all", all,
           data.hovers.empty()
               ? "no window of hover is left after gating"
               : std::to_string(data.place.size()) + " flights, " + std::to_string(fewest) +
                     " in one map: flights differ by a third and the scatter between them cannot be told",
           "repeat the same hovers in at least 3 flights, 2 or more in each map, better 10"}};
}

}  // namespace

std::vector<Refusal> refusals(const Data& data, const Model& gates) {
  auto refused = too_few_flights(data);
  if (!refused.empty()) return refused;
  Range height, wall, corner, no_corner;
  double nearest = kFar;
  for (const auto& h : data.hovers) {
    const auto& f = h.features;
    if (std::isfinite(f.height) && f.ground_inverse > 0) height.include(f.height);
    if (f.wall[0] > 0) wall.include(f.wall_distance);
    if (f.corner > 0) corner.include(f.wall_distance);
    if (f.corner == 0 && f.wall[0] > 0) no_corner.include(f.wall_distance);
    nearest = std::min(nearest, f.wall_distance);
  }
  if (height.hovers < kLeastHovers || height.spread() < kLeastSpread)
    refused.push_back({"ground", kGroundAll,
                       height.hovers < kLeastHovers
                           ? "too few hovers above a floor within the gates"
                           : "one height only (" + metres(height.low) + " to " + metres(height.high) + ")",
                       "hover at 0.3, 0.6, 1.0 and 1.8 m above the floor, 20 s each"});
  if (wall.hovers < kLeastHovers || wall.spread() < kLeastSpread)
    refused.push_back({"wall", kWallAll,
                       wall.hovers == 0 ? "no wall closer than l_max = " + metres(gates.wall.l_max) +
                                              (std::isfinite(nearest) ? " (nearest " + metres(nearest) + ")" : "")
                       : wall.hovers < kLeastHovers
                           ? "only " + std::to_string(wall.hovers) + " hovers beside a wall"
                           : "one distance only (" + metres(wall.low) + " to " + metres(wall.high) + ")",
                       "hover 0.3, 0.5, 0.8 and 1.2 m from a wall at 1 m height or more, 20 s each"});
  if (corner.hovers < kLeastHovers || no_corner.hovers == 0)
    refused.push_back({"corner", kCornerAll,
                       corner.hovers < kLeastHovers
                           ? "fewer than 6 hovers within l_max = " + metres(gates.corner.l_max) +
                                 " of the foot of a wall and inside phi_max"
                           : "every hover beside a wall is near its foot too: wall and corner look alike",
                       "hover 0.3 and 0.6 m from a wall at heights of 0.4, 0.8 and 1.5 m, 20 s each"});
  return refused;
}

}  // namespace backwash::study::calibrate
