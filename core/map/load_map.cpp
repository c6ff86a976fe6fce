// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/load_map.hpp"

#include <string_view>

namespace backwash::map {

tl::expected<OccupancyGrid, MapError> load_map(const std::string& map) {
  constexpr std::string_view kBuiltin = "builtin:";
  return map.starts_with(kBuiltin) ? builtin_scene(map.substr(kBuiltin.size())) : load_octomap(map);
}

}  // namespace backwash::map
