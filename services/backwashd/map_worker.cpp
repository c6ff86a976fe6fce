// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map_worker.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <thread>
#include <utility>

#include "core/reach/integrator.hpp"
#include "services/backwashd/map_change.hpp"
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
    auto world = plan::build_world(std::move(grid), model_, vehicle_, reach::Method::tight, std::nullopt, parallel_);
    return air_ ? plan::with_air(*world, *air_, model_, parallel_) : world;
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
    const map::VoxelBox changed = difference(world_->grid, live_->grid());
    publish(made([&, grid = live_->grid()]() mutable {
              return plan::update_world(*world_, std::move(grid), changed, model_, parallel_);
            }),
            seen_ns);
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
  auto near = made([&] { return plan::build_part(grid, columns, model_, vehicle_, parallel_); });
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
  publish(made([&] { return plan::with_air(*world_, *air_, model_, parallel_); }), seen_ns);
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

}  // namespace backwash::daemon
