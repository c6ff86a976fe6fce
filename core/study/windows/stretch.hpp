// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/windows/signals/series.hpp"

namespace backwash::study {

/// Samples begin … end − 1.
struct SampleRange {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

}  // namespace backwash::study
