// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "core/types/clones.hpp"

namespace backwash::field {

#ifdef BACKWASH_LEVELS
template <typename Kernel, typename... Arguments>
[[gnu::target("avx2")]] auto run_256(Arguments... arguments) noexcept {
  return Kernel::template run<32>(arguments...);
}
#endif

/// Kernel::run<kPiece>(arguments …), always inline, in vectors of the size that the processor has: kPiece bytes.
// Compilers keep larger ones in memory and take comparisons between them to single numbers.
template <typename Kernel, typename... Arguments>
auto run_native(Arguments... arguments) noexcept {
#ifdef BACKWASH_LEVELS
  if (__builtin_cpu_supports("avx2")) return run_256<Kernel>(arguments...);
#endif
  return Kernel::template run<16>(arguments...);
}

}  // namespace backwash::field
