// SPDX-License-Identifier: BSD-3-Clause
// Compiles to one warning for each ring: a result of push() that nobody looks at (docs/faults.md row 14).
#include "core/sync/record_ring.hpp"
#include "core/sync/shared_ring.hpp"

void lose(backwash::sync::RecordRing<int, 2>& one, backwash::sync::SharedRing<int, 2>& other) {
  one.push(1);
  other.push(1);
}
