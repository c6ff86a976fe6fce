// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/timeline.hpp"

#include <algorithm>
#include <array>

#include "core/report/page/page.hpp"
#include "core/types/text.hpp"

namespace backwash::report {
namespace {

struct Lane {
  const char *name, *kinds;
};
constexpr std::array<Lane, 3> kLanes{{{"commands", "command"}, {"map, scans", "map"}, {"VIO, faults", "vio fault"}}};
constexpr Lane kAir{"air", "air"};

/// Where a time lies between the two ends, as CSS wants it.
std::string share(double t, double from, double until) {
  return to_text(until > from ? 100 * std::clamp((t - from) / (until - from), 0.0, 1.0) : 0, 3) + "%";
}

std::string lanes(const Timeline& timeline, double from, double until) {
  std::string html = "<div class=\"lane\"><span class=\"name\">modes</span>", spoken;
  for (const auto& m : timeline.modes) {
    html += "<span class=\"mode " + escaped(m.mode) + "\" style=\"left:" + share(m.from_s, from, until) +
            ";width:" + share(from + m.until_s - m.from_s, from, until) + "\" title=\"" +
            escaped(m.mode + ": " + m.reason) + "\">" + escaped(m.mode) + "</span>";
    spoken += (spoken.empty() ? "" : ", ") + m.mode + " from " + to_text(m.from_s, 1) + " s";
  }
  html += "</div>\n";
  std::vector<Lane> all(kLanes.begin(), kLanes.end());
  const auto of_air = [](const TimelineEvent& e) { return e.kind == std::string(kAir.kinds); };
  if (std::ranges::any_of(timeline.events, of_air)) all.push_back(kAir);
  for (const auto& lane : all) {
    html += "<div class=\"lane\"><span class=\"name\">" + std::string(lane.name) + "</span>";
    for (const auto& e : timeline.events)
      if (std::string(lane.kinds).find(e.kind) != std::string::npos)
        html += std::string("<span class=\"event ") + e.kind + "\" style=\"left:" + share(e.t_s, from, until) +
                "\" title=\"" + escaped(e.text) + "\"></span>";
    html += "</div>\n";
  }
  return "<div class=\"lanes\" role=\"img\" data-from=\"" + to_text(from, 6) + "\" data-until=\"" + to_text(until, 6) +
         "\" aria-label=\"Timeline of modes: " + escaped(spoken) +
         ". Everything in it stands in the table below.\">\n" + html + "</div>\n";
}

}  // namespace

std::string timeline_html(const Timeline& timeline) {
  std::string html =
      "<section id=\"timeline\"><h2>Timeline</h2>\n<p>Above the modes; below them commands, map and VIO. ";
  double from = 0, until = 0;
  for (const auto& m : timeline.modes) {
    from = std::min(from, m.from_s);
    until = std::max(until, m.until_s);
  }
  for (const auto& e : timeline.events) {
    from = std::min(from, e.t_s);
    until = std::max(until, e.t_s);
  }
  html += "From " + to_text(from, 2) + " s to " + to_text(until, 2) + " s.</p>\n" + lanes(timeline, from, until) +
          "<table class=\"wide\">\n<thead><tr><th>time, s</th><th>kind</th><th>what happened</th></tr></thead>\n";
  for (const auto& e : timeline.events) {
    const std::string t = to_text(e.t_s, 2);
    html +=
        "<tr><td data-time=\"" + t + "\">" + t + "</td><td>" + e.kind + "</td><td>" + escaped(e.text) + "</td></tr>\n";
  }
  return html + "</table>\n</section>\n";
}

}  // namespace backwash::report
