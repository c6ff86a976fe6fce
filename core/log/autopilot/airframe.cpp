// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/airframe.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

namespace backwash::log {
namespace {

/// What the values of one number mean, from `first` to `last`: rotors of a multicopter, or another kind.
struct Meaning {
  std::string_view of;
  int first, last, rotors;
  const char* other = nullptr;
};

constexpr const char *kWing = "a fixed wing", *kVtol = "a VTOL", *kRover = "a rover", *kHelicopter = "a helicopter";

/// PX4's vehicle_status.msg and its module control_allocator, MAVLink's MAV_TYPE, ArduCopter's FRAME_CLASS.
constexpr Meaning kMeanings[] = {{"vehicle_type", 2, 2, 0, kWing},
                                 {"vehicle_type", 3, 3, 0, kRover},
                                 {"vehicle_type", 4, 4, 0, "an airship"},
                                 {"is_vtol", 1, 1, 0, kVtol},
                                 {"MAV_TYPE", 1, 1, 0, kWing},
                                 {"MAV_TYPE", 2, 2, 4},
                                 {"MAV_TYPE", 3, 4, 0, kHelicopter},
                                 {"MAV_TYPE", 7, 7, 0, "an airship"},
                                 {"MAV_TYPE", 10, 10, 0, kRover},
                                 {"MAV_TYPE", 11, 11, 0, "a boat"},
                                 {"MAV_TYPE", 12, 12, 0, "a submarine"},
                                 {"MAV_TYPE", 13, 13, 6},
                                 {"MAV_TYPE", 14, 14, 8},
                                 {"MAV_TYPE", 15, 15, 3},
                                 {"MAV_TYPE", 19, 25, 0, kVtol},
                                 {"MAV_TYPE", 29, 29, 12},
                                 {"MAV_TYPE", 35, 35, 10},
                                 {"CA_AIRFRAME", 1, 1, 0, kWing},
                                 {"CA_AIRFRAME", 2, 4, 0, kVtol},
                                 {"CA_AIRFRAME", 5, 6, 0, kRover},
                                 {"CA_AIRFRAME", 10, 12, 0, kHelicopter},
                                 {"CA_AIRFRAME", 13, 13, 0, kRover},
                                 {"FRAME_CLASS", 2, 2, 6},
                                 {"FRAME_CLASS", 3, 4, 8},
                                 {"FRAME_CLASS", 5, 5, 6},
                                 {"FRAME_CLASS", 6, 6, 0, kHelicopter},
                                 {"FRAME_CLASS", 7, 7, 3},
                                 {"FRAME_CLASS", 8, 8, 1},
                                 {"FRAME_CLASS", 9, 10, 2},
                                 {"FRAME_CLASS", 11, 11, 0, kHelicopter},
                                 {"FRAME_CLASS", 12, 12, 12},
                                 {"FRAME_CLASS", 13, 13, 0, kHelicopter},
                                 {"FRAME_CLASS", 14, 14, 10}};

/// What ArduPilot's firmwares and frames call themselves in MSG.
constexpr struct {
  std::string_view text;
  int rotors;
  const char* other = nullptr;
} kTexts[] = {{"ArduPlane", 0, kWing},    {"ArduRover", 0, kRover},
              {"Rover", 0, kRover},       {"ArduSub", 0, "a submarine"},
              {"Blimp", 0, "an airship"}, {"Frame: HEXA", 6},
              {"Frame: OCTA", 8},         {"Frame: Y6", 6},
              {"Frame: TRI", 3},          {"Frame: HELI", 0, kHelicopter}};

/// The value of a field that it has most of the time.
std::optional<int> mostly(const TopicLog& topics, const char* topic, const char* field) {
  const auto* of = topics.find(topic);
  if (!of || !of->columns.contains(field)) return std::nullopt;
  std::map<int, std::size_t> times;
  for (const double value : of->columns.at(field)) times[static_cast<int>(value)] += 1;
  return std::ranges::max_element(times, {}, [](const auto& t) { return t.second; })->first;
}

}  // namespace

Airframe airframe_of(const TopicLog& topics) {
  std::map<std::string, std::optional<int>> said{{"vehicle_type", mostly(topics, "vehicle_status", "vehicle_type")},
                                                 {"is_vtol", mostly(topics, "vehicle_status", "is_vtol")},
                                                 {"MAV_TYPE", mostly(topics, "vehicle_status", "system_type")}};
  for (const char* name : {"MAV_TYPE", "CA_AIRFRAME", "FRAME_CLASS"})
    if (const auto found = topics.parameters.find(name); found != topics.parameters.end())
      said[name] = static_cast<int>(found->second);
  Airframe frame;
  for (const auto& [of, first, last, rotors, other] : kMeanings) {
    const auto value = said[std::string(of)];
    if (!value || *value < first || *value > last) continue;
    if (rotors > 0)
      frame.rotors = rotors;
    else if (frame.other.empty())
      frame.other = std::string(other) + " (" + std::string(of) + " " + std::to_string(*value) + ")";
  }
  if (const auto count = topics.parameters.find("CA_ROTOR_COUNT"); count != topics.parameters.end())
    if (count->second > 0) frame.rotors = static_cast<int>(count->second);
  for (const auto& text : topics.texts)
    for (const auto& [begins, rotors, other] : kTexts) {
      if (!text.starts_with(begins)) continue;
      if (rotors > 0)
        frame.rotors = rotors;
      else if (frame.other.empty())
        frame.other = std::string(other) + " (it calls itself " + text + ")";
    }
  return frame;
}

}  // namespace backwash::log
