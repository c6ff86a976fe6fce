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
#include "services/backwashd/scan_placement.hpp"
#include "services/dds/dds.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::daemon {
namespace {

// Of a snapshot and of the live grid behind it, at most: grid 1, misses and marks 2, distance 4, Σ 24, bounds 4 + 64,
// hover map 16.
constexpr std::size_t kBytesPerVoxel = 115;
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

bool same_place(const map::OccupancyGrid& a, const map::OccupancyGrid& b) {
  return a.size() == b.size() && a.resolution() == b.resolution() &&
         (a.origin() - b.origin()).cwiseAbs().maxCoeff() < 1e-6 * a.resolution();
}

/// What differs between two grids of the same place.
map::ScanChange difference(const map::OccupancyGrid& before, const map::OccupancyGrid& after) {
  map::ScanChange change;
  for (std::size_t n = 0; n < after.cell_count(); ++n) {
    if (before.at(n) == after.at(n)) continue;
    change.box.add(after.voxel(n));
    if (after.at(n) == map::Cell::occupied) change.occupied.push_back(after.voxel(n));
  }
  return change;
}

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

/// As if a scan had found the newly occupied voxels of a whole map.
NewVoxels as_new_voxels(const map::OccupancyGrid& before, const map::ScanChange& change, std::int64_t received_ns) {
  Scan scan;
  scan.received_ns = received_ns;
  for (const Index3& v : change.occupied) scan.points_W.push_back(before.center(v));
  return new_voxels(before, scan, std::numeric_limits<double>::infinity());
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
      air_(air) {}

MapWorker::~MapWorker() {
  while (const auto scan = channels_.scans.pop()) delete *scan;
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

void MapWorker::take_map(const MapMessage& message) {
  const auto begun = now_ns();
  // It was sent before the reader knew whose maps are used.
  if (writer_ && writer_->term == message.from.term && writer_->writer != message.from.writer)
    return reject(message, "it is of writer " + dds::text(message.from.writer) + ", that of " +
                               dds::text(writer_->writer) + " is in use");
  const double cap = settings_.max_mib * (1 << 20);
  auto grid = map::decode_octomap(message.data, message.resolution, message.binary, message.id,
                                  static_cast<std::size_t>(cap / kBytesPerVoxel));
  std::string wrong;
  if (!grid && grid.error().kind == map::MapError::Kind::too_large) {
    wrong = "too large: its snapshot would need more than " + std::to_string(static_cast<long>(settings_.max_mib)) +
            " MiB (map.max_mib)";
  } else if (!grid) {
    wrong = grid.error().message;
  } else if (!(message.resolution >= kFinest * (1 - 1e-9) && message.resolution <= kCoarsest * (1 + 1e-9))) {
    wrong = "resolution " + std::to_string(message.resolution) + " m, expected 0.02 to 0.2 m";
  } else if (world_ && std::abs(world_->grid.resolution() - message.resolution) > 1e-9) {
    wrong = "resolution " + std::to_string(message.resolution) + " m, the map in use has " +
            std::to_string(world_->grid.resolution()) + " m; restart the daemon to change it";
  } else if (std::ranges::find(grid->cells(), map::Cell::free) == grid->cells().end()) {
    wrong = "it has no free voxel";
  }
  record(recorder_, message, wrong.empty());
  if (!wrong.empty()) return reject(message, wrong);
  if (!message.transfer) {  // a mapper stays; who sends a map in parts is done with it
    writer_ = message.from;
    channels_.map_writer.write(*writer_);
  }

  const Index3 size = grid->size();
  const bool update = world_ && same_place(world_->grid, *grid);
  if (update) {
    const auto change = difference(world_->grid, *grid);
    if (!change.occupied.empty()) channels_.map_voxels.push(as_new_voxels(world_->grid, change, message.received_ns));
    live_.emplace(*grid);
    publish(plan::update_world(*world_, std::move(*grid), change.box, model_, parallel_), message.received_ns);
  } else {
    live_.emplace(*grid);
    if (!world_) publish_near(*grid, message.received_ns);  // what flies in another world is not cut short
    auto world = plan::build_world(std::move(*grid), model_, vehicle_, reach::Method::tight, std::nullopt, parallel_);
    if (air_) world = plan::with_air(*world, *air_, model_, parallel_);
    publish(std::move(world), message.received_ns);
    channels_.map_partial = false;
  }
  ++channels_.maps_accepted;
  tell(message, "");  // not before: its sender goes on as soon as it is in use
  spdlog::info("map accepted: {} x {} x {} voxels, world {} in {} ms", size.x(), size.y(), size.z(),
               update ? "updated" : "built", (now_ns() - begun) / 1'000'000);
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

bool MapWorker::take_scans() {
  const auto begun = now_ns();
  map::VoxelBox box;
  std::optional<std::int64_t> received_ns;
  while (const auto next = channels_.scans.pop()) {
    const std::unique_ptr<Scan> scan(*next);
    if (!live_ || !live_->grid().inside(live_->grid().index(scan->sensor_W))) {
      ++channels_.scans_rejected;  // no map yet, or the sensor is outside of it
      continue;
    }
    const auto change = live_->insert(scan->points_W, scan->sensor_W, settings_.sensor_range);
    if (!change.box.empty()) {
      box.add(change.box.low);
      box.add(change.box.high);
    }
    received_ns = scan->received_ns;
    ++channels_.scans_accepted;
  }
  if (!received_ns) return false;
  if (box.empty()) {
    channels_.map_ns.store(*received_ns);  // the snapshot says what the scan says
    return true;
  }
  publish(plan::update_world(*world_, live_->grid(), box, model_, parallel_), *received_ns);
  const Index3 extent = box.high - box.low + Index3::Ones();
  spdlog::debug("map updated in {} x {} x {} voxels in {} ms", extent.x(), extent.y(), extent.z(),
                (now_ns() - begun) / 1'000'000);
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
    scanned = take_scans();
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
    if (!below && channels.maps_accepted > 0)
      below = setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kBelowTheRest) == 0;
  }
}

}  // namespace backwash::daemon
