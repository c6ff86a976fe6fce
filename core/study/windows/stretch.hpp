// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/windows/gates/window_rules.hpp"
#include "core/study/windows/signals/series.hpp"

namespace backwash::study {

/// Samples begin … end − 1.
struct SampleRange {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

/// Windows of kWindowRules.window_length (to the nearest whole number in each run of rows without a gap and of one
/// segment).
std::vector<SampleRange> cut(const Series& s);

}  // namespace backwash::study
