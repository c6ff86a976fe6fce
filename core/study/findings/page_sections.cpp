// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/page_sections.hpp"

#include <cstdio>

#include "core/report/page/page.hpp"
#include "core/study/findings/study.hpp"
#include "core/study/findings/words.hpp"

namespace backwash::study {
namespace {

std::string interval(const RotorVerdict& v) {
  const RotorNeed& need = v.told.each[v.told.rotor];
  return percent(need.d) + " [" + percent(need.low) + ", " + percent(need.high) + "]";
}

std::string ratio(const std::optional<calibrate::CalibratedValue>& e) {
  if (!e) return "not shown by these flights";
  return "×" + number(e->value) + "  [" + number(e->ci95.low) + ", " + number(e->ci95.high) + "]";
}

}  // namespace

std::string spoken(std::string name) {
  constexpr std::pair<const char*, const char*> kUnits[] = {
      {"_mps2", ", m/s²"}, {"_per_s", ", 1/s"}, {"_ln", ", ln"}, {"_m", ", m"}, {"_s", ", s"}};
  for (const auto& [suffix, unit] : kUnits)
    if (name.ends_with(suffix)) return name.substr(0, name.size() - std::string(suffix).size()) + unit;
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string too_few(const Observations& seen) {
  std::size_t good = 0;
  for (std::size_t f = 0; f < seen.units.size(); ++f) good += seen.units.first[f + 1] > seen.units.first[f] ? 1u : 0u;
  const auto needed = static_cast<std::size_t>(kRules.fewest_flights);
  const bool grouped = seen.units.size() != seen.flights;
  std::string text = std::to_string(good) + (grouped ? " group" : " flight") + (good == 1 ? "" : "s") +
                     " with good windows, " + std::to_string(needed) + " are needed to warrant a name: fly " +
                     std::to_string(needed - good) + " more";
  std::string out;
  for (const auto& [gate, count] : seen.gated_out)
    out += (out.empty() ? "" : ", ") + std::to_string(count) + " " + to_string(gate);
  return text + (out.empty() ? "." : " (windows left out: " + out + ").");
}

std::string rotor_sentence(const RotorVerdict& v) {
  using Kind = RotorVerdict::Kind;
  const std::string rotor = "rotor " + std::to_string(v.told.rotor + 1);
  switch (v.kind) {
    case Kind::as_sound:
      return "As the sound flights: a propeller that needs " + percent(v.minimum) +
             " more of its command would have been named.";
    case Kind::propeller_damage:
      return "The propeller of " + rotor + " is damaged: it needs " + interval(v) + " more of its command.";
    case Kind::payload:
      return "An off-centre weight, no damaged propeller: rotor " + std::to_string(v.told.heavy + 1) +
             " carries most of it, " + percent(v.told.weight) + " more than the mean.";
    case Kind::cannot_distinguish:
      if (!v.told.holds(RotorState::sound))
        return "A damaged propeller of " + rotor + " or a weight near it: these flights cannot tell.";
      return "Not told from the sound flights, nor from a small damage or weight: " + rotor + " differs most, by " +
             interval(v) + " of its command, and only a propeller that needs " + percent(v.minimum) +
             " more would be named four times in five.";
    default:
      return "Differs from the sound flights as neither a damaged propeller nor a weight does.";
  }
}

std::string rotor_section(const RotorVerdict& v, report::PageData& data) {
  using enum report::Kind;
  using enum report::Shape;
  report::DataTable table{"rotors", {"rotor", "percent", "percent_low", "percent_high"}, {}, 0};
  report::Layer most{dots, after, "if this rotor alone, 95 %", {{}}}, bars{line, after, "", {}};
  for (std::size_t r = 0; r < v.told.each.size(); ++r) {
    const auto& e = v.told.each[r];
    const auto at = static_cast<double>(r) + 1;
    table.rows.push_back({at, 100 * e.d, 100 * e.low, 100 * e.high});
    most.runs[0].push_back({at, 100 * e.d});
    bars.runs.push_back({{at, 100 * e.low}, {at, 100 * e.high}});
  }
  data.tables.push_back(std::move(table));
  const double first = 0.5,
               last = first + static_cast<double>(v.told.each.size());  // half a rotor beside the outer ones
  const auto level = [first, last](double y) { return report::Run{{first, y}, {last, y}}; };
  const report::Chart chart{.x = {"", first, last, false, {"rotor 1", "rotor 2", "rotor 3", "rotor 4"}},
                            .y = {"command needed more, %"},
                            .layers = {{line, measured, "", {level(0)}},
                                       {line, commanded, "named four times in five", {level(100 * v.minimum)}},
                                       std::move(bars),
                                       std::move(most)},
                            .height = 300};
  return report::section(
      "Rotors against sound flights", report::escaped(rotor_sentence(v)),
      report::to_svg(chart) + report::files_html({"rotors"}) +
          report::table(
              row("Command that rotor " + std::to_string(v.told.rotor + 1) + " needs more, at 95 %", interval(v)) +
              row("Smallest that is named with 80 % power", percent(v.minimum)) +
              row("Damage of one propeller over a sound craft, nats",
                  number(v.told.lead) + " (chance " + number(v.told.needed) + ")") +
              row("Twist, which a weight does not give, t", number(v.t[0])) +
              row("Rotors 1 and 3, rotors 2 and 4 apart, t", number(v.t[1]) + ", " + number(v.t[2]))));
}

std::string height_sentence(const calibrate::HeightEffects& effects) {
  const auto& h = effects.hovers ? *effects.hovers : effects.all;
  std::string text;
  const auto differs = [](const std::optional<calibrate::CalibratedValue>& e) {
    return e && (e->ci95.low > 1 || e->ci95.high < 1);
  };
  if (differs(h.bins)) text += " near the surface " + ratio(h.bins);
  if (differs(h.ceiling)) text += std::string(text.empty() ? "" : ",") + " under a plate " + ratio(h.ceiling);
  return text.empty() ? text : "Vertical variance of hovers, day and speed held fixed:" + text + ".";
}

std::string height_section(const calibrate::HeightEffects& effects) {
  const auto& all = effects.all;
  const auto& slow = effects.hovers;
  std::string text = report::heads("", "hovers and passes", "hovers");
  const auto line = [&](const std::string& name, auto value) {
    text += row(name, value(all), slow ? value(*slow) : std::string("none"));
  };
  const std::string contrast = number(all.low_m) + " m over the surface against " + number(all.high_m) + " m";
  line(contrast + ", by a law of height", [](auto& h) { return ratio(h.low_over_high); });
  line(contrast + ", within a factor of two, no law", [](auto& h) { return ratio(h.bins); });
  line("Under a plate against without", [](auto& h) { return ratio(h.ceiling); });
  line("Flights that were that low, that high",
       [](auto& h) { return std::to_string(h.low_flights) + ", " + std::to_string(h.high_flights); });
  line("From", [](auto& h) {
    return std::to_string(h.windows) + " windows of " + std::to_string(h.flights) + " flights on " +
           std::to_string(h.days) + " days";
  });
  return report::section("Vertical variance by height and plate",
                         "Day and speed held fixed, flights random, 95 % intervals by resampling flights. The variance "
                         "of a pass holds its own acceleration: the hovers alone do not.",
                         report::table(text));
}

}  // namespace backwash::study
