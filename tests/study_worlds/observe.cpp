// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/observe.hpp"

#include <memory>
#include <optional>
#include <tuple>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"

namespace study_worlds {

namespace study = backwash::study;

namespace {

using MapKey = std::tuple<std::uint64_t, std::string, double>;  // seed, circumstances (of the room), offset

struct MapSeen {
  MapKey key;
  backwash::map::OccupancyGrid grid;
  study::MapView surroundings;
  MapSeen(const MapKey& of, const std::filesystem::path& file, const backwash::Model& model)
      : key(of), grid(backwash::map::load_map(file.string()).value()), surroundings(&grid, model) {}
  MapSeen(const MapSeen&) = delete;
};

backwash::log::FlightLog log_of(const Table& table) {
  backwash::log::FlightLog log;
  for (std::size_t c = 0; c < table.names.size(); ++c) {
    std::vector<double> column;
    for (const auto& row : table.rows) column.push_back(row[c]);
    (table.names[c] == "t_s" ? log.t_s : log.columns[table.names[c]]) = std::move(column);
  }
  return log;
}

/// An observer of the world; writes its map and vehicle to `folder`.
std::unique_ptr<study::Observer> observer_of(const HiddenWorld& world, const std::filesystem::path& folder) {
  write_world_files(world, folder);
  const auto vehicle = backwash::config::load_vehicle((folder / "vehicle.toml").string()).value();
  auto model = backwash::config::load_model("builtin:" + world.craft.model).value();
  model.ground.r0 = vehicle.body.diagonal_radius;
  // Worlds of one seed and map are pairs: what was looked up for the last one serves the next.
  thread_local std::optional<MapSeen> last;
  const MapKey key{world.request.seed, world.request.confound, world.effects.of("map_offset")};
  if (!last || last->key != key) last.emplace(key, folder / "map.bt", model);
  return std::make_unique<study::Observer>(vehicle, last->surroundings);
}

}  // namespace

study::Observations observe(const HiddenWorld& world, const std::filesystem::path& folder) {
  return observe(world, fly_all(world), folder);
}

study::Observations observe(const HiddenWorld& world, const std::vector<Table>& flights,
                            const std::filesystem::path& folder) {
  const auto observer = observer_of(world, folder);
  for (const Table& table : flights) observer->add(log_of(table));
  return observer->finish();
}

int observe_further(const HiddenWorld& world, const std::vector<Table>& first, const std::filesystem::path& folder,
                    int most, const std::function<Table(int)>& flight,
                    const std::function<bool(const study::Observations&)>& look) {
  const auto observer = observer_of(world, folder);
  for (const Table& table : first) observer->add(log_of(table));
  for (int n = 1; n <= most; ++n) {
    observer->add(log_of(flight(n)));
    if (look(observer->so_far())) return n;
  }
  return most + 1;
}

study::SoundRotors sound_rotors(const HiddenWorld& world, const std::filesystem::path& folder) {
  // Worlds of one seed mostly have one craft. An empty room is drawn from fewer numbers, and the craft after it is
  // another one: with the motors' commands of one and the thrust curve of the other sound rotors look damaged.
  using Key = std::tuple<std::uint64_t, double, double, double, double>;
  thread_local std::optional<std::pair<Key, study::SoundRotors>> last;
  const Key craft(world.request.seed, world.craft.rotor_spread, world.craft.max_thrust, world.craft.thr_mdl_fac,
                  world.craft.mass);
  if (last && last->first == craft) return last->second;
  constexpr int kSound = 6, kOthers = 1000;
  HiddenWorld sound = world;
  sound.effects = {};
  std::vector<Table> flights;
  for (int f = 0; f < kSound; ++f) flights.push_back(fly_again(sound, kOthers + f, 0));
  last.emplace(craft, study::sound_rotors(observe(sound, flights, folder)).value());
  return last->second;
}

study::StudyOptions with_reference(const HiddenWorld& world, const std::filesystem::path& folder) {
  study::StudyOptions options;
  options.sound = sound_rotors(world, folder);
  return options;
}

std::vector<std::vector<std::string>> sets_of(const study::StudyResult& result) {
  std::vector<std::vector<std::string>> sets;
  for (const auto& cause : result.causes) {
    sets.push_back({cause.found.form->cause()});
    for (const auto& rival : cause.found.rivals) sets.back().push_back(rival.name);
  }
  return sets;
}

std::string told(const std::vector<std::vector<std::string>>& sets, const std::vector<std::string>& unknown) {
  std::string text;
  for (const auto& set : sets) {
    text += text.empty() ? "" : " + ";
    for (const auto& name : set) text += (&name == &set.front() ? "" : "|") + name;
  }
  for (const auto& along : unknown) text += (text.empty() ? "?" : " + ?") + along;
  return text.empty() ? "nothing" : text;
}

std::string told(const study::StudyResult& result) {
  std::vector<std::string> unknown;
  for (const auto& u : result.unknown) unknown.push_back(u.along);
  return told(sets_of(result), unknown);
}

}  // namespace study_worlds
