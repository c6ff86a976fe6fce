// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/design/design.hpp"

#include <algorithm>
#include <climits>
#include <cstdio>

#include "core/study/design/imagined.hpp"
#include "core/study/design/ways.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study {
namespace {

DesignedSet told_of(const Contest& contest) {
  DesignedSet set;
  for (const auto& e : contest.explanations()) {
    set.names.push_back(e.form->cause());
    set.probability.push_back(e.probability);
  }
  set.pairs = contest.pairs();
  return set;
}

/// What a flight would tell of every set; all sets have to be told apart.
void judge(NextFlight& flight, const std::vector<Contest>& contests, const Evidence& next) {
  std::vector<double> missed(static_cast<std::size_t>(kDesignRules.design_most_flights), 0);
  for (const Contest& contest : contests) {
    Outlook told = contest.after(next);
    flight.divergence += told.divergence;
    for (std::size_t n = 0; n < missed.size(); ++n) missed[n] += 1 - told.separated[n];
    flight.of_pair.push_back(std::move(told.of_pair));
  }
  Outlook all;
  for (const double m : missed) all.separated.push_back(std::max(0.0, 1 - m));
  flight.flights = all.flights();
  flight.separated =
      flight.flights ? all.separated[static_cast<std::size_t>(*flight.flights) - 1] : all.separated.back();
}

bool better(const NextFlight& a, const NextFlight& b) {
  const auto needed = [](const NextFlight& f) { return f.flights.value_or(INT_MAX); };
  return needed(a) != needed(b) ? needed(a) < needed(b) : a.divergence > b.divergence;
}

std::string sentence(const Design& design) {
  if (design.flights.empty()) return "no flight of this list fits in the map";
  const NextFlight* best = design.chosen();
  if (!best) return "no flight of this list separates them";
  char text[240];
  std::snprintf(text, sizeof text, "fly: %s%s; %d flight%s separate%s them with P = %.2f", best->name.c_str(),
                best->used_battery ? ", on the battery as the last flight left it" : "", *best->flights,
                best->flights == 1 ? "" : "s", best->flights == 1 ? "s" : "", best->separated);
  return text;
}

}  // namespace

const NextFlight* Design::chosen() const {
  return flights.empty() || !flights.front().flights ? nullptr : &flights.front();
}

Design design(const Observations& seen, const StudyResult& result, const plan::World& world, const Model& model,
              const Vec3& start_W, double flight_time) {
  Design design;
  std::vector<Accepted> accepted;
  for (const auto& cause : result.causes) accepted.push_back(cause.found);
  Evidence evidence(seen);
  evidence.whiten(columns_of(accepted, seen));
  std::vector<Contest> contests;
  for (std::size_t k = 0; k < accepted.size(); ++k)
    if (!accepted[k].rivals.empty()) contests.emplace_back(evidence, accepted, k, result.threshold);
  for (const Contest& contest : contests) design.sets.push_back(told_of(contest));
  if (contests.empty()) {
    design.message = "nothing to tell apart: no cause has a rival";
    return design;
  }
  MapView surroundings(&world.grid, model);
  const Imagination imagination(seen, world.reach.vehicle, surroundings);
  for (const Way& way : ways(world, start_W)) {
    const FlownWay flown = flown_way(world, start_W, way, flight_time);
    if (flown.points.empty()) {
      design.left_out.emplace_back(way.name, flown.why_not);
      continue;
    }
    for (const bool used : {false, true}) {
      if (used && !seen.has(Source::battery)) continue;
      const Observations windows = imagination.windows(flown.commands, used);
      NextFlight flight{way.name, used, imagination.first_voltage(used), flown.points, flown.commands, 0, {}, 0, 0};
      judge(flight, contests, evidence.next(windows));
      design.flights.push_back(std::move(flight));
    }
  }
  std::ranges::stable_sort(design.flights, better);
  design.message = sentence(design);
  return design;
}

std::string points_csv(const std::vector<Waypoint>& points) {
  const bool facing = std::ranges::any_of(points, [](const Waypoint& p) { return p.yaw.has_value(); });
  std::string text = facing ? "x_m,y_m,z_m,yaw_rad\n" : "x_m,y_m,z_m\n";
  for (const auto& [p, yaw] : points) {
    text += formatted("%.4f,%.4f,%.4f", p.x(), p.y(), p.z());
    if (facing) text += yaw ? formatted(",%.4f", *yaw) : ",";
    text += '\n';
  }
  return text;
}

}  // namespace backwash::study
