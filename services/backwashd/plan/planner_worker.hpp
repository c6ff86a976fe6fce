// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/plan/replan.hpp"
#include "services/backwashd/control/flying.hpp"
#include "services/backwashd/map/mapped.hpp"
#include "services/backwashd/plan/plan_front.hpp"
#include "services/backwashd/plan/planned.hpp"
#include "services/backwashd/record/recorder.hpp"

namespace backwash::daemon {

struct Channels;

/// Called with each segment that the control thread accepted.
using SegmentAccepted = std::function<void(const track::AcceptedSegment&)>;

/// Plans what the mission asks for, verifies the whole swept tube from the state estimated now, and offers the segment
/// to the control thread, again from a fresh state if that has moved on meanwhile. Between jobs it keeps what flies
/// right in each new world and after loop closures. A job is given up as soon as a later order or another event has
/// ended what it was asked for in (PlanFront).
///
/// A goal that is clear in the map is flown to by one whole plan. One that the map does not know yet, or to which it
/// does not know the way, is flown to with a receding horizon (plan::replan): each new world extends the flight from a
/// command a little ahead of now, and every segment ends at rest in what is known. In the same way a flight whose way
/// is closed by something new goes on around it, also while it already brakes for it.
class PlannerWorker {
 public:
  /// `pause`: lets some time pass while the control thread works, 1 ms or so. `timing`: of the odometry.
  PlannerWorker(Channels& channels, Recorder& recorder, SegmentAccepted accepted, std::function<void()> pause,
                const OdometryTiming& timing = {})
      : channels_(channels),
        recorder_(recorder),
        accepted_(std::move(accepted)),
        pause_(std::move(pause)),
        lead_(timing.lead()) {}

  /// One job of the mission, or, if there is none, watch(). False: there was none.
  bool step();

 private:
  /// The goal of what flies: followed as the map changes.
  struct Pursuit {
    Vec3 goal_W;
    std::optional<double> yaw;      ///< heading at the goal, rad
    std::int64_t again_ns = 0;      ///< when it is looked at again without a new world
    std::size_t lead = kLeastLead;  ///< commands between now and the branch of what continues the flight
  };
  static constexpr std::size_t kLeastLead = 20, kMostLead = 100;
  static constexpr const char* kEnded = "a later command, or what happened meanwhile, ended it";

  std::optional<std::string> perform(const PlanJob& job);
  std::optional<std::string> take_off(const PlanJob& job);
  std::optional<std::string> go_to(const PlanJob& job);
  std::optional<std::string> explore(const PlanJob& job);
  std::optional<std::string> brake();
  bool brake_later();
  std::optional<std::string> fly(std::vector<Setpoint> commands, const plan::PlanMetrics& metrics,
                                 std::optional<double> z_safe, std::uint32_t closures, bool lifts = false);
  std::vector<Setpoint> rise(const Vec3& from, const Vec3& to) const;
  std::optional<std::string> lift_off(std::uint64_t lift);
  plan::Replan onward(const plan::World& world, const plan::Route& route, std::size_t now, std::size_t branch,
                      const Vec3& goal_W, double apart_m) const;

  void watch();
  bool pursues();
  void pursue();
  void block(const std::string& why);
  std::string choose_stop();
  std::optional<Flying> rest_from(std::size_t branch);
  std::string grown_air() const;
  void verify_again();
  void keep();
  std::optional<std::string> rectify();
  std::vector<Setpoint> moved_by_closure(std::size_t branch) const;

  void refresh();
  bool current();
  bool too_calm() const;
  Flying continued(std::size_t branch, std::vector<Setpoint> commands);
  bool offer(Flying next);

  Channels& channels_;
  Recorder& recorder_;
  SegmentAccepted accepted_;
  std::function<void()> pause_;
  std::size_t lead_;  // commands at rest before a segment moves
  ControlView view_;
  std::shared_ptr<const plan::World> world_;
  std::int64_t seen_ns_ = 0;  // of that world
  bool new_world_ = false;
  PlanFront front_;
  std::uint64_t blocked_ = 0;
  std::optional<Flying> flying_;
  AirFactors air_ = kModelledAir;  // in which that was last found clear
  std::optional<Pursuit> pursuit_;
};

/// Thread body.
void run_planner(Channels& channels, Recorder& recorder, const SegmentAccepted& accepted, const OdometryTiming& timing);

}  // namespace backwash::daemon
