// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Counts calls of the global operator new, for tests of functions that promise not to allocate. It defines the
// replaceable operators: include it in exactly one source of a test program. Inlined, a delete would look mismatched.

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace backwash::test {

inline std::atomic<long> allocations{0};

/// Allocations made by any thread while `work` runs.
template <typename Work>
long allocations_during(const Work& work) {
  const long before = allocations;
  work();
  return allocations - before;
}

inline void* counted(std::size_t size, std::size_t alignment) {
  ++allocations;
  // aligned_alloc wants a multiple of the alignment; free() takes what it returns.
  if (void* p = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)) return p;
  throw std::bad_alloc();
}

}  // namespace backwash::test

void* operator new(std::size_t size) { return backwash::test::counted(size, alignof(std::max_align_t)); }
void* operator new[](std::size_t size) { return backwash::test::counted(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t a) {
  return backwash::test::counted(size, static_cast<std::size_t>(a));
}
void* operator new[](std::size_t size, std::align_val_t a) {
  return backwash::test::counted(size, static_cast<std::size_t>(a));
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete[](void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
