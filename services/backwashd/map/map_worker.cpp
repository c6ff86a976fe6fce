// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/map_worker.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <future>
#include <memory>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "core/config/file_hash.hpp"
#include "core/map/octomap/octomap_message.hpp"
#include "core/map/octomap/octomap_tree.hpp"
#include "core/reach/response/integrator.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/map/map_change.hpp"
#include "services/dds/dds.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::daemon {
namespace {

constexpr int kBelowTheRest = 10;  // niceness
constexpr double kMadeFirst = 5;   // m level from the vehicle to the sides of what is made first
constexpr std::int64_t kVehicleWithin_ns = 2'000'000'000;  // for so long the place of the vehicle is waited for
constexpr int kWorthIt = 4;  // times as many voxels as that has a map of which a part is made first

/// The daemon ends while a world is in the making.
struct Ended {};

/// run_parallel, given up with Ended as soon as the daemon ends: a world may take minutes.
Parallel until_the_end(const std::atomic<bool>& stop) {
  return [&stop](std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
    run_parallel(count, [&](std::size_t begin, std::size_t end) {
      if (stop) throw Ended{};
      work(begin, end);
    });
  };
}

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

void MapWorker::tell_control(const NewVoxels& voxels) {
  if (voxels.count > 0) channels_.map_voxels.push_or_count(voxels);
}

void MapWorker::tell_map(const map::OccupancyGrid& grid, std::int64_t received_ns, std::int64_t world_ns) {
  tell_control(news(world_->grid, grid, std::max(received_ns, world_ns + 1)));
}

/// What was heard since it was begun is not in it, and is told against it.
void MapWorker::publish(World world, std::int64_t seen_ns) {
  const bool anew = world != world_;
  world_ = std::move(world);
  std::vector<Index3> not_free;
  for (const auto* box : {&said_, &gone_})
    map::for_each_voxel(*box, [&](const Index3& v) {
      if (!live_->grid().free(v)) not_free.push_back(world_->grid.index(live_->grid().center(v)));
    });
  tell_control(news(world_->grid, not_free, std::max(heard_ns_, seen_ns + 1)));
  if (next_) tell_map(next_->grid, next_->message.received_ns, seen_ns);
  channels_.map_ns.store(seen_ns);
  channels_.worlds.offer({world_, seen_ns});
  const double age = static_cast<double>(now_ns() - seen_ns) * 1e-6;
  if (anew) recorder_.append(log::RecordKind::world, "snapshot " + std::to_string(age) + " ms after its newest data");
}

MapWorker::World MapWorker::made(const std::function<World()>& make) {
  constexpr std::chrono::milliseconds kHear{5};
  auto world = std::async(std::launch::async, [&] {
    if (below_) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), getpriority(PRIO_PROCESS, 0) + kBelowTheRest);
    return make();
  });
  while (world.wait_for(kHear) != std::future_status::ready) {
    hear();
    if (world_ && take_map()) tell_map(next_->grid, next_->message.received_ns, channels_.map_ns.load().value_or(0));
  }
  return world.get();
}

MapWorker::World MapWorker::built(map::OccupancyGrid grid) {
  return made([&] {
    const map::VoxelBox all = map::all_of(grid.size());
    return plan::rebuilt(plan::unbuilt_world(std::move(grid), model_, vehicle_), {.voxels = all, .air = air_},
                         parallel_);
  });
}

void MapWorker::use(const MapMessage& message, map::OccupancyGrid whole) {
  const auto begun = now_ns();
  if (world_) tell_map(whole, message.received_ns, channels_.map_ns.load().value_or(0));
  if (live_ || window_) hear();  // what came before the map
  const Index3 size = whole.size();
  auto grid = window_ ? window_->whole(std::move(whole)) : std::optional(std::move(whole));
  heard_ns_ = std::max(heard_ns_, message.received_ns);
  const auto accepted = [&](const char* how) {
    spdlog::info("map accepted: {} x {} x {} voxels, world {} in {} ms", size.x(), size.y(), size.z(), how,
                 (now_ns() - begun) / 1'000'000);
  };
  if (!grid) {
    await_vehicle();
    if (move_world(true)) return accepted("around the vehicle built");
    live_.reset();  // the world before it has no part in that of this map
    said_ = gone_ = {};
    return spdlog::info("map kept: its world is made around the vehicle, once there is odometry");
  }
  channels_.world_moves = false;
  look_at(std::move(*grid));
  hear();
  said_ = gone_ = {};  // the world to be made holds it
  const auto seen_ns = heard_ns_;
  const bool update = world_ && same_place(world_->grid, live_->grid());
  if (update) {
    plan::Change change{.grid = live_->grid(), .voxels = difference(world_->grid, live_->grid())};
    publish(made([&] { return plan::rebuilt(*world_, std::move(change), parallel_); }), seen_ns);
  } else {
    map::OccupancyGrid copy = live_->grid();
    if (!world_) publish_near(copy, seen_ns);  // what flies in another world is not cut short
    publish(built(std::move(copy)), seen_ns);
    channels_.map_partial = false;
  }
  accepted(update ? "updated" : "built");
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
void MapWorker::publish_near(const map::OccupancyGrid& grid, std::int64_t seen_ns) {
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
  auto near = made([&] {
    return plan::rebuilt(plan::unbuilt_world(map::part_of(grid, columns), model_, vehicle_),
                         {.voxels = map::all_of(extent), .around = &grid}, parallel_);
  });
  channels_.map_partial = true;
  publish(std::move(near), seen_ns);
  spdlog::info("map: {:.0f} m around the vehicle can be flown after {} ms, the rest follows", kMadeFirst,
               (now_ns() - begun) / 1'000'000);
}

/// Factors that have grown enough, or one that fell: the world of the newest data, in that air.
bool MapWorker::take_air() {
  const auto said = channels_.air.read_new();
  if (!said || !air_) return false;
  const bool fell = std::exchange(air_falls_, said->falls) != said->falls;
  air_ = fell ? said->factors : larger(*air_, said->factors);
  if (!world_) return false;
  if (covers(world_->air.factors, *air_) && !(fell && *air_ != world_->air.factors)) return false;
  const auto begun = now_ns();
  const std::int64_t seen_ns = channels_.map_ns.load().value_or(begun);
  publish(made([&] { return plan::rebuilt(*world_, {.air = air_}, parallel_); }), seen_ns);
  const char* const what = !fell ? "rougher" : *std::ranges::min_element(*air_) < 1 ? "calmer" : "reset";
  std::string line = "air";
  for (std::size_t k = 0; k < kAirClasses; ++k)
    line += std::string(" ") + to_string(static_cast<AirClass>(k)) + " " + std::to_string((*air_)[k]);
  recorder_.append(log::RecordKind::world, line);
  spdlog::info("world made anew in {} ms for {} {}", (now_ns() - begun) / 1'000'000, what, line);
  return true;
}

bool MapWorker::step() {
  // What makes worlds beside a flight is below everything else in the process, and below the kernel's workers that
  // carry the serial line. Before the first world nothing flies, and beside busy processors a thread so low waits for
  // minutes; so what hears is not.
  below_ = world_ != nullptr;
  const std::uint64_t rejected = channels_.maps_rejected;
  take_map();
  bool worked = next_ || channels_.maps_rejected != rejected;
  try {
    if (auto map = std::exchange(next_, std::nullopt)) {
      use(map->message, std::move(map->grid));
      ++channels_.maps_accepted;
      tell(map->message, "");  // not before: its sender goes on as soon as it is in use
    }
    worked = take_news() || worked;
    worked = take_air() || worked;
  } catch (const Ended&) {  // the old world stays
  }
  channels_.worlds.collect();
  return worked;
}

void run_map_worker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle,
                    const MapSettings& settings, const std::optional<AirFactors>& air) {
  MapWorker worker(channels, recorder, model, vehicle, settings, air);
  while (!channels.stop)
    if (!worker.step()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

// Which maps are used, and how the others are told of.

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
  const bool more = why.empty() && !message.binary && map::octomap_tree::bytes_beside(message.id) != 0;
  if (more) {  // logs hold occupancy alone
    MapMessage known = message;
    known.data = map::encode_octomap(*grid);
    known.binary = true;
    record(recorder_, known, true);
  } else {
    record(recorder_, message, why.empty());
  }
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

void MapWorker::tell_let_go(const WindowKeeper::Changes& changes) {
  if (changes.let_go == 0) return;
  const std::string line = "window: " + std::to_string(changes.let_go) + " voxels far from it are let go, " +
                           std::to_string(changes.let_go_blocks) +
                           " of them occupied: the last whole map speaks for them";
  recorder_.append(log::RecordKind::world, line);
  spdlog::info("{} ({} parts are held)", line, window_->parts());
}

void MapWorker::look_at(map::OccupancyGrid grid) {
  map::LiveMap live(std::move(grid));
  if (live_)
    live.take_along(
        *live_,
        ((live.grid().origin() - live_->grid().origin()) / live.grid().resolution()).array().round().cast<int>());
  live_.emplace(std::move(live));
  said_ = gone_ = {};
}

/// A world at another place, where the vehicle has come to the edge of the one in use, or anew of what is known. False:
/// there is no need, or nothing to make one of.
bool MapWorker::move_world(bool anew) {
  if (const auto newest = channels_.vehicle_W.read_new()) vehicle_W_ = *newest;
  if (!vehicle_W_) return false;
  auto grid = window_->moved(*vehicle_W_, live_ && !anew ? &live_->grid() : nullptr);
  if (!grid) return false;
  const auto begun = now_ns();
  const std::int64_t seen_ns = std::max(heard_ns_, channels_.map_ns.load().value_or(0));
  look_at(std::move(*grid));
  if (world_) tell_control(news(world_->grid, live_->grid(), seen_ns));
  channels_.world_moves = true;
  publish(built(live_->grid()), seen_ns);
  const Index3& size = world_->grid.size();
  spdlog::info("world of the window made around the vehicle: {} x {} x {} voxels in {} ms", size.x(), size.y(),
               size.z(), (now_ns() - begun) / 1'000'000);
  return true;
}

void MapWorker::note(const map::ScanChange& change, map::VoxelBox& box, std::int64_t received_ns) {
  if (change.box.empty()) return;
  box.add(change.box.low);
  box.add(change.box.high);
  if (!world_) return;
  for (const Index3& v : change.occupied) noted_.push_back(world_->grid.index(live_->grid().center(v)));
  noted_ns_ = std::max(noted_ns_, received_ns);
}

void MapWorker::take_cloud(const WindowCloud& cloud) {
  if (!window_) return;
  const auto changes = window_->take(cloud, live_ ? &*live_ : nullptr);
  ++channels_.scans_accepted;
  tell_let_go(changes);
  note(changes.said, said_, cloud.received_ns);
  note(changes.gone, gone_, cloud.received_ns);
  if (!cloud.free) heard_ns_ = std::max(heard_ns_, cloud.received_ns);
}

void MapWorker::take_scan(const Scan& scan) {
  // What was found before a loop closure lies where the map was then: the next map speaks for it.
  if (std::exchange(closures_, scan.closures) != scan.closures && live_) live_->forget_found();
  if (!live_ || !live_->grid().inside(live_->grid().index(scan.sensor_W))) {
    ++channels_.scans_rejected;  // no map yet, or the sensor is outside of it
    return;
  }
  note(live_->insert(scan.points_W, scan.sensor_W, settings_.sensor_range), said_, scan.received_ns);
  ++channels_.scans_accepted;
  heard_ns_ = std::max(heard_ns_, scan.received_ns);
}

/// In the order in which they came: the last word counts. One thread hands them over. None is left that came before one
/// that is taken. The age of the map is that of the newest scan, occupied cloud or map: free voxels alone say nothing
/// of what has come.
bool MapWorker::hear() {
  std::vector<std::unique_ptr<Scan>> scans;
  std::vector<std::unique_ptr<WindowCloud>> clouds;
  for (bool more = true; std::exchange(more, false);) {
    while (const auto next = channels_.windows.pop()) clouds.emplace_back(*next);
    while (const auto next = channels_.scans.pop()) scans.emplace_back(*next), more = true;
  }
  auto cloud = clouds.begin();
  const auto clouds_before = [&](std::int64_t ns) {
    for (; cloud != clouds.end() && (*cloud)->received_ns < ns; ++cloud) take_cloud(**cloud);
  };
  for (const auto& scan : scans) {
    clouds_before(scan->received_ns);
    take_scan(*scan);
  }
  clouds_before(INT64_MAX);
  if (!noted_.empty()) tell_control(news(world_->grid, std::exchange(noted_, {}), noted_ns_));  // in one record
  return !scans.empty() || !clouds.empty();
}

/// Scans and clouds that came meanwhile are in one world together.
bool MapWorker::take_news() {
  const auto begun = now_ns();
  const bool heard = hear();
  // Without news the vehicle may have come to the edge of its world all the same.
  if (window_ && move_world(false)) return true;
  const std::int64_t seen_ns = std::max(heard_ns_, channels_.map_ns.load().value_or(heard_ns_));
  const std::array boxes{std::exchange(said_, {}), std::exchange(gone_, {})};
  if (!boxes[0].empty() || !boxes[1].empty()) {
    const auto update = [&, grid = live_->grid()] {
      World world = world_;
      for (const map::VoxelBox& box : boxes)
        if (!box.empty()) world = plan::rebuilt(*world, {.grid = grid, .voxels = box}, parallel_);
      return world;
    };
    publish(made(update), seen_ns);
    spdlog::debug("map updated in {} ms", (now_ns() - begun) / 1'000'000);
    return true;
  }
  if (heard && world_ && seen_ns > channels_.map_ns.load()) publish(world_, seen_ns);  // it says what they say
  return heard;
}

}  // namespace backwash::daemon
