// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/study/inference/search.hpp"

namespace backwash::study {

/// How the loop that flew answers a steady push, along the level axes and up. One without an integrator rests off its
/// set-point by push/k_p; with one the shift decays.
struct SteadyAnswer {
  struct Axes {
    double predicted = 0, measured = 0;   ///< root mean squares of the shift over the hovers, m
    double left = 1, low = -1, high = 2;  ///< share of the predicted shift that was measured, 95 % over flights
    double rate = 0;                      ///< at which it decays, 1/s; 0: no decay was told
    bool matters() const;                 ///< the pushes would move the craft
    bool told() const;                    ///< the interval is narrower than 1, or nothing is to be told
    /// The craft rests where the push holds it, as far as is known: the plan's centre may be there.
    bool keeps() const;
  };
  std::array<Axes, 2> axes;  ///< level, up
};

/// Push of accepted causes and what they leave open in each window, m/s², but for what a sensor alone tells. `beside`:
/// coefficients of each form's companions.
std::vector<Vec3> pushes(std::span<const Accepted> causes, std::span<const std::vector<double>> beside,
                         const Observations& seen);

/// Of such pushes, in the hovers (docs/model.md 8-11, 8-12). Precondition: a log begins where the craft stands or is
/// held, its integrator empty. Nothing matters where the vehicle file has an integrator of its own, where no set-points
/// say where the craft should be, or in fewer than 3 flights. O(windows).
SteadyAnswer steady_answer(std::span<const Vec3> push_W, const Observations& seen);

}  // namespace backwash::study
