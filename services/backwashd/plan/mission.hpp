// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "services/backwashd/control/controlled.hpp"
#include "services/backwashd/plan/planned.hpp"

namespace backwash::daemon {

struct Channels;

/// What a station is told of its command: an ACK_… code of idl/backwash_msgs.idl and one line.
struct Answer {
  std::uint8_t result = 0;
  std::string reason;
};

/// What a command, or what has happened meanwhile, makes of the mission. The order goes to the control thread before
/// the job goes to the planner; where it cannot be handed over, nothing else of the decision may be, and the station is
/// told (run_mission).
struct Decision {
  std::optional<Answer> answer;
  std::optional<track::Order> order;
  std::optional<PlanJob> job;
  std::optional<adapt::AirOrder> air{};
};

/// What the other threads have said since the last call.
struct MissionInput {
  double now_s = 0;                                         ///< monotonic
  std::optional<ControlView> view;                          ///< newest, if there is a new one
  std::optional<std::shared_ptr<const plan::World>> world;  ///< newest, if there is a new one
  std::optional<Line> other_daemon;                         ///< newest, if there is a new one; "": there is none
  std::optional<Line> odometry_doubt;                       ///< the same, of what an OdometryCheck says
  std::span<const PlanOutcome> outcomes;
};

/// Decides on the ground stations' commands: who may command (one session lease at a time), what is possible now, and
/// what the control and planner threads are asked for. Pure: it has no clock and no channel of its own.
///
/// Every order has a number, and everything that is planned belongs to the order after which it was asked for: a STOP,
/// land, disable or hold thereby ends whatever was planned before it, wherever that is by then (docs/faults.md row 39).
class Mission {
 public:
  static constexpr const char* kToGo = "waypoints to go: ";  ///< with their number: a task
  static constexpr double kLease = 10.0;  ///< s after a station's last command until another may take over

  /// `vehicle`: whose gains and limits the autopilot's parameters have to be.
  explicit Mission(const Vehicle& vehicle) : vehicle_(vehicle) {}

  /// Takes what the other threads have said; a job, if the flight goes on by itself.
  Decision observe(const MissionInput& in);
  /// Answers one command and decides what it asks for. A repeated sequence number of a session is answered again, not
  /// done again (docs/faults.md row 28 and the session rules of the IDL). A session is its writer's: a writer that
  /// departs ends it, and no other one can go on with it (row 48). STOP is taken from everybody: of another session, of
  /// one that is over, with an old number, with anything else in it that is no number.
  Decision handle(const CommandMessage& command, double now_s);
  /// Holder of the lease, empty if none.
  std::string station(double now_s) const;
  const ControlView& view() const noexcept { return view_; }
  /// What became of the last task: "", "planning", "waypoints to go: N" of a route's more than one, or "refused: why".
  const std::string& task() const noexcept { return task_; }
  /// The newest command that was accepted; releases and orders about the air are none.
  const CommandId& accepted() const noexcept { return accepted_; }
  /// "", or why the vehicle could not take off where it is; judged once a second.
  const std::string& place() const noexcept { return place_; }

 private:
  /// A place to fly to, and the heading there if one was asked for.
  struct Goal {
    Vec3 position;
    std::optional<double> yaw;
  };
  std::optional<Answer> session(const CommandMessage& command, double now_s);
  Decision decide(const CommandMessage& command);
  Decision enable();
  Decision take_off(const CommandMessage& command);
  Decision go_to(const CommandMessage& command);
  Decision fly(std::deque<Goal> route);
  Decision follow(const CommandMessage& command);
  Decision hold();
  bool abandoned() const;
  Decision land();
  Decision stop(const CommandMessage& command);
  Decision ask_of_air(adapt::AirOrder order) const;
  Decision start(PlanJob::Kind kind, const Goal& goal = {});
  Decision order(track::Request request, std::string answer);
  std::optional<PlanJob> continue_route(double now_s);
  std::string judge_place() const;
  /// The control thread has not yet taken the newest order.
  bool order_under_way() const noexcept { return view_.epoch.order < orders_; }
  void end_lease();

  Vehicle vehicle_;
  CommandId accepted_;
  ControlView view_;
  std::string other_daemon_;  // in our namespace, "": none
  std::string odometry_doubt_;
  std::shared_ptr<const plan::World> world_;
  std::uint64_t orders_ = 0;
  track::Request last_request_ = track::Request::none;  // of the newest order
  std::optional<std::uint64_t> job_;                    // under way
  std::uint64_t last_job_ = 0;
  std::deque<Goal> route_;             // still to be reached; the first is the one flown to
  std::optional<std::uint64_t> held_;  // lapse of the hold that it was told in, which has not ended yet
  double judge_at_s_ = 0;
  double retry_at_s_ = 0;  // from rest on the way
  std::string task_, place_;
  struct Lease {
    WriterId writer{};
    std::string station;
    std::uint64_t session = 0;
    std::uint32_t sequence = 0;
    double until_s = 0;
    std::uint8_t verb = 0;  // of that sequence number
    Answer last;
  };
  std::optional<Lease> lease_;
  static constexpr std::size_t kEndedSessions = 64;
  std::deque<std::uint64_t> ended_;  // sessions that are over, newest last
};

/// Thread body: commands in, acknowledgements out through `answer`.
using SendAnswer = std::function<void(const CommandMessage&, const Answer&)>;
void run_mission(Channels& channels, Mission& mission, const SendAnswer& answer);

}  // namespace backwash::daemon
