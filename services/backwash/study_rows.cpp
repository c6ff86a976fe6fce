// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/study_rows.hpp"

#include <cstring>
#include <stdexcept>

#include "core/files/base64.hpp"
#include "core/study/windows/observed.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/sealed_row.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

Json made_with(const RowsOf& of) {
  return {{"version", kVersion},
          {"vehicle", file_identity(of.vehicle)},
          {"model", file_identity(of.model)},
          {"map", file_identity(of.map)},
          {"group", of.group}};
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
  return {row.at("log"), row.at("group"), log::FlightMark(std::move(hashes)), std::move(*observed)};
}

}  // namespace

std::string study_row(const StudiedFlight& flight, const RowsOf& of) {
  Json row{{"log", flight.path}, {"log_sha256", sha256_of_file(flight.path)}};
  row["made"] = made_with(of);
  row["group"] = flight.group;
  row["positions"] = files::base64(bytes_of(flight.mark.positions()));
  row["windows"] = files::base64(study::packed(flight.observed));
  return sealed(row);
}

std::vector<StudiedFlight> read_study_rows(const std::string& path, const RowsOf& of) {
  std::vector<StudiedFlight> flights;
  read_sealed(path, "backwash study --rows", made_with(of),
              [&](const Json& row) { flights.push_back(flight_of(row)); });
  return flights;
}

}  // namespace backwash::services
