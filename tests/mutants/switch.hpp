// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>

// Included by the rewritten copies of the sources that mutants.py makes, never by the sources themselves.
namespace backwash_mutants {

/// Number of the mutant that is on, from the environment variable BACKWASH_MUTANT; 0: none. One copy per source.
static int active = 0;

/// Before every other initialisation, so that constants see it too.
__attribute__((constructor(101))) static void read_active() {
  const char* number = std::getenv("BACKWASH_MUTANT");
  active = number ? std::atoi(number) : 0;
}

/// Whether mutant `n` is on. Real-time: wait-free, no allocation.
[[maybe_unused]] static bool on(int n) noexcept { return active == n; }

}  // namespace backwash_mutants
