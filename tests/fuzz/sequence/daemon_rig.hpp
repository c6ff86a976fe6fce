// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/in/localization.hpp"
#include "services/backwashd/map/map_worker.hpp"
#include "services/backwashd/map/scan_placement.hpp"
#include "services/backwashd/plan/mission.hpp"
#include "services/backwashd/plan/planner_worker.hpp"
#include "services/bench/emulation/firmware.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"
#include "tests/fuzz/sequence/event.hpp"
#include "tests/fuzz/sequence/watch.hpp"

namespace backwash::fuzz {

/// What broke, and when.
struct Violation {
  int tick = 0;
  std::string what;
};

/// An emulated real firmware.
using MakeAutopilot = std::unique_ptr<bench::Autopilot>(const bench::Site& site);

/// The daemon without its threads and sockets: control loop and link in lockstep, mission, planner, map worker and
/// localization in one thread, and what a Watch sees of them. While the planner waits ticks pass, while it computes
/// none do; `late_segment` is a plan that took its time.
class DaemonRig {
 public:
  /// Flown by the rig's own autopilot, or as `make` has it: make_arducopter() or make_px4().
  DaemonRig(const std::vector<Event>& events, daemon::test::Medium medium, MakeAutopilot* make = nullptr);
  ~DaemonRig();

  /// Runs the events for so many ticks, or until something is violated.
  std::optional<Violation> run(int ticks);
  /// The log of the last start as a file of the daemon holds it: of each second what the control thread recorded, then
  /// what the others did. Times are the rig's.
  log::RawLog logged();
  /// That log, replayed: what differs, or nothing.
  std::optional<std::string> replayed();
  /// Where the vehicle was at each tick, of all starts, by the log's clock.
  const std::vector<std::pair<std::int64_t, Vec3>>& truth() const { return truth_; }
  int ticks() const { return tick_; }
  int plans() const { return plans_; }
  /// From now on nothing but an operator disturbs the flight: each step of the set-point is judged, too.
  void operated_only() { watch_.operated_only(daemon::test::vehicle_5in().limits.a_max); }
  /// Ticks in which the vehicle was outside its set.
  std::uint64_t outside() const { return lock_.view().shown.samples_outside; }
  /// Ticks spent in each mode.
  const std::array<long, kModes>& spent() const { return spent_; }

 private:
  /// What are threads in the daemon, and live as long as one start of it.
  struct Threads {
    Threads(DaemonRig& rig, daemon::Channels& channels);
    daemon::Recorder recorder;
    daemon::MapSettings settings;
    daemon::MapWorker map;
    daemon::Mission mission{daemon::test::vehicle_5in()};
    daemon::Localization localization{config::Daemon{}, daemon::test::vehicle_5in().estimation.position};
    daemon::PlannerWorker planner;
    std::shared_ptr<const plan::World> known;  // newest that the DDS reader has
  };
  void fly(MakeAutopilot& make);
  void start();
  void advance();
  void apply(const Event& event);
  void apply_to_line(const Event& event);
  void apply_to_map(const Event& event);
  void operate(const Event& event);
  void send(std::uint8_t verb, const Event& event);
  void run_mission();
  bool carry_out(const daemon::Decision& decision);
  void record(const daemon::CommandMessage& command, const daemon::Answer& answer);
  void delay_segments();
  void look();
  void hear_autopilot();
  void read_switch();
  void offer_map(const map::OccupancyGrid& grid, std::vector<std::int8_t> data);
  void scan_box(const Vec3& at);
  std::optional<track::OdometrySample> read(const track::OdometrySample& sample);
  void spoil_bytes(std::vector<std::uint8_t>& bytes);
  const Event* lasting(Event::Kind kind) const;

  std::vector<Event> events_;
  std::size_t next_ = 0;
  int tick_ = 0, missed_ = 0, plans_ = 0;
  daemon::test::Lockstep lock_;
  Watch watch_;
  std::string log_;
  std::unique_ptr<Threads> threads_;
  std::optional<Violation> violation_;
  std::map<Event::Kind, Event> lasting_;         // what goes on: the tick it ends in is `tick` + n
  std::optional<track::OdometrySample> frozen_;  // of vio_freeze
  std::int64_t repeated_ns_ = 0;
  Vec3 drifted_ = Vec3::Zero();
  std::optional<Vec3> autopilot_at_;  // where it says it is, in its own frame
  track::RigidShift closure_;         // of the VIO, which reports in its own frame
  daemon::CommandMessage last_command_;
  std::uint32_t sequence_ = 0;
  std::uint64_t session_ = 1;
  bool restarts_ = false, with_maps_ = false, with_switch_ = false;
  std::unique_ptr<const track::AcceptedSegment> late_;
  std::array<long, kModes> spent_{};
  std::vector<std::pair<std::int64_t, std::int64_t>> clock_;  // CLOCK_MONOTONIC, and the rig's time then
  std::vector<std::pair<std::int64_t, Vec3>> truth_;
};

}  // namespace backwash::fuzz
