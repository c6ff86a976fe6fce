// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/study/effects/regressors.hpp"

/// Structures without a name: what is tried where no form of the catalogue may fit.
namespace backwash::study {

/// Functions of the windows, one value each.
using Functions = std::vector<std::vector<double>>;

/// Something that varies along one regressor or two, whatever its shape.
struct Structure {
  std::string along;              ///< a regressor's name; of two "x_m, y_m"
  std::string shape;              ///< what its functions are: "4 cosines", "turn 3", "products", "0.0714 Hz"
  std::optional<double> hz = {};  ///< of a tone in the time since the flight began, its phase common to all flights
  Functions functions;
  /// The functions of its n-th further harmonic, n = 1, 2, …; none where there is no more.
  std::function<Functions(int n)> further = [](int) { return Functions{}; };
};

/// Gives everything that is tried to `take`, one after another, for all of them are a thousand columns: cos(π k q), k =
/// 1 … 4 and 1 … 8, of each regressor's rank q in [0, 1]; of an angle one and two turns, and each turn alone; products
/// of the first two of any two regressors; tones of which the step is half of 1/(longest flight), from 1.5/(longest
/// flight) to a quarter of a hertz, where a window of 2 s still shows 0.64 of it.
void each_structure(const Observations& seen, const std::function<void(Structure&&)>& take);

/// Functions as columns of one group of channels: level means each for themselves (a push may point anywhere in the
/// plane), ln variance along all axes as one.
std::vector<DesignColumn> columns_in(const std::vector<Channel>& group, const Functions& functions);

}  // namespace backwash::study
