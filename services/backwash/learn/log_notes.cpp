// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/log_notes.hpp"

#include <algorithm>
#include <cstdio>

#include "core/report/page/page.hpp"
#include "services/backwash/verb.hpp"
#include "services/command_line/words.hpp"

namespace backwash::services {
namespace {

void say(const std::string& verb, const std::string& what) {
  end_progress();
  say_error(verb, what);
}

bool touches(const LogNotes::Place& place) { return place.share.all() > 0; }

std::string summary(const LogNotes& notes) {
  const auto good = notes.places.size() - static_cast<std::size_t>(std::ranges::count_if(notes.places, touches));
  return std::to_string(good) + " of " + std::to_string(notes.places.size()) +
         " flights lie wholly where the map lets the vehicle be";
}

}  // namespace

void LogNotes::column(const std::string& log, const std::string& what) {
  columns.emplace_back(log, what);
  say(verb, log + ":1: " + what);
}

void LogNotes::left_out(const std::string& log, const std::string& why) {
  logs.emplace_back(log, why);
  say(verb, why + "; left out");
}

void LogNotes::place(const Place& place) {
  places.push_back(place);
  const auto& [log, map, share] = place;
  if (!share.refused()) return;
  char at[128];
  std::snprintf(at, sizeof at, ", first at t_s %.2f at %.2f,%.2f,%.2f", share.first->t_s, share.first->p_W.x(),
                share.first->p_W.y(), share.first->p_W.z());
  throw Failure(kBadData, log + ":1: lies where the map lets no craft be: " + study::to_text(share) + at +
                              "; is it this map, " + map + ", in its frame, heights upwards?");
}

void each_readable(const std::vector<std::string>& logs, LogNotes& notes,
                   const std::function<void(const std::string& log)>& read) {
  std::size_t good = 0;
  for (const auto& log : logs) {
    try {
      read(log);
      ++good;
    } catch (const Failure& failure) {
      if (failure.exit_code != kBadData || logs.size() == 1) throw;
      notes.left_out(log, failure.what());
    }
  }
  if (good == 0 && !logs.empty())
    throw Failure(kBadData, logs.front() + ":1: this log and all others are left out: none is left");
}

Json told_first(const LogNotes& notes, const Json& json) {
  Json all = Json::object();
  for (const auto& [log, map, share] : notes.places)
    all["map_shares"].push_back({{"log", log},
                                 {"map", map},
                                 {"inside", share.inside},
                                 {"too_near", share.too_near},
                                 {"outside", share.outside}});
  for (const auto& [log, why] : notes.logs) all["left_out"].push_back({{"log", log}, {"why", why}});
  for (const auto& [log, what] : notes.columns) all["columns_left_out"].push_back({{"log", log}, {"why", what}});
  all.update(json);
  return all;
}

void print_text(const LogNotes& notes) {
  if (notes.places.empty()) return;
  std::printf("%s\n", summary(notes).c_str());
  for (const auto& flight : notes.places)
    if (touches(flight)) std::printf("  %s: %s\n", flight.log.c_str(), study::to_text(flight.share).c_str());
}

std::string html(const LogNotes& notes) {
  std::string rows;
  for (const auto& flight : notes.places)
    if (touches(flight)) rows += report::row(flight.log, study::to_text(flight.share));
  for (const auto& [log, why] : notes.logs) rows += report::row("Left out: " + log, why);
  for (const auto& [log, what] : notes.columns) rows += report::row(log, what);
  if (notes.places.empty() && rows.empty()) return "";
  return report::section("Logs and map", notes.places.empty() ? "" : summary(notes) + ".", report::table(rows));
}

}  // namespace backwash::services
