// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/self_test.hpp"

#include <algorithm>

#include "core/report/page/page.hpp"
#include "core/study/findings/page_sections.hpp"

namespace backwash::study {
namespace {

std::string of_worlds(int count, const SelfTestRow& r) {
  return std::to_string(count) + " of " + std::to_string(r.worlds);
}

std::string sentence(const SelfTestRow& r) {
  if (r.hidden == Hidden::nothing)
    return "something was named, or called unknown, in " + of_worlds(r.worlds - r.alone, r);
  std::string text = (r.hidden == Hidden::structure ? "called unknown in " : "named alone in ") +
                     of_worlds(r.alone, r) + ", in what was told in " + of_worlds(r.in_set, r) + ", a wrong name in " +
                     of_worlds(r.wrong, r);
  if (*r.other) text += "; otherwise mostly: " + std::string(r.other);
  return text;
}

std::string title(const SelfTestRow& r) {
  switch (r.hidden) {
    case Hidden::nothing:
      return "Nothing hidden";
    case Hidden::structure:
      return "Something outside the catalogue hidden";
    default:
      return spoken(r.cause) + " hidden";
  }
}

std::string shown(const SelfTestRow& r) { return row(title(r), sentence(r)); }

template <typename Matches>
const SelfTestRow* first(std::span<const SelfTestRow> rows, Matches matches) {
  const auto at = std::ranges::find_if(rows, matches);
  return at == rows.end() ? nullptr : &*at;
}

}  // namespace

const SelfTestRow* SelfTest::of(const std::string& cause) const {
  return first(rows, [&](const SelfTestRow& r) { return r.hidden == Hidden::cause && r.cause == cause; });
}

const SelfTestRow* SelfTest::of(Hidden hidden) const {
  return first(rows, [&](const SelfTestRow& r) { return r.hidden == hidden; });
}

const SelfTest& self_test() {
#include "self_test_rows.inc"
  static const SelfTest all{kSeed, kFlights, kRows};
  return all;
}

std::string self_test_section(const std::vector<std::string>& names) {
  const SelfTest& test = self_test();
  std::string here, all;
  for (const auto& name : names)
    if (const auto* r = test.of(name)) here += shown(*r);
  for (const Hidden hidden : {Hidden::nothing, Hidden::structure})
    if (const auto* r = test.of(hidden)) here += shown(*r);
  for (const auto& r : test.rows) all += shown(r);
  return report::section(
      "How often the method is right",
      std::to_string(test.flights) +
          " made flights each, by a generator with other formulas, effects of the size of the table "
          "in docs/measurements/confusion.md, seed " +
          std::to_string(test.seed) + ".",
      report::table(here) + "<details><summary>Every cause</summary>\n" + report::table(all) + "</details>\n");
}

}  // namespace backwash::study
