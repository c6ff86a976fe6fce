// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/map/load_map.hpp"
#include "core/map/scan.hpp"
#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/lookout.hpp"
#include "services/backwashd/recorder.hpp"
#include "services/backwashd/window_keeper.hpp"

namespace backwash::daemon {

/// Turns maps and scans into immutable worlds (grid, distance, field, bounds, hover map). A map that cannot be read,
/// that has nothing free, another resolution than the one in use, or a snapshot above map.max_mib, is rejected whole
/// and counted, and the old world stays (docs/faults.md rows 10 to 12); so is one of another writer than the first good
/// one of its term (row 48). Scans that came meanwhile are taken in
/// together, and the world is updated where they changed something. Of a first map that is far larger than what is
/// around the vehicle, that part is made and handed out first; its place is waited for, up to 2 s. Where the flight has
/// learnt that its air is rougher the world is made anew with the factors, and handed out like a new map; so it is
/// after a reset of them. Where a mapper's window is declared, the world is made of it and of the last whole map
/// (WindowKeeper), and updated as by a scan (docs/faults.md row 55).
class MapWorker {
 public:
  /// A world is made anew once a factor is larger by this share than the one it was made with.
  static constexpr double kStep = 0.05;

  /// `air`: factors to begin with; none: the air is as modelled, and nothing is learnt of it.
  MapWorker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle,
            const MapSettings& settings, const std::optional<AirFactors>& air = {});
  ~MapWorker();
  MapWorker(const MapWorker&) = delete;
  MapWorker& operator=(const MapWorker&) = delete;

  /// Takes what has arrived; false if nothing had. A world in the making is given up when the daemon ends.
  bool step();

 private:
  void take_map(const MapMessage& message);
  std::string wrong(const MapMessage& message, const tl::expected<map::OccupancyGrid, map::MapError>& grid) const;
  void use(const MapMessage& message, map::OccupancyGrid grid);
  bool take_news();
  /// Takes it into the live grid, with the box of what changed. False: it is refused.
  bool take_scan(const Scan& scan, map::VoxelBox& box);
  /// The same; the control thread is told of new occupied voxels. What is far is let go, with a box of its own.
  void take_cloud(const WindowCloud& cloud, map::VoxelBox& said, map::VoxelBox& gone);
  bool move_world(bool anew, std::int64_t seen_ns);
  void tell_let_go(const WindowKeeper::Changes& changes);
  bool take_air();
  void reject(const MapMessage& message, const std::string& why);
  /// The map reader, of a map that came in parts; `why` it was not accepted, or empty.
  void tell(const MapMessage& message, const std::string& why);
  void await_vehicle();
  void publish_near(const map::OccupancyGrid& grid, std::int64_t received_ns);
  std::shared_ptr<const plan::World> made(map::OccupancyGrid grid) const;
  void publish(std::shared_ptr<const plan::World> world, std::int64_t received_ns);

  Channels& channels_;
  Recorder& recorder_;
  Model model_;
  Vehicle vehicle_;
  MapSettings settings_;
  Parallel parallel_;
  std::optional<AirFactors> air_;  // as the control thread last said
  std::uint64_t air_falls_ = 0;
  std::optional<MapWriter> writer_;  // of the maps in use
  std::optional<map::LiveMap> live_;
  std::optional<WindowKeeper> window_;  // of a mapper's, where one is declared
  std::optional<Vec3> vehicle_W_;       // where the vehicle was last
  std::shared_ptr<const plan::World> world_;
};

/// Thread body.
void run_map_worker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle,
                    const MapSettings& settings, const std::optional<AirFactors>& air = {});

}  // namespace backwash::daemon
