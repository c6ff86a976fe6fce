// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/calibrate_input.hpp"

#include <algorithm>
#include <cmath>

#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

using namespace study::calibrate;

/// A floor at z = 0 with free space above, 0.04 m voxels.
map::OccupancyGrid flat_floor() {
  constexpr double kEdge = 0.04, kHalf = 2.4, kTop = 2.0;
  const int side = static_cast<int>(std::lround(2 * kHalf / kEdge)), top = static_cast<int>(std::lround(kTop / kEdge));
  map::OccupancyGrid grid({-kHalf, -kHalf, -kEdge}, kEdge, {side, side, top + 1}, map::Cell::free);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) grid.set({i, j, 0}, map::Cell::occupied);
  return grid;
}

double value_of(const log::FlightLog& log, const std::string& column, double otherwise) {
  return log.has(column) && !log.column(column).empty() ? log.column(column).front() : otherwise;
}

study::WindowOptions mapless_windows(const Model& gates) {
  study::WindowOptions options;
  options.tau_w = gates.bound.tau_w;
  options.still_mps = 10;  // passes too
  return options;
}

std::size_t place_of(const CampaignFiles& files, const CampaignFiles::Log& log) {
  if (files.maps.size() <= 1) return 0;
  if (!log.map)
    throw Failure(kUsage, "--log " + log.path + " stands before the first of several --map; put it after its own");
  return *log.map;
}

}  // namespace

void add_campaign_options(Command& command, CampaignFiles& files) {
  command
      .add_text(
          "--map", [&files](const std::string& map) { files.maps.push_back(map); },
          "OctoMap file or builtin:NAME of the logs that follow; optional")
      .trigger_on_parse();
  command
      .add_texts(
          "--log",
          [&files](const std::vector<std::string>& logs) {
            const auto map = files.maps.empty() ? std::nullopt : std::optional(files.maps.size() - 1);
            for (const auto& log : logs) files.logs.push_back({log, map});
          },
          "flight logs, CSV")
      .trigger_on_parse()
      .required();
}

Campaign read_campaign(const CampaignFiles& files, const std::optional<Vehicle>& vehicle, const Model& gates,
                       std::uint64_t seed) {
  Campaign campaign{};
  const bool mapless = files.maps.empty();
  for (const auto& name : files.maps) campaign.maps.push_back(read_map(name)), campaign.map_names.push_back(name);
  if (mapless) campaign.maps.push_back(flat_floor());
  study::WindowOptions options;
  options.tau_w = gates.bound.tau_w;
  if (mapless) options = mapless_windows(gates);
  std::vector<HeightRow> rows;
  std::optional<study::Signal> signal;
  for (const auto& file : files.logs) {
    const std::size_t place = place_of(files, file), number = campaign.data.place.size();
    const auto log = read_table(file.path, "t_s");
    auto flight = study::flight_windows(log, vehicle, options, file.path);
    if (!flight) throw Failure(kBadData, flight.error().message);
    if (signal && *signal != flight->signal)
      throw Failure(kBadData, file.path + ":1: has " + (flight->signal == study::Signal::commanded ? "" : "no ") +
                                  "set-points, unlike the logs before it; calibrate them apart");
    signal = flight->signal;
    for (std::size_t g = 0; g < study::kHoverGates; ++g) campaign.gated[g] += flight->gated[g];
    for (const auto& what : flight->not_tested) {
      if (std::find(campaign.not_tested.begin(), campaign.not_tested.end(), what) == campaign.not_tested.end())
        campaign.not_tested.push_back(what);
    }
    if (mapless) {
      const auto more = height_rows(*flight, log, number);
      rows.insert(rows.end(), more.begin(), more.end());
    }
    for (auto& w : flight->windows) {
      if (mapless) w.p_W = {0, 0, std::max(0.02, w.p_W.z() - value_of(log, "surface_z_m", 0))};
    }
    campaign.windows += flight->windows.size();
    auto hovers = hovers_of(*flight, number, campaign.maps[place], gates);
    std::move(hovers.begin(), hovers.end(), std::back_inserter(campaign.data.hovers));
    campaign.data.place.push_back(place), campaign.logs.push_back(file.path);
  }
  campaign.signal = study::to_string(*signal), campaign.pushes = signal == study::Signal::commanded;
  if (const auto effects = height_effects(rows, seed)) campaign.height = effects->all;
  return campaign;
}

std::optional<HeightEffects> read_height_effects(const std::vector<std::string>& logs, const Model& gates,
                                                 std::uint64_t seed) {
  std::vector<HeightRow> rows;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    const auto log = read_table(logs[k], "t_s");
    const auto flight = study::flight_windows(log, std::nullopt, mapless_windows(gates), logs[k]);
    if (!flight) throw Failure(kBadData, flight.error().message);
    const auto more = height_rows(*flight, log, k);
    rows.insert(rows.end(), more.begin(), more.end());
  }
  return height_effects(rows, seed);
}

}  // namespace backwash::services
