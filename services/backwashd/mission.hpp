// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "services/backwashd/channels.hpp"

namespace backwash::daemon {

/// What a station is told of its command: an ACK_… code of idl/backwash_msgs.idl and one line.
struct Answer {
  std::uint8_t result = 0;
  std::string reason;
};

/// Decides on the ground stations' commands: who may command (one session lease at a time), what is possible now, and
/// what the control and planner threads are asked for.
class Mission {
 public:
  static constexpr double kLease = 10.0;  ///< s after a station's last command until another may take over

  explicit Mission(Channels& channels) : channels_(channels) {}

  /// Takes what the other threads have said since the last call.
  void refresh();
  /// Answers one command and starts what it asks for. A repeated sequence number of a session is answered again, not
  /// done again (faults.md row 28 and the session rules of the IDL).
  Answer handle(const CommandMessage& command, double now_s);
  /// Holder of the lease, empty if none.
  std::string station(double now_s) const;
  const ControlView& view() const noexcept { return view_; }

 private:
  Answer decide(const CommandMessage& command);
  Answer enable();
  Answer take_off(const CommandMessage& command);
  Answer go_to(const CommandMessage& command);
  void report(const std::string& task);
  /// A place to fly to, and the heading there if one was asked for.
  struct Goal {
    Vec3 position;
    std::optional<double> yaw;
  };
  Answer start(PlanJob::Kind kind, const Goal& goal = {});
  Answer follow(const CommandMessage& command);
  Answer stop();
  void continue_route();
  void judge_place(double now_s);

  Channels& channels_;
  ControlView view_;
  std::shared_ptr<const plan::World> world_;
  std::optional<std::uint64_t> job_;  // under way
  std::deque<Goal> route_;            // still to be reached; the first is the one flown to
  double judge_at_s_ = 0;
  double retry_at_s_ = 0;  // from rest on the way
  std::uint64_t last_job_ = 0;
  struct Lease {
    std::string station;
    std::uint64_t session = 0;
    std::uint32_t sequence = 0;
    double until_s = 0;
    Answer last;
  };
  std::optional<Lease> lease_;
};

/// Thread body: commands in, acknowledgements out through `answer`.
using SendAnswer = std::function<void(const CommandMessage&, const Answer&)>;
void run_mission(Channels& channels, Mission& mission, const SendAnswer& answer);

}  // namespace backwash::daemon
