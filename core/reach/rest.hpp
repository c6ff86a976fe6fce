// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "core/reach/reach_tube.hpp"

namespace backwash::reach {

/// Periods of 20 ms after which a loop remembers at most 2 % of what blew before. A choice: half of it lengthens each
/// sweep by the time in which the loop halves an error, twice of it widens sets at rest by 2 % of how much rougher the
/// way was than the place. WidthsAtRest holds with any.
std::size_t settling_periods(const Reachability& reach);

/// Half widths that hold for ever at a place of rest c where at most w̄ blows, after a tube that ends there
/// (docs/model.md 5.2-8): what is left of the first set, of the centre's motion and of rougher air on the way joins h_∞
/// w̄. By a stated risk all of it is wider (BoundModel::at_rest). Method tight.
class WidthsAtRest {
 public:
  /// `arrival`: from its last entry on the command rests, at the place with the centre `c_W`. O(memory of the loop).
  WidthsAtRest(const Reachability& reach, const ReachTube& arrival, const Vec3& c_W, const BoundModel& model = {});
  /// m, for a largest w̄ from there on; not always rising in it where the way was rougher. O(memory of the loop).
  PerDirection operator()(const DisturbanceBound& w_bar) const noexcept;

 private:
  struct Axis {
    double h_inf, tail;
    std::vector<double> share;  // of the step that is so many steps old at the tube's end, at any time after it, s²
  };
  Axis horizontal_, vertical_;
  double times_;                     // the widths
  PerDirection left_{};              // of the first set and the centre's motion, m
  std::vector<DisturbanceBound> w_;  // the newest steps', the last one first
  DisturbanceBound older_;           // largest of all others
};

}  // namespace backwash::reach
