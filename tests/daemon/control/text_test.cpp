// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/text.hpp"

#include <gtest/gtest.h>

namespace backwash::daemon {
namespace {

TEST(Printable, IsOneLineOfPrintableAsciiWhateverTheBytes) {
  std::string every;
  for (int byte = 0; byte < 256; ++byte) every += static_cast<char>(byte);
  const std::string safe = printable(every, every.size());
  for (const char c : safe) EXPECT_TRUE(c >= ' ' && c <= '~') << static_cast<int>(c);
  EXPECT_NE(safe.find("ABC"), std::string::npos);
  EXPECT_EQ(printable("a\nb\x1b[2J"), "a\\x0ab\\x1b[2J");
}

TEST(Printable, DifferentTextsStayDifferent) {
  EXPECT_NE(printable("a\nb"), printable("a\\x0ab"));
  EXPECT_NE(printable("\xc3\xa9"), printable("\xc3\xa8"));
}

TEST(Printable, IsCutAtItsLength) {
  EXPECT_EQ(printable("abcdef", 3), "abc…");
  EXPECT_EQ(printable("abc", 3), "abc");
}

}  // namespace
}  // namespace backwash::daemon
