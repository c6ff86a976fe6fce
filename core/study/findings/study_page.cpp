// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/study_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/report/page/interactive.hpp"
#include "core/report/page/page.hpp"
#include "core/study/findings/page_sections.hpp"
#include "core/study/findings/self_test.hpp"
#include "core/study/findings/when_it_acts.hpp"
#include "core/study/findings/words.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {
namespace {

/// What the picture of a cause shows of a window: the residual of its first channel, or, for walls, its part towards
/// the nearest one. Nothing where it was not measured.
std::optional<double> shown(const Effect& effect, const WindowRow& w, const Observations& seen, std::size_t i,
                            Channel channel, const std::array<double, 2>& taken) {
  if (!effect.towards_walls) {
    if (!(seen.weight[channel][i] > 0)) return std::nullopt;
    return seen.y[channel][i] - taken[channel == kMeanY ? 1 : 0];
  }
  if (w.around.walls.empty() || !(seen.weight[kMeanX][i] > 0)) return std::nullopt;
  const auto nearest = std::min_element(w.around.walls.begin(), w.around.walls.end(),
                                        [](auto& a, auto& b) { return a.first < b.first; });
  return (seen.y[kMeanX][i] - taken[0]) * nearest->second.x() + (seen.y[kMeanY][i] - taken[1]) * nearest->second.y();
}

std::string verdict_sentence(const StudyResult& result, const Observations& seen) {
  std::string names;
  for (const auto& cause : result.causes) {
    names += (names.empty() ? "" : ", ") + spoken(cause.found.form->cause());
    for (const auto& rival : cause.found.rivals) names += " or " + spoken(rival.name);
    if (!cause.flights.empty()) names += " (" + where(cause) + ")";
  }
  const std::string of =
      " (" + std::to_string(seen.flights) + " flights, " + std::to_string(seen.windows.size()) + " windows of 2 s)";
  if (!names.empty()) return "The simulation misses " + names + of + ".";
  return std::to_string(result.not_tested.size()) + " of " + std::to_string(effects().size()) +
         " causes were not tested" + of + ".";
}

/// Whether the windows differ in it by more than rounding.
bool varies(const Regressor& along, const Observations& seen) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const auto& w : seen.windows) {
    const double x = along.value(w);
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  }
  return high - low > std::sqrt(std::numeric_limits<double>::epsilon()) * (std::abs(low) + 1);
}

/// Along the flights, for what acts in some of them only, or where its own axis stands still: each flight is one unit
/// long.
Regressor flight_by_flight(const Observations& seen) {
  std::vector<double> longest(seen.flights, 1);
  for (const auto& w : seen.windows) longest[w.flight] = std::max(longest[w.flight], w.t + w.duration);
  return {"flight", false,
          [longest](const WindowRow& w) { return static_cast<double>(w.flight) + 1 + w.t / longest[w.flight]; }};
}

/// Residual of the cause's first channel against its variable, before and after, with means of twelve groups; `data`
/// gets its table.
std::string picture(const NamedCause& cause, const Observations& seen, report::PageData& data) {
  const auto& found = cause.found;
  const Channel channel = found.columns.front().parts.front().channel;
  const Regressor own = found.form->effect->axis;
  const Regressor along = cause.flights.empty() && varies(own, seen) ? own : flight_by_flight(seen);
  report::DataTable points{found.form->cause(), {along.name, "before", "after"}, {}, 0};
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    const double x = along.value(seen.windows[i]);
    if (!std::isfinite(x)) continue;
    std::array<double, 2> added{};  // to the channel; of a level push to y too
    for (std::size_t k = 0; k < found.columns.size(); ++k)
      for (const auto& part : found.columns[k].parts)
        if (part.channel == channel || (channel == kMeanX && part.channel == kMeanY))
          added[part.channel == kMeanY ? 1 : 0] += found.theta[static_cast<Eigen::Index>(k)] * part.x[i];
    const auto& w = seen.windows[i];
    const auto before = shown(*found.form->effect, w, seen, i, channel, {});
    if (before) points.rows.push_back({x, *before, *shown(*found.form->effect, w, seen, i, channel, added)});
  }
  std::ranges::sort(points.rows, {}, [](auto& row) { return row[0]; });
  std::array<report::Run, 2> clouds, means;
  const std::size_t all = points.rows.size(), groups = std::min(static_cast<std::size_t>(kRules.picture_groups), all);
  for (std::size_t k = 0; k < 2; ++k) {
    for (const auto& row : points.rows) clouds[k].push_back({row[0], row[1 + k]});
    for (std::size_t g = 0; g < groups; ++g) {
      const std::size_t from = g * all / groups, until = (g + 1) * all / groups;
      report::Place sum = report::Place::Zero();
      for (std::size_t i = from; i < until; ++i) sum += clouds[k][i];
      means[k].push_back(sum / static_cast<double>(until - from));
    }
  }
  data.tables.push_back(std::move(points));
  using enum report::Kind;
  using enum report::Shape;
  const std::string what = found.form->effect->towards_walls ? "mean towards that wall" : channel_name(channel);
  return report::to_svg({.x = {along.name},
                         .y = {"missed: " + what + (channel <= kMeanZ ? ", m/s²" : "")},
                         .layers = {{dots, before, "", {clouds[0]}},
                                    {dots, after, "", {clouds[1]}},
                                    {line, before, "before", {means[0]}},
                                    {line, after, "after", {means[1]}}},
                         .height = 380}) +
         report::files_html({found.form->cause()});
}

/// In which flights it acts, by number and by log.
std::string acting_rows(const NamedCause& cause, const std::vector<std::string>& logs) {
  if (cause.flights.empty()) return "";
  std::string names;
  for (const auto& f : cause.flights)
    if (f.flight < logs.size()) names += (names.empty() ? "" : ", ") + logs[f.flight];
  return row("Acts in", where(cause)) + row("Their logs", names);
}

std::string figures(const NamedCause& cause, const PageContext& context) {
  const auto& g = cause.gain;
  std::string text = acting_rows(cause, context.logs);
  text += row("What to change", remedy_of(cause, context.read_vehicle).words);
  for (const auto& e : cause.found.parameters)
    text += row(spoken(e.name), number(e.value) + "  [" + number(e.low) + ", " + number(e.high) + "] at 95 %");
  if (!cause.extrapolated.empty()) text += row("The size is extrapolated", cause.extrapolated);
  std::string sure = row("The size", beforehand(cause.found));
  sure += row("Probability of as much by chance, over everything tried", number(cause.found.p));
  sure += row("Gain on flights not fitted", number(g.held_out_nats) + " nats  [" + number(g.low_nats) + ", " +
                                                number(g.high_nats) + "]: odds of " + odds(g.held_out_nats));
  for (const auto& c : g.channels)
    text += row(std::string("Error of ") + channel_name(c.channel) + ", before and after, flights not fitted",
                number(c.before) + " → " + number(c.after));
  text += row("Samples in the model's central 90 %, before and after",
              number(g.coverage_before) + " → " + number(g.coverage_after));
  if (!cause.positions.empty()) text += row("Positions are refused", cause.positions);
  if (!cause.applied.refused.empty()) text += row("Does not join the model", cause.applied.refused);
  for (const auto& s : cause.separate_by)
    text += row("Not told from " + spoken(s.rival),
                "fly next: " + s.manoeuvre +
                    (s.expected_nats ? " (" + number(*s.expected_nats) + " nats expected from 12 flights)" : ""));
  return report::table(text) + "<details><summary>How sure: odds and nats (3 nats are 20 to 1)</summary>" +
         report::table(sure) + "</details>\n";
}

std::string share(double value) { return number(100 * value) + " %"; }

std::string plan_text(const FlightOutcome& o) {
  if (!o.flown) return o.plan ? spoken(plan::to_string(*o.plan)) : "";
  return number(o.flown->length_m) + " m in " + number(o.flown->time_s) + " s, " +
         number(100 * o.flown->min_clearance_m) + " cm clear";
}

/// What field, reach and plan make of the remedies in the vehicle file, and apart of the extended model.
std::string consequence_section(const Consequence& c) {
  std::vector<const FlightOutcome*> ways{&c.before};
  std::string heads = "<thead><tr><th></th><th>now</th>";
  if (c.corrected) {
    ways.push_back(&*c.corrected);
    heads += "<th>file corrected</th>";
  }
  ways.push_back(&c.after);
  std::string text = heads + "<th>extended model</th></tr></thead>\n";
  const auto line = [&](const std::string& name, const auto& of) {
    text += "<tr><th>" + report::escaped(name) + "</th>";
    for (const auto* way : ways) text += "<td>" + report::escaped(of(*way)) + "</td>";
    text += "</tr>\n";
  };
  using Sizes = FlightOutcome::HoverSizes;
  const auto sizes = [](double Sizes::*median, double Sizes::*most) {
    return [=](const FlightOutcome& o) {
      return o.hover ? number(100 * ((*o.hover).*median)) + " (" + number(100 * ((*o.hover).*most)) + ") cm"
                     : std::string("none is bounded");
    };
  };
  line("Hover sets: centre off its set-point, median (95 %)", sizes(&Sizes::shift_median, &Sizes::shift_95));
  line("Hover sets: largest half width, median (95 %)", sizes(&Sizes::extent_median, &Sizes::extent_95));
  if (c.before.safe)
    line("Flown places where hovering is safe", [](const FlightOutcome& o) { return share(o.safe.value_or(0)); });
  if (c.before.plan) {
    const auto at = [](const Vec3& p) { return number(p.x()) + ", " + number(p.y()) + ", " + number(p.z()); };
    line("Plan from " + at(c.start_W) + " to " + at(c.goal_W), plan_text);
  }
  line("Measured samples inside the bound, flights not fitted",
       [&](const FlightOutcome& o) { return c.corrected && &o == &*c.corrected ? std::string() : share(o.inside); });
  std::string words = correction_sentence(c);
  words += (words.empty() ? "" : " ") + cost_sentence(c);
  return report::section("What it costs", report::escaped(words), report::table(text));
}

/// Whether what the accepted causes leave depends on something.
std::string remaining_section(const std::vector<Dependence>& all, bool counted) {
  if (all.empty()) return "";
  constexpr const char* kTitle = "What remains";
  if (!all.front().found)
    return report::section(kTitle,
                           "No dependence left was found (smallest corrected p " + number(all.front().p_holm) + " of " +
                               std::to_string(all.size()) + " tested).",
                           "");
  std::string text;
  for (const auto& d : all)
    if (d.found) text += row(d.group + " on " + d.regressor, "p " + number(d.p_holm) + ", corrected (Holm)");
  return report::section(kTitle,
                         std::string("What remains depends on the following") +
                             (counted ? "." : "; beside a cause the verdict does not count it."),
                         report::table(text));
}

std::string unknown_section(const std::vector<UnknownStructure>& unknown) {
  if (unknown.empty()) return "";
  std::string text;
  for (const auto& u : unknown)
    text += row(u.group + " along " + u.along + " (" + u.shape + ")",
                "p " + number(u.p) + (u.gain ? ", " + number(*u.gain) + " nats held out" : ""));
  return report::section("Without a name", "", report::table(text));
}

/// What was not tested, what would not have been found, which windows were left out.
std::string limits_sections(const StudyResult& result, const Observations& seen) {
  std::string untested, smallest, left_out;
  for (const auto& [name, why] : result.not_tested) untested += row(spoken(name), why);
  for (const auto& r : result.refused) untested += row("Refused: " + spoken(r.name), refusal(r));
  for (const auto& gap : not_measured(seen)) untested += row(gap.what, to_text(gap, seen.flights));
  if (result.not_tested.empty()) untested += row("Everything in the catalogue was tested", "");
  if (!result.smallest_looked_for)
    smallest += row("Not looked for", "the study was asked without them (--quick), or has too few flights");
  else if (result.minimum_detectable.empty())
    smallest += row("None", "no effect of the catalogue shows in these flights at a size that it may have");
  for (const auto& [cause, sizes] : result.minimum_detectable)
    for (const auto& [parameter, size] : sizes)
      smallest += row(std::string(cause).append(", ").append(parameter), number(size));
  if (seen.gated_out.empty()) left_out += row("Nothing", "every window was good");
  for (const auto& [gate, count] : seen.gated_out) left_out += row(to_string(gate), std::to_string(count) + " windows");
  return report::section("What was not tested, and why", "", report::table(untested)) +
         report::section("Smallest effects that these flights would show",
                         "Found with 80 % power, by injection into these flights with their signs flipped.",
                         report::table(smallest)) +
         report::section("Left out", "", report::table(left_out));
}

}  // namespace

std::string study_page(const StudyResult& result, const Observations& seen, const PageContext& context) {
  report::PageData data = context.data;
  const std::string beside = context.height ? height_sentence(*context.height) : "";
  const bool calm = result.verdict == StudyVerdict::nothing_found && beside.empty();
  std::string page =
      "<h1>What the simulation gets wrong</h1>\n<p class=\"context\">Map " +
      report::escaped(context.map.empty() ? "none" : context.map) + ", vehicle " + report::escaped(context.vehicle) +
      ", model " + report::escaped(context.model) + "; backwash " + report::escaped(context.version) + "</p>\n" +
      "<p class=\"verdict " + (calm || result.verdict == StudyVerdict::cause_found ? "passed" : "failed") + "\">" +
      report::escaped((context.rotors ? rotor_sentence(*context.rotors) + " " : "") +
                      advice(result, seen, context.read_vehicle) + (beside.empty() ? "" : " " + beside)) +
      "</p>\n<p>" + report::escaped(verdict_sentence(result, seen));
  if (const auto keys = to_try(result, context.read_vehicle); !keys.empty())
    page += " Correct this, and study again: the same command with <code>--after " + report::escaped(keys) + "</code>.";
  page += "</p>\n" + context.first;
  if (context.consequence) page += consequence_section(*context.consequence);
  for (const auto& cause : result.causes)
    page += report::section(spoken(cause.found.form->cause()), report::escaped(cause.found.form->formula),
                            picture(cause, seen, data) + figures(cause, context));
  if (context.height) page += height_section(*context.height);
  if (context.rotors) page += rotor_section(*context.rotors, data);
  std::string loop;
  for (std::size_t k = 0; k < result.steady.axes.size(); ++k)
    if (const auto text = steady_words(result.steady, k); !text.empty()) loop += (loop.empty() ? "" : ". ") + text;
  if (!loop.empty()) page += report::section("How the loop answers a steady push", report::escaped(loop + "."), "");
  page += unknown_section(result.unknown);
  page += context.residuals;
  page += remaining_section(result.remaining, result.causes.empty());
  page += limits_sections(result, seen);
  std::vector<std::string> told;
  for (const auto& cause : result.causes) {
    told.push_back(cause.found.form->cause());
    for (const auto& rival : cause.found.rivals) told.push_back(rival.name);
  }
  const auto moved = report::interactive(data, report::javascript_folders());
  return report::html_page("backwash study", page + self_test_section(told) + moved.notes, moved.scripts);
}

}  // namespace backwash::study
