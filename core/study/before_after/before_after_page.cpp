// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/before_after/before_after_page.hpp"

#include <algorithm>
#include <cmath>
#include <ranges>

#include "core/report/page/interactive.hpp"
#include "core/report/page/page.hpp"
#include "core/study/before_after/before_after_rules.hpp"
#include "core/study/findings/page_sections.hpp"
#include "core/study/findings/words.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study {
namespace {

constexpr const char* kElse =
    "Whatever else differed between the two groups counts as the change: fly both on the same days, in turn.";

std::string told_name(Helped helped) { return helped == Helped::cannot_be_told ? "cannot be told" : to_string(helped); }

/// Ratios and their intervals, a line each, on a logarithmic axis.
std::string picture(const std::vector<MeasuredChange>& changes) {
  using enum report::Kind;
  using enum report::Shape;
  std::vector<std::string> names;
  report::Layer all{dots, after, "", {{}}}, bars{line, after, "", {}};
  double least = 0, most = 0;
  for (const auto& c : changes | std::views::reverse) {
    if (!c.measure->ratio || !c.why.empty()) continue;
    names.push_back(c.measure->name);
    const auto at = static_cast<double>(names.size());
    const double low = std::log10(c.low), high = std::log10(c.high);
    all.runs[0].push_back({std::log10(c.change), at});
    bars.runs.push_back({{low, at}, {high, at}});
    least = std::min(least, low);
    most = std::max(most, high);
  }
  if (names.empty()) return "";
  const double last = static_cast<double>(names.size()) + 0.5;
  const int height = 120 + 34 * static_cast<int>(names.size());
  return report::to_svg(
      {.x = {"after over before: left of 1 is better", least, most, true},
       .y = {"", 0.5, last, false, names},
       .layers = {{line, commanded, "as before", {{{0, 0.5}, {0, last}}}}, std::move(bars), std::move(all)},
       .height = height});
}

}  // namespace

std::string change_words(const MeasuredChange& c) {
  if (!c.why.empty()) return c.why;
  const std::string unit = c.measure->ratio ? " times" : " " + c.measure->unit;
  const char* const close = "%.5g%s [%.5g, %.5g]";
  return formatted(number(c.low) == number(c.high) ? close : "%.3g%s [%.3g, %.3g]", c.change, unit.c_str(), c.low,
                   c.high);
}

std::string power_words(const MeasuredChange& c) {
  if (!c.why.empty()) return "";
  const std::string smallest =
      c.measure->ratio ? "a factor of " + number(c.smallest) : number(c.smallest) + " " + c.measure->unit;
  const std::string needed =
      c.needed ? std::to_string(*c.needed) : "more than " + std::to_string(std::lround(kBeforeAfterRules.most_needed));
  return smallest + " would show with these; " + percent(kBeforeAfterRules.worth) + " with " + needed +
         " flights a side";
}

namespace {

std::string named_as(const std::vector<MeasuredChange>& changes, Helped helped) {
  std::string names;
  for (const auto& c : changes)
    if (c.helped == helped) names += (names.empty() ? "" : "; ") + c.measure->name + ", " + change_words(c);
  return names;
}

}  // namespace

std::string flown_otherwise(std::vector<MeasuredChange> flown) {
  std::erase_if(flown,
                [](const auto& c) { return std::abs(std::log(c.change)) < std::log1p(kBeforeAfterRules.alike); });
  std::string names = named_as(flown, Helped::better);
  const std::string more = named_as(flown, Helped::worse);
  names += (names.empty() || more.empty() ? "" : "; ") + more;
  return names.empty() ? "" : "The groups were flown otherwise: " + names + ". That may be all that is told.";
}

std::string headline(const std::vector<MeasuredChange>& changes) {
  const auto open = std::ranges::count(changes, Helped::cannot_be_told, &MeasuredChange::helped);
  const std::string better = named_as(changes, Helped::better), worse = named_as(changes, Helped::worse);
  std::string text = better.empty() ? "Nothing is told to be better." : "Better: " + better + ".";
  text += worse.empty() ? " Nothing is told to be worse." : " Worse: " + worse + ".";
  return text + " Of " + std::to_string(open) + (better.empty() && worse.empty() ? "" : " others") +
         " these flights cannot tell.";
}

std::string before_after_page(const std::vector<MeasuredChange>& changes, const std::vector<MeasuredChange>& flown,
                              const FlightMeasures& measures, const std::string& context, const std::string& first) {
  const std::string verdict = verdict_of(changes), otherwise = flown_otherwise(flown);
  std::string text = report::heads("", "told", "before", "after", "change, with its interval", "what would show"),
              untested;
  for (const auto& c : changes) {
    const auto unit = [&](double value) { return c.why.empty() ? number(value) + " " + c.measure->unit : ""; };
    text += row(c.measure->name, told_name(c.helped), unit(c.before), unit(c.after), change_words(c), power_words(c));
  }
  for (const auto& [name, why] : measures.not_tested) untested += row(name, why);
  std::string page =
      "<h1>Did the change help?</h1>\n<p class=\"context\">" + report::escaped(context) + "</p>\n<p class=\"verdict " +
      (verdict == "better" && otherwise.empty() ? "passed"
       : verdict == "cannot_be_told"            ? ""
                                                : "failed") +
      "\">" + report::escaped(headline(changes) + (otherwise.empty() ? "" : " " + otherwise)) + "</p>\n" + first;
  page += report::section("After over before, by flights", report::escaped(kElse),
                          picture(changes) + report::table(text, true));
  if (!untested.empty()) page += report::section("What was not tested, and why", "", report::table(untested));
  const auto moved = report::interactive({}, report::javascript_folders());
  return report::html_page("backwash study: before and after", page + moved.notes, moved.scripts);
}

}  // namespace backwash::study
