// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

/// Before a kernel: compiled for AVX2 and the baseline and picked at run time on x86.
// Loaders that call a resolver before a sanitizer has started would crash.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BACKWASH_LEVELS
#define BACKWASH_CLONES [[gnu::target_clones("avx2", "default")]]
#else
#define BACKWASH_CLONES
#endif

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
