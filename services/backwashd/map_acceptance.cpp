// SPDX-License-Identifier: BSD-3-Clause
// Which maps are used, and how the others are told of.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <span>
#include <utility>

#include "core/config/file_hash.hpp"
#include "core/map/octomap_message.hpp"
#include "services/backwashd/map_worker.hpp"
#include "services/dds/dds.hpp"

namespace backwash::daemon {
namespace {

using config::kWorldBytesPerVoxel;
// Resolutions for which the field is known to hold (tests/field/resolution_and_yaw_test.cpp), m.
constexpr double kFinest = 0.02, kCoarsest = 0.2;

// A rejected map is told apart by its hash: whoever sends 40 MB of anything does not fill the disk with it.
void record(Recorder& recorder, const MapMessage& message, bool accepted) {
  const log::MapRecord head{message.resolution, message.binary, accepted};
  const log::RejectedMap rejected{
      message.data.size(),
      accepted ? 0 : config::fnv1a({reinterpret_cast<const char*>(message.data.data()), message.data.size()})};
  const auto bytes_of = [](const auto& value) { return std::as_bytes(std::span(&value, 1)); };
  const auto rest = accepted ? std::as_bytes(std::span(message.data)) : bytes_of(rejected);
  std::vector<std::uint8_t> bytes(sizeof head + rest.size());
  std::memcpy(bytes.data(), &head, sizeof head);
  if (!rest.empty()) std::memcpy(bytes.data() + sizeof head, rest.data(), rest.size());
  recorder.append(log::RecordKind::map, bytes);
}

/// A map that has no room, and what would make it.
std::string too_large(const MapSettings& settings) {
  return std::string("too large: its snapshot would need more than ") +
         std::to_string(static_cast<long>(settings.max_mib)) + " MiB (map.max_mib)";
}

}  // namespace

void MapWorker::tell(const MapMessage& message, const std::string& why) {
  if (!message.transfer) return;
  MapVerdict verdict{*message.transfer, why.empty(), {}};
  std::snprintf(verdict.why.data(), verdict.why.size(), "%s", why.c_str());
  channels_.map_verdict.write(verdict);
}

void MapWorker::reject(const MapMessage& message, const std::string& why) {
  ++channels_.maps_rejected;
  tell(message, why);
  spdlog::warn("map rejected: {}", why);
}

/// Why a map is refused; empty: it is not.
std::string MapWorker::wrong(const MapMessage& message,
                             const tl::expected<map::OccupancyGrid, map::MapError>& grid) const {
  if (!grid && grid.error().kind == map::MapError::Kind::too_large) return too_large(settings_);
  if (!grid) return grid.error().message;
  const auto is = [&](double wanted) { return std::abs(wanted - message.resolution) <= 1e-9; };
  const std::string seen = "resolution " + std::to_string(message.resolution) + " m, ";
  if (!(message.resolution >= kFinest * (1 - 1e-9) && message.resolution <= kCoarsest * (1 + 1e-9)))
    return seen + "expected 0.02 to 0.2 m";
  if (window_ && !is(settings_.window.resolution))
    return seen + "expected " + std::to_string(settings_.window.resolution) + " m (map.window.resolution)";
  if (world_ && !is(world_->grid.resolution()))
    return seen + "the map in use has " + std::to_string(world_->grid.resolution()) +
           " m; restart the daemon to change it";
  if (std::ranges::find(grid->cells(), map::Cell::free) == grid->cells().end()) return "it has no free voxel";
  return "";
}

/// What it says, or it is rejected.
std::optional<map::OccupancyGrid> MapWorker::accepted(const MapMessage& message) {
  // It was sent before the reader knew whose maps are used.
  if (writer_ && writer_->term == message.from.term && writer_->writer != message.from.writer) {
    reject(message, "it is of writer " + dds::text(message.from.writer) + ", that of " + dds::text(writer_->writer) +
                        " is in use");
    return std::nullopt;
  }
  const auto cap = static_cast<std::size_t>(settings_.max_mib * (1 << 20)) / kWorldBytesPerVoxel;
  auto grid = map::decode_octomap(message.data, message.resolution, message.binary, message.id,
                                  window_ ? window_->most_voxels() : cap);
  const std::string why = wrong(message, grid);
  record(recorder_, message, why.empty());
  if (!why.empty()) {
    reject(message, why);
    return std::nullopt;
  }
  if (!message.transfer) {  // a mapper stays; who sends a map in parts is done with it
    writer_ = message.from;
    channels_.map_writer.write(*writer_);
  }
  return std::move(*grid);
}

/// A map that has come is the next to be used, if it is accepted: true.
bool MapWorker::take_map() {
  const MapMessage* message = channels_.maps.take();
  if (!message) return false;
  auto grid = accepted(*message);
  if (grid) {
    if (next_) tell(next_->message, "a newer map came before this one was used");
    next_ = Accepted{
        {{}, message->resolution, message->binary, message->id, message->received_ns, message->from, message->transfer},
        std::move(*grid)};
  }
  channels_.maps.give_back(message);
  return grid.has_value();
}

}  // namespace backwash::daemon
