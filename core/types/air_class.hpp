// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/types/disturbance.hpp"

namespace backwash {

/// The term of Σ that is largest at a place (docs/model.md 7-1): what makes the air rough there.
enum class AirClass : std::uint8_t {
  free_air,  ///< Σ_0
  ground,
  wall,
  corner,
  none  ///< not known: no Σ at the place, or no attitude
};
inline constexpr std::size_t kAirClasses = 5;

/// Factors on Σ by class: 1 is as modelled, less is calmer.
using AirFactors = std::array<double, kAirClasses>;
inline constexpr AirFactors kModelledAir{1, 1, 1, 1, 1};

/// The factor at a place of this class. Rougher air that was learnt without a class may be of any, and counts for all.
constexpr double factor_of(const AirFactors& factors, AirClass air) noexcept {
  const double known = factors[static_cast<std::size_t>(air)];
  const double unnamed = factors[static_cast<std::size_t>(AirClass::none)];
  return unnamed > 1 && unnamed > known ? unnamed : known;
}
/// By this share a factor may be above that of the sets which are flown. Below the model's none may: that was shown
/// for the air of then.
inline constexpr double kAirStep = 0.05;
/// Whether sets made with these factors are large enough for the air as it is known now. Where not, a world is made
/// anew, and until it is there no new way begins (docs/faults.md row 54).
constexpr bool covers(const AirFactors& made, const AirFactors& now) noexcept {
  for (std::size_t k = 0; k < kAirClasses; ++k)
    if (!(now[k] <= (made[k] < 1 ? 1 : 1 + kAirStep) * made[k])) return false;
  return true;
}
/// The larger factor of each class.
constexpr AirFactors larger(AirFactors a, const AirFactors& b) noexcept {
  for (std::size_t k = 0; k < kAirClasses; ++k) a[k] = a[k] > b[k] ? a[k] : b[k];
  return a;
}

constexpr const char* to_string(AirClass air) noexcept {
  constexpr std::array<const char*, kAirClasses> kNames{"free_air", "ground", "wall", "corner", "none"};
  return kNames[static_cast<std::size_t>(air)];
}

/// The term with the largest trace, (m/s²)²; of equal ones the first. A term that is not finite: none.
inline AirClass dominant(const Variance& base, const Variance& ground, const Variance& wall,
                         const Variance& corner) noexcept {
  const auto trace = [](const Variance& v) { return v.xx + v.yy + v.zz; };
  const std::array<double, kAirClasses - 1> traces{trace(base), trace(ground), trace(wall), trace(corner)};
  std::size_t largest = 0;
  double sum = 0;
  for (std::size_t k = 0; k < traces.size(); ++k) {
    sum += traces[k];
    if (traces[k] > traces[largest]) largest = k;
  }
  return std::isfinite(sum) ? static_cast<AirClass>(largest) : AirClass::none;
}

}  // namespace backwash
