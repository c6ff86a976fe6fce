// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>

#include "core/map/load_map.hpp"
#include "core/map/scan/scan.hpp"
#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"
#include "services/backwashd/map/mapped.hpp"
#include "services/backwashd/map/window_keeper.hpp"
#include "services/backwashd/plan/lookout.hpp"
#include "services/backwashd/record/recorder.hpp"

namespace backwash::daemon {

struct Channels;

/// Turns maps and scans into immutable worlds (grid, distance, field, bounds, hover map). What they say is not free any
/// more goes to the control thread before a world is made of it, by place, whatever extent a map has; what comes while
/// one is made does so too, and is in the next. A snapshot holds all that is older than it says, but what a newer map
/// has taken back: a map does not take back what scans have found, scans do (docs/faults.md row 14). A map that cannot
/// be read, that has nothing free, another resolution than the one in use, or a snapshot above map.max_mib, is rejected
/// whole and counted, and the old world stays (docs/faults.md rows 10 to 12); so is one of another writer than the
/// first good one of its term (row 48). Scans that came meanwhile are taken in together, and the world is updated where
/// they changed something. Of a first map that is far larger than what is around the vehicle, that part is made and
/// handed out first; its place is waited for, up to 2 s. Where the flight has learnt that its air is rougher the world
/// is made anew with the factors, and handed out like a new map; so it is after a reset of them. Where a mapper's
/// window is declared, the world is made of it and of the last whole map (WindowKeeper), and updated as by a scan
/// (docs/faults.md row 55).
class MapWorker {
 public:
  /// `air`: factors to begin with; none: the air is as modelled, and nothing is learnt of it.
  MapWorker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle,
            const MapSettings& settings, const std::optional<AirFactors>& air = {});
  ~MapWorker();
  MapWorker(const MapWorker&) = delete;
  MapWorker& operator=(const MapWorker&) = delete;

  /// Takes what has arrived; false if nothing had. A world in the making is given up when the daemon ends.
  bool step();

 private:
  using World = std::shared_ptr<const plan::World>;
  /// A map that was accepted and is not used yet: its message, but for the bytes.
  struct Accepted {
    MapMessage message;
    map::OccupancyGrid grid;
  };
  bool take_map();
  std::string wrong(const MapMessage& message, const tl::expected<map::OccupancyGrid, map::MapError>& grid) const;
  std::optional<map::OccupancyGrid> accepted(const MapMessage& message);
  void use(const MapMessage& message, map::OccupancyGrid grid);
  /// From now on this is what is known, and what scans have found where both grids are.
  void look_at(map::OccupancyGrid grid);
  bool take_news();
  /// Takes scans and clouds into the live grid. False: none had come.
  bool hear();
  /// What the newest world does not hold; the control thread is told of it.
  /// What a map says, to be held against all that is made in a world of `world_ns` too: that lacks the map.
  void tell_map(const map::OccupancyGrid& grid, std::int64_t received_ns, std::int64_t world_ns);
  void note(const map::ScanChange& change, map::VoxelBox& box, std::int64_t received_ns);
  void take_scan(const Scan& scan);
  void take_cloud(const WindowCloud& cloud);
  bool move_world(bool anew);
  void tell_let_go(const WindowKeeper::Changes& changes);
  bool take_air();
  void reject(const MapMessage& message, const std::string& why);
  /// The map reader, of a map that came in parts; `why` it was not accepted, or empty.
  void tell(const MapMessage& message, const std::string& why);
  void await_vehicle();
  void tell_control(const NewVoxels& voxels);
  /// Made on a thread of its own, while this one hears what comes.
  World made(const std::function<World()>& make);
  World built(map::OccupancyGrid grid);
  void publish_near(const map::OccupancyGrid& grid, std::int64_t seen_ns);
  void publish(World world, std::int64_t seen_ns);

  Channels& channels_;
  Recorder& recorder_;
  Model model_;
  Vehicle vehicle_;
  MapSettings settings_;
  Parallel parallel_;
  std::optional<AirFactors> air_;  // as the control thread last said
  std::uint64_t air_falls_ = 0;
  std::optional<MapWriter> writer_;     // of the maps in use
  std::optional<Accepted> next_;        // the newest map, while a world is made
  std::optional<map::LiveMap> live_;    // all that was heard
  map::VoxelBox said_, gone_;           // of it, what the newest world does not hold: by scans and clouds, and let go
  std::int64_t heard_ns_ = INT64_MIN;   // reception of the newest in it
  std::uint32_t closures_ = 0;          // of the newest scan
  std::vector<Index3> noted_;           // of the newest world's grid: what is heard now and is not free in it
  std::int64_t noted_ns_ = 0;           // the newest of that
  bool below_ = false;                  // what is made now has a low priority
  std::optional<WindowKeeper> window_;  // of a mapper's, where one is declared
  std::optional<Vec3> vehicle_W_;       // where the vehicle was last
  World world_;
};

/// Thread body.
void run_map_worker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle,
                    const MapSettings& settings, const std::optional<AirFactors>& air = {});

}  // namespace backwash::daemon
