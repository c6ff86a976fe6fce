// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace backwash::study {

/// What a world hides.
enum class Hidden {
  cause,      ///< of the catalogue
  structure,  ///< something outside the catalogue: `unknown` in docs/measurements/confusion.md
  nothing,    ///< `none`
};

/// How worlds that hide one thing, at the size of docs/measurements/confusion.md, were told: a row of its table.
struct SelfTestRow {
  Hidden hidden;
  const char* cause;  ///< its name; empty where none of the catalogue is hidden
  int worlds;
  int alone;          ///< exactly what was hidden was told
  int in_set;         ///< what was hidden was in what was told
  int wrong;          ///< something else was named, alone or beside it
  const char* other;  ///< what was told most often instead; empty: nothing else was
};

/// The engine's published campaign: the rows of docs/measurements/confusion.md as the library was built
/// (self_test_rows.cmake).
struct SelfTest {
  std::uint64_t seed;
  int flights;
  std::span<const SelfTestRow> rows;
  const SelfTestRow* of(const std::string& cause) const;  ///< null: not tested
  const SelfTestRow* of(Hidden hidden) const;             ///< where no cause is hidden
};
const SelfTest& self_test();

/// Section of the page: how often each of `names` was told when it was hidden, how often something was told where
/// nothing was hidden, and the whole table folded away.
std::string self_test_section(const std::vector<std::string>& names);

}  // namespace backwash::study
