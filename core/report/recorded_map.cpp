// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/recorded_map.hpp"

#include "core/map/octomap/octomap_message.hpp"

namespace backwash::report {
namespace {

tl::unexpected<log::LogError> bad(const std::string& what) {
  return tl::make_unexpected(log::LogError{log::LogError::Kind::bad_data, "raw log: " + what});
}

}  // namespace

tl::expected<map::OccupancyGrid, log::LogError> recorded_map(std::span<const log::RawRecord> log) {
  for (auto record = log.rbegin(); record != log.rend(); ++record)
    if (accepted_map(*record)) return recorded_map(*record);
  return bad("no map was accepted");
}

bool accepted_map(const log::RawRecord& record) noexcept {
  const auto* head = record.header.kind == log::RecordKind::map ? log::payload<log::MapRecord>(record) : nullptr;
  return head && head->accepted;
}

tl::expected<map::OccupancyGrid, log::LogError> recorded_map(const log::RawRecord& accepted) {
  const auto& head = *log::payload<log::MapRecord>(accepted);
  const std::span data(reinterpret_cast<const std::int8_t*>(accepted.bytes.data()) + sizeof head,
                       accepted.bytes.size() - sizeof head);
  auto grid = map::decode_octomap(data, head.resolution, head.binary, "OcTree");
  if (!grid) return bad(grid.error().message);
  return std::move(*grid);
}

}  // namespace backwash::report
