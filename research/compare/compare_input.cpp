// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare_input.hpp"

#include <algorithm>
#include <filesystem>

#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

std::vector<std::string> maps_of_one(const std::string& scenes) {
  if (scenes == "builtin")
    return {"builtin:apartment", "builtin:corridors", "builtin:narrow-gap", "builtin:forest-1", "builtin:forest-2"};
  if (!std::filesystem::is_directory(scenes)) return {scenes};
  std::vector<std::string> maps;
  for (const auto& entry : std::filesystem::directory_iterator(scenes)) {
    const auto extension = entry.path().extension();
    if (extension == ".bt" || extension == ".ot") maps.push_back(entry.path().string());
  }
  if (maps.empty()) throw Failure(kNoInput, scenes + ":1: has no OctoMap file; name a folder with .bt or .ot files");
  std::ranges::sort(maps);
  return maps;
}

}  // namespace

std::vector<std::string> maps_of(const std::vector<std::string>& scenes) {
  std::vector<std::string> maps;
  for (const auto& one : scenes)
    for (auto& map : maps_of_one(one)) maps.push_back(std::move(map));
  return maps;
}

std::vector<std::string> models_of(const std::vector<std::string>& vehicles, const std::vector<std::string>& models) {
  if (models.empty()) {
    for (const auto& vehicle : vehicles) {
      if (!vehicle.starts_with("builtin:"))
        throw Failure(kUsage, "--vehicle " + vehicle + " has no model of its own; give one --model a vehicle");
    }
    return vehicles;
  }
  if (models.size() != vehicles.size())
    throw Failure(kUsage, "give one --model a --vehicle, in the same order, or none");
  return models;
}

}  // namespace backwash::services
