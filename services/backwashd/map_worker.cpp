// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map_worker.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <span>
#include <thread>
#include <utility>

#include "core/config/file_hash.hpp"
#include "core/map/octomap_message.hpp"
#include "core/reach/integrator.hpp"
#include "services/backwashd/map_change.hpp"
#include "services/dds/dds.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::daemon {
namespace {

using config::kWorldBytesPerVoxel;
// Resolutions for which the field is known to hold (tests/field/resolution_and_yaw_test.cpp), m.
constexpr int kBelowTheRest = 10;  // niceness
constexpr double kMadeFirst = 5;   // m level from the vehicle to the sides of what is made first
constexpr std::int64_t kVehicleWithin_ns = 2'000'000'000;  // for so long the place of the vehicle is waited for
constexpr int kWorthIt = 4;  // times as many voxels as that has a map of which a part is made first
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

/// The daemon ends while a world is in the making.
struct Ended {};

/// A map that has no room, and what would make it.
std::string too_large(const MapSettings& settings) {
  return std::string("too large: its snapshot would need more than ") +
         std::to_string(static_cast<long>(settings.max_mib)) + " MiB (map.max_mib)";
}

/// run_parallel, given up with Ended as soon as the daemon ends: a world may take minutes.
Parallel until_the_end(const std::atomic<bool>& stop) {
  return [&stop](std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
    run_parallel(count, [&](std::size_t begin, std::size_t end) {
      if (stop) throw Ended{};
      work(begin, end);
    });
  };
}

}  // namespace

MapWorker::MapWorker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle,
                     const MapSettings& settings, const std::optional<AirFactors>& air)
    : channels_(channels),
      recorder_(recorder),
      model_(model),
      vehicle_(vehicle),
      settings_(settings),
      parallel_(until_the_end(channels.stop)),
      air_(air) {
  model_.unknown_floor = settings_.window.declared();
  if (settings_.window.declared()) window_.emplace(settings_);
}

MapWorker::~MapWorker() {
  while (const auto scan = channels_.scans.pop()) delete *scan;
  while (const auto cloud = channels_.windows.pop()) delete *cloud;
}

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

void MapWorker::publish(std::shared_ptr<const plan::World> world, std::int64_t received_ns) {
  world_ = std::move(world);
  channels_.map_ns.store(received_ns);
  channels_.worlds.offer({world_, received_ns});
  const double age = static_cast<double>(now_ns() - received_ns) * 1e-6;
  recorder_.append(log::RecordKind::world, "snapshot " + std::to_string(age) + " ms after its newest data");
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

void MapWorker::take_map(const MapMessage& message) {
  // It was sent before the reader knew whose maps are used.
  if (writer_ && writer_->term == message.from.term && writer_->writer != message.from.writer)
    return reject(message, "it is of writer " + dds::text(message.from.writer) + ", that of " +
                               dds::text(writer_->writer) + " is in use");
  const auto cap = static_cast<std::size_t>(settings_.max_mib * (1 << 20)) / kWorldBytesPerVoxel;
  auto grid = map::decode_octomap(message.data, message.resolution, message.binary, message.id,
                                  window_ ? window_->most_voxels() : cap);
  const std::string why = wrong(message, grid);
  record(recorder_, message, why.empty());
  if (!why.empty()) return reject(message, why);
  if (!message.transfer) {  // a mapper stays; who sends a map in parts is done with it
    writer_ = message.from;
    channels_.map_writer.write(*writer_);
  }
  use(message, std::move(*grid));
  ++channels_.maps_accepted;
  tell(message, "");  // not before: its sender goes on as soon as it is in use
}

void MapWorker::use(const MapMessage& message, map::OccupancyGrid whole) {
  const auto begun = now_ns();
  const Index3 size = whole.size();
  auto grid = window_ ? window_->whole(std::move(whole)) : std::optional(std::move(whole));
  const bool update = grid && world_ && same_place(world_->grid, *grid);
  if (grid) channels_.world_moves = false;
  if (!grid) {
    await_vehicle();
    if (!move_world(true, message.received_ns)) {
      live_.reset();  // the world before it has no part in that of this map
      spdlog::info("map kept: its world is made around the vehicle, once there is odometry");
    }
  } else if (update) {
    const auto change = difference(world_->grid, *grid);
    if (!change.occupied.empty()) channels_.map_voxels.push(as_new_voxels(world_->grid, change, message.received_ns));
    live_.emplace(*grid);
    publish(plan::update_world(*world_, std::move(*grid), change.box, model_, parallel_), message.received_ns);
  } else {
    live_.emplace(*grid);
    if (!world_) publish_near(*grid, message.received_ns);  // what flies in another world is not cut short
    publish(made(std::move(*grid)), message.received_ns);
    channels_.map_partial = false;
  }
  spdlog::info("map accepted: {} x {} x {} voxels, world {} in {} ms", size.x(), size.y(), size.z(),
               update ? "updated" : "built", (now_ns() - begun) / 1'000'000);
}

std::shared_ptr<const plan::World> MapWorker::made(map::OccupancyGrid grid) const {
  auto world = plan::build_world(std::move(grid), model_, vehicle_, reach::Method::tight, std::nullopt, parallel_);
  return air_ ? plan::with_air(*world, *air_, model_, parallel_) : world;
}

// The map and the first pose come in any order, and the whole takes longer than to wait for the other.
void MapWorker::await_vehicle() {
  const auto until = now_ns() + kVehicleWithin_ns;
  do {
    if (const auto newest = channels_.vehicle_W.read_new()) vehicle_W_ = *newest;
    if (vehicle_W_ || channels_.stop) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  } while (now_ns() < until);
}

// Σ takes seconds in a building and longer on an office floor. Until then the vehicle may fly in what is around it.
void MapWorker::publish_near(const map::OccupancyGrid& grid, std::int64_t received_ns) {
  if (air_ || !model_.extension.empty() || reach::has_integrator(vehicle_)) return;
  const int by = static_cast<int>(std::ceil(kMadeFirst / grid.resolution()));
  const Index3 last = grid.size() - Index3::Ones();
  const Index3 corner = last.cwiseMin(Index3(by, by, last.z())) + Index3::Ones();  // the least that it can be
  if (static_cast<std::size_t>(corner.prod()) * kWorthIt > grid.cell_count()) return;
  await_vehicle();
  if (!vehicle_W_ || !grid.inside(grid.index(*vehicle_W_))) return;
  const auto begun = now_ns();
  const Index3 v = grid.index(*vehicle_W_);
  const map::VoxelBox columns{(v - Index3(by, by, v.z())).cwiseMax(0), (v + Index3(by, by, last.z())).cwiseMin(last)};
  const Index3 extent = columns.high - columns.low + Index3::Ones();
  if (static_cast<std::size_t>(extent.prod()) * kWorthIt > grid.cell_count()) return;
  auto near = plan::build_part(grid, columns, model_, vehicle_, parallel_);
  channels_.map_partial = true;
  publish(std::move(near), received_ns);
  spdlog::info("map: {:.0f} m around the vehicle can be flown after {} ms, the rest follows", kMadeFirst,
               (now_ns() - begun) / 1'000'000);
}

bool MapWorker::take_scan(const Scan& scan, map::VoxelBox& box) {
  if (!live_ || !live_->grid().inside(live_->grid().index(scan.sensor_W))) {
    ++channels_.scans_rejected;  // no map yet, or the sensor is outside of it
    return false;
  }
  const auto change = live_->insert(scan.points_W, scan.sensor_W, settings_.sensor_range);
  if (!change.box.empty()) {
    box.add(change.box.low);
    box.add(change.box.high);
  }
  ++channels_.scans_accepted;
  return true;
}

/// Factors that have grown enough, or one that fell: the world of the newest data, in that air.
bool MapWorker::take_air() {
  const auto said = channels_.air.read_new();
  if (!said || !air_) return false;
  const bool fell = std::exchange(air_falls_, said->falls) != said->falls;
  air_ = fell ? said->factors : larger(*air_, said->factors);
  if (!world_) return false;
  bool grew = fell && *air_ != world_->air.factors;
  for (std::size_t k = 0; k < kAirClasses; ++k) {
    const double made = world_->air.factors[k];  // below the model's no step is too small
    grew = grew || (*air_)[k] >= (1 + kStep) * made || (made < 1 && (*air_)[k] > made);
  }
  if (!grew) return false;
  const auto begun = now_ns();
  publish(plan::with_air(*world_, *air_, model_, parallel_), channels_.map_ns.load().value_or(begun));
  const char* const what = !fell ? "rougher" : *std::ranges::min_element(*air_) < 1 ? "calmer" : "reset";
  std::string line = "air";
  for (std::size_t k = 0; k < kAirClasses; ++k)
    line += std::string(" ") + to_string(static_cast<AirClass>(k)) + " " + std::to_string((*air_)[k]);
  recorder_.append(log::RecordKind::world, line);
  spdlog::info("world made anew in {} ms for {} {}", (now_ns() - begun) / 1'000'000, what, line);
  return true;
}

bool MapWorker::step() {
  const MapMessage* message = channels_.maps.take();
  bool scanned = false, rougher = false;
  try {
    if (message) take_map(*message);
    scanned = take_news();
    rougher = take_air();
  } catch (const Ended&) {  // the old world stays
  }
  if (message) channels_.maps.give_back(message);
  channels_.worlds.collect();
  return message || scanned || rougher;
}

void run_map_worker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle,
                    const MapSettings& settings, const std::optional<AirFactors>& air) {
  MapWorker worker(channels, recorder, model, vehicle, settings, air);
  bool below = false;
  while (!channels.stop) {
    if (!worker.step()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    // From the first world on below everything else in the process, and below the kernel's workers that carry the
    // serial line; inherited by the threads that build worlds. Before it nothing flies, and beside busy processors a
    // thread so low waits for minutes.
    if (!below && channels.map_ns.load())
      below = setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kBelowTheRest) == 0;
  }
}

}  // namespace backwash::daemon
