// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/types/geometry.hpp"
#include "core/types/mode.hpp"
#include "services/dds/status_members.hpp"

namespace backwash::ctl {

/// From now on SIGINT and SIGTERM end every wait of a station, so that its participant is deleted and the daemon knows
/// at once that its session has ended.
void end_waits_on_signals();
/// The signal that came, or 0.
int interrupted() noexcept;

/// Where the daemon is and who asks.
struct Options {
  int domain = 0;
  std::string interface = "lo", name_space = "backwash", station;
  std::string security;  ///< folder of credentials of DDS Security; empty: none
  double timeout_s = 5;
};

/// The folder itself, where its credentials are good or it is none. Throws StartError 78.
const std::string& judged(const std::string& folder);

/// The daemon's status, kept after its message.
struct StatusCopy {
  dds::Status said{};                                       ///< its texts are in `texts`, its lists are null
  std::shared_ptr<const std::deque<std::string>> texts;     ///< shared by copies
  std::vector<std::pair<std::string, double>> parameters;   ///< that the autopilot has told
  std::vector<std::pair<std::string, std::string>> advice;  ///< on those that are not good

  std::string text(char* dds::Status::*member) const { return said.*member; }
  /// Whether state and reason are these. What a daemon of another version may say besides is none of them.
  bool in(Mode mode) const noexcept { return mode_named(said.state) == mode; }
  bool because(Reason why) const noexcept { return reason_named(said.reason) == why; }
  /// Whether there is advice of this name: of a parameter, or dds::kAsking, dds::kArming.
  bool advises(std::string_view name) const noexcept {
    return std::ranges::any_of(advice, [&](const auto& each) { return each.first == name; });
  }
};

/// All that a message says.
StatusCopy copy_of(const dds::Status& status);

/// The autopilot and its firmware's version: "ardupilot 4.6.3".
inline std::string controller(const StatusCopy& s) {
  const std::string version = s.text(&dds::Status::autopilot_version);
  return s.said.autopilot + (version.empty() ? "" : " " + version);
}

/// An age or a delay of the status, s; −1 on the wire: nothing was measured for it yet.
inline std::optional<double> measured(double told) noexcept { return told < 0 ? std::nullopt : std::optional(told); }

/// One ground station: sends commands, waits for their acknowledgement and watches the status.
class Station {
 public:
  /// Throws StartError 78 for credentials that are not good, dds::Error for an interface that is none.
  /// `more`: topics outside of the name space that readers of this process have.
  explicit Station(const Options& options, const std::vector<std::string>& more = {});
  /// Ends the session if it has one. The middleware says only once that a writer is gone, and with DDS Security that
  /// may be lost: the next process would be refused until the lease of 2 s is over.
  ~Station();
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  struct Result {
    int result;  ///< ACK_… code
    std::string reason;
  };
  /// Sends a command and repeats it, with the same sequence number, until it is acknowledged; nothing if it never is.
  /// Refused at once where this station's own permissions do not let it command.
  /// `given_up` ends the wait early: asked 20 times a second.
  std::optional<Result> send(std::uint8_t verb, const Vec3& position = Vec3::Zero(), double yaw = 0,
                             const std::vector<Vec3>& waypoints = {}, const std::function<bool()>& given_up = {});
  /// Ends the session. What is sent next begins a new one.
  void release(const std::function<bool()>& given_up = {});
  /// For further readers of this process.
  const dds::Participant& participant() const noexcept { return participant_; }
  /// Whether this status knows of a later command than ours, whoever gave it.
  bool superseded(const StatusCopy& s) const noexcept {
    return s.said.session != session_ || s.said.sequence_number != sequence_;
  }
  /// The next status; nothing after the timeout.
  std::optional<StatusCopy> status(double timeout_s);
  /// Waits until `done` holds for a status; false after `timeout_s`. `failed` ends the wait early with false.
  bool wait(double timeout_s, const std::function<bool(const StatusCopy&)>& done,
            const std::function<bool(const StatusCopy&)>& failed);

 private:
  std::optional<Result> ask(const dds::Command& command, const std::function<bool()>& given_up);

  Options options_;
  std::uint64_t session_;
  std::uint32_t sequence_ = 0;
  bool holds_ = false;  ///< the session is ours, as far as we were told
  dds::Participant participant_;
  std::optional<dds::Writer<dds::Command>> commands_;  ///< from the first command on: an observer may have none
  dds::Reader<dds::Ack> acks_;
  dds::Reader<dds::Status> statuses_;
  dds::WaitSet waitset_;
};

}  // namespace backwash::ctl
