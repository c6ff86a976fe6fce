// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/flight_story_output.hpp"

#include <cstdio>

#include "core/types/text.hpp"

namespace backwash::services {
namespace {

const char* judged_by(const FlightStory& story) { return story.by_truth ? "truth" : "measured"; }

}  // namespace

std::string why(const FlightStory& story) {
  std::string all;
  for (const auto& reason : story.wrong) all += (all.empty() ? "" : "; ") + reason;
  return all;
}

std::string name_of(const StoryPiece& piece) { return piece.take_off ? "take-off" : "route"; }

std::string end_of(const StoryPiece& piece) {
  if (piece.reached) return "reached";
  return piece.by_order ? "ended by an order"
                        : "not flown to its end, " + to_text(piece.goal_error_m, 2) + " m from it";
}

Json to_json(const FlightStory& s, const std::string& log) {
  Json pieces = Json::array(), events = Json::array();
  for (const auto& p : s.pieces)
    pieces.push_back({{"kind", name_of(p)},
                      {"from_s", p.from_s},
                      {"until_s", p.until_s},
                      {"goal", to_json(p.goal_W)},
                      {"end", end_of(p)},
                      {"goal_error_m", p.goal_error_m},
                      {"samples", p.samples},
                      {"samples_inside", p.inside}});
  for (const auto& e : s.timeline.events) events.push_back({{"t", e.t_s}, {"kind", e.kind}, {"what", e.text}});
  const Vec3& r = s.largest_ratio;
  return {{"ok", s.ok()},
          {"reason", why(s)},
          {"goal_reached", s.goal_reached()},
          {"touched", s.touched()},
          {"log", log},
          {"judged_by", judged_by(s)},
          {"ended", s.ended},
          {"take_offs", s.take_offs},
          {"landings", s.landings},
          {"holds", s.holds},
          {"refusals", s.refusals},
          {"length_m", s.length_m},
          {"time_s", s.time_s},
          {"min_clearance_m", s.clearance_m ? Json(*s.clearance_m) : Json()},
          {"largest_error_over_bound", {{"x", r.x()}, {"y", r.y()}, {"z", r.z()}}},
          {"samples", s.judged},
          {"samples_inside", s.inside},
          {"records_lost", s.records_lost},
          {"cut_at", s.cut_at ? Json(*s.cut_at) : Json()},
          {"pieces", std::move(pieces)},
          {"events", std::move(events)}};
}

void print_text(const FlightStory& s, const std::string& log) {
  std::printf("flight               %s, recorded; judged by %s positions\n", log.c_str(),
              s.by_truth ? "true" : "measured");
  std::printf("ends                 %s\n", s.ended.c_str());
  for (const auto& p : s.pieces)
    std::printf("%-20s %.2f to %.2f s, to %s: %s; %zu of %zu samples inside\n", name_of(p).c_str(), p.from_s, p.until_s,
                to_text(p.goal_W).c_str(), end_of(p).c_str(), p.inside, p.samples);
  std::printf("path, time           %.2f m, %.2f s; take-offs %zu, landings %zu, holds %zu, refusals %zu\n", s.length_m,
              s.time_s, s.take_offs, s.landings, s.holds, s.refusals);
  if (s.clearance_m)
    std::printf("clearance            %.3f m at least on the routes, body to obstacle%s\n", *s.clearance_m,
                s.by_truth ? "" : ", by the vehicle's own estimate");
  std::printf("largest error/bound  x %.2f, y %.2f, z %.2f\n", s.largest_ratio.x(), s.largest_ratio.y(),
              s.largest_ratio.z());
  std::printf("inside the set       %zu of %zu samples\n", s.inside, s.judged);
}

}  // namespace backwash::services
