// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_rows.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "core/files/base64.hpp"
#include "core/files/read_file.hpp"
#include "core/study/windows/observed.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kLargestRows = std::size_t{16} << 30;
constexpr const char* kVerb = "backwash study --rows";

/// What stands for a file in a row: its SHA-256; the name of what is built in; empty for none.
std::string file_identity(const std::string& path) {
  return path.empty() || path.starts_with("builtin:") ? path : sha256_of_file(path);
}

Json made_with(const RowsOf& of, const std::string& map) {
  return {{"version", kVersion},
          {"vehicle", file_identity(of.vehicle)},
          {"model", file_identity(of.model)},
          {"map", map},
          {"group", of.group}};
}

/// Of each map; of none, one empty text.
std::vector<std::string> map_identities(const RowsOf& of) {
  std::vector<std::string> all;
  for (const auto& map : of.maps) all.push_back(file_identity(map));
  return all.empty() ? std::vector<std::string>(1) : all;
}

std::string bytes_of(const std::vector<std::size_t>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(std::size_t)};
}

StudiedFlight flight_of(const Json& row) {
  const auto positions = files::from_base64(row.at("positions").get_ref<const std::string&>());
  const auto windows = files::from_base64(row.at("windows").get_ref<const std::string&>());
  auto observed = windows ? study::unpacked(*windows) : std::nullopt;
  if (!positions || positions->size() % sizeof(std::size_t) != 0 || !observed || observed->seen.flights != 1)
    throw std::out_of_range("windows");
  std::vector<std::size_t> hashes(positions->size() / sizeof(std::size_t));
  if (!hashes.empty()) std::memcpy(hashes.data(), positions->data(), positions->size());
  StudiedFlight flight{row.at("log"), row.at("group"), log::FlightMark(std::move(hashes)), std::move(*observed), 0};
  if (row.contains("map_share")) {
    const Json& share = row["map_share"];
    flight.place = {share.at("inside"), share.at("too_near"), share.at("outside")};
  }
  return flight;
}

}  // namespace

std::string study_row(const StudiedFlight& flight, const RowsOf& of) {
  Json row{{"log", flight.path}, {"log_sha256", sha256_of_file(flight.path)}};
  row["made"] = made_with(of, of.maps.empty() ? "" : file_identity(of.maps[flight.room]));
  row["group"] = flight.group;
  if (const auto& place = flight.place)
    row["map_share"] = {{"inside", place->inside}, {"too_near", place->too_near}, {"outside", place->outside}};
  row["positions"] = files::base64(bytes_of(flight.mark.positions()));
  row["windows"] = files::base64(study::packed(flight.observed));
  try {
    return row.dump() + "\n";
  } catch (const Json::type_error&) {
    throw Failure(kBadData, flight.path + ":1: its name is no UTF-8; give it another");
  }
}

std::vector<StudiedFlight> read_study_rows(const std::string& path, const RowsOf& of) {
  std::vector<StudiedFlight> flights;
  const auto maps = map_identities(of);
  Json made = made_with(of, maps.front());
  std::size_t number = 0;
  const auto take = [&](std::string_view line) {
    const auto refuse = [&](const std::string& what) {
      throw Failure(kBadData, path + ":" + std::to_string(number) + ": " + what + "; make it again with " + kVerb);
    };
    ++number;
    const auto row = Json::parse(line, nullptr, false);
    if (!row.is_object() || !row.contains("made")) refuse("is no line of it, or is cut short");
    const auto map = std::ranges::find(maps, row["made"].value("map", ""));
    if (map != maps.end()) made["map"] = *map;
    for (const auto& [name, value] : made.items())
      if (const auto was = row["made"].value(name, Json()); was != value)
        refuse("was made with another " + name + ": " + was.dump() + ", here it is " + value.dump());
    try {
      flights.push_back(flight_of(row));
      flights.back().room = static_cast<std::size_t>(map - maps.begin());
    } catch (const std::out_of_range&) {
      refuse("is no line of it");
    } catch (const Json::exception&) {
      refuse("is no line of it");
    }
  };
  const auto read = files::each_line(path, kLargestRows, std::string("a file of what ") + kVerb + " printed", take);
  if (!read) throw Failure(kNoInput, path + ":1: " + read.error().message);
  if (number == 0) throw Failure(kBadData, path + ":1: is empty; fill it with " + kVerb);
  return flights;
}

}  // namespace backwash::services
