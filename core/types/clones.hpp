// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Before a plain loop: compiled for AVX2 and the baseline and picked at load time on x86, with the same result.
// Loaders that call a resolver before a sanitizer has started would crash.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BACKWASH_LEVELS
#define BACKWASH_CLONES [[gnu::target_clones("avx2", "default")]]
#else
#define BACKWASH_CLONES
#endif
