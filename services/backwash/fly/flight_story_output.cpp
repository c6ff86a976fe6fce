// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/fly/flight_story_output.hpp"

#include <algorithm>
#include <cstdio>

#include "core/types/text.hpp"

namespace backwash::services {
namespace {

const char* judged_by(const FlightStory& story) { return story.by_truth ? "truth" : "measured"; }

constexpr std::size_t kMostLines = 10;  // a mapper may send a map each second

Json known(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json to_json(const std::vector<JudgedStretch>& all) {
  Json stretches = Json::array();
  for (const auto& j : all)
    stretches.push_back({{"from_s", j.from_s},
                         {"until_s", j.until_s},
                         {"ticks", j.ticks},
                         {"map", j.map > 0 ? Json(j.map) : Json()},
                         {"min_clearance_m", known(j.clearance_m)},
                         {"why_not", j.why}});
  return stretches;
}

Json to_json(const tl::expected<log::Replay, log::LogError>& replay) {
  const log::Replay counted = replay.value_or(log::Replay{});
  return {{"ticks", counted.ticks},
          {"differing_ticks", counted.differing},
          {"ticks_missing", counted.ticks_missing},
          {"why_not", replay ? replay->stopped : replay.error().message}};
}

/// Nothing of a flight that one map judged whole.
void print_maps(const JudgedMaps& m) {
  const std::size_t count = m.stretches.size();
  for (std::size_t n = 0; n < std::min(count, kMostLines) && (count > 1 || m.not_judged > 0); ++n) {
    const auto& stretch = m.stretches[n];
    std::printf("%-20s %.2f to %.2f s, %s\n", n == 0 ? "clearances" : "", stretch.from_s, stretch.until_s,
                by_of(stretch).c_str());
  }
  if (count > kMostLines) std::printf("%-20s and %zu more: --json has all\n", "", count - kMostLines);
  if (m.window_clouds > 0) std::printf("window               %s\n", window_of(m).c_str());
}

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

std::string by_of(const JudgedStretch& stretch) {
  if (!stretch.clearance_m) return "not judged: " + stretch.why;
  return "by map " + std::to_string(stretch.map) + ", " + to_text(*stretch.clearance_m, 3) + " m at least";
}

std::string replay_of(const FlightStory& s) {
  if (!s.replay) return "it cannot be decided again: " + s.replay.error().message;
  const log::Replay& r = *s.replay;
  std::string text = std::to_string(r.ticks) + " ticks, each as it was decided, bit for bit";
  if (r.first)
    text = std::to_string(r.differing) + " of " + std::to_string(r.ticks) + " ticks otherwise than logged, the first " +
           std::to_string(r.first->tick) + " in " + r.first->field;
  return text + (r.ticks_missing > 0 ? "; " + std::to_string(r.ticks_missing) + " are missing" : "");
}

std::string clearances_of(const FlightStory& s) {
  std::string text;
  if (s.clearance_m)
    text += to_text(*s.clearance_m, 3) + " m at least on " +
            (s.maps.not_judged > 0 ? "what was judged of the routes" : "the routes") + ", body to obstacle; ";
  if (s.maps.left_over_m) text += to_text(*s.maps.left_over_m, 3) + " m left over by the sets; ";
  if (s.maps.beside_m) text += to_text(*s.maps.beside_m, 3) + " m beside the take-offs; ";
  if (text.empty()) return "not judged: no map, or nothing flown in it";
  text.resize(text.size() - 2);
  return text + (s.by_truth ? "" : ", by the vehicle's own estimate");
}

std::string window_of(const JudgedMaps& m) {
  if (m.window_clouds == 0) return "";
  return std::to_string(m.window_clouds) + " clouds; let go far from it were " + std::to_string(m.let_go) +
         " voxels, " + std::to_string(m.let_go_occupied) + " of them occupied";
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
  const JudgedMaps& m = s.maps;
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
          {"min_clearance_m", known(s.clearance_m)},
          {"take_off_clearance_m", known(m.beside_m)},
          {"set_clearance_m", known(m.left_over_m)},
          {"largest_error_over_bound", {{"x", r.x()}, {"y", r.y()}, {"z", r.z()}}},
          {"samples", s.judged},
          {"samples_inside", s.inside},
          {"records_lost", s.records_lost},
          {"cut_at", s.cut_at ? Json(*s.cut_at) : Json()},
          {"ticks_beyond_truth", s.beyond_truth},
          {"replay", to_json(s.replay)},
          {"maps_accepted_s", m.accepted_s},
          {"clearances", to_json(m.stretches)},
          {"ticks_judged", m.judged},
          {"ticks_not_judged", m.not_judged},
          {"take_off_ticks_not_judged", m.not_judged_rising},
          {"scans", m.scans},
          {"window", {{"clouds", m.window_clouds}, {"let_go", m.let_go}, {"let_go_occupied", m.let_go_occupied}}},
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
  std::printf("clearance            %s\n", clearances_of(s).c_str());
  print_maps(s.maps);
  std::printf("largest error/bound  x %.2f, y %.2f, z %.2f\n", s.largest_ratio.x(), s.largest_ratio.y(),
              s.largest_ratio.z());
  std::printf("inside the set       %zu of %zu samples\n", s.inside, s.judged);
  std::printf("decided again        %s\n", replay_of(s).c_str());
  if (s.beyond_truth > 0)
    std::printf("truth                does not cover %zu ticks: measured positions\n", s.beyond_truth);
}

}  // namespace backwash::services
