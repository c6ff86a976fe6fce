// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/layers.hpp"

#include <gtest/gtest.h>

#include <random>

namespace backwash::field {
namespace {

#ifdef __SIZEOF_INT128__
__extension__ using Wide = unsigned __int128;

Wide wide(std::uint64_t lower, std::uint64_t upper) { return static_cast<Wide>(upper) << 64 | lower; }

void expect_same(const TwoWords& words, Wide number, const char* of) {
  EXPECT_EQ(static_cast<std::uint64_t>(words), static_cast<std::uint64_t>(number)) << of;
  EXPECT_EQ(static_cast<std::uint64_t>(words >> 64), static_cast<std::uint64_t>(number >> 64)) << of;
}

TEST(TwoWords, CountAsTheCompilersOwn128Bits) {
  std::mt19937_64 random(3);
  for (int n = 0; n < 128; ++n)
    for (int k = 0; k < 20; ++k) {
      const std::uint64_t l = random(), h = random(), m = k % 2 ? l : random(), i = random() % 3 ? random() : h;
      const TwoWords a(l, h), b(m, i);
      const Wide c = wide(l, h), d = wide(m, i);
      expect_same(a << n, c << n, "<<");
      expect_same(a >> n, c >> n, ">>");
      expect_same(a & b, c & d, "&");
      expect_same(a - b, c - d, "-");
      expect_same(~a, ~c, "~");
      TwoWords e = a;
      expect_same(e |= b, c | d, "|=");
      EXPECT_EQ(a == b, c == d);
    }
}

// As the sweep writes it.
static_assert(static_cast<std::uint64_t>((TwoWords{1} << 70) - 1) == ~std::uint64_t{0});
static_assert((~TwoWords{0} >> 127 << 127) == (TwoWords{1} << 127));
#endif

}  // namespace
}  // namespace backwash::field
