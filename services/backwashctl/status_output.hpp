// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include "services/backwashctl/station.hpp"
#include "services/dds/air_text.hpp"

namespace backwash::ctl {

/// The status as `status --json` prints it: the IDL's fields, with units in the names where they are not SI.
nlohmann::json json_of(const StatusCopy& status);
/// As text; what others said may be no UTF-8, and JSON is. `indent`: of each level, −1: one line.
std::string text_of(const nlohmann::json& json, int indent);
/// What the live page lists of it: name and text, in the order of dds::kStatusMembers.
std::vector<std::pair<std::string, std::string>> rows_of(const StatusCopy& status);
/// One line of it on stdout.
void print(const StatusCopy& status);

/// What the flight has learnt of its air, of each class; null: nothing is learnt.
nlohmann::ordered_json json_of(const std::optional<dds::AirSaid>& air);
void print(const std::optional<dds::AirSaid>& air);

}  // namespace backwash::ctl
