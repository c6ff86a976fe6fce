// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <ostream>
#include <random>
#include <sstream>
#include <string>

#include "tests/autopilots/peer.hpp"
#include "tests/autopilots/truth.hpp"

namespace backwash::autopilots {

inline constexpr std::uint8_t kSystem = 1, kFlightController = 1;  ///< the autopilot's addresses
inline constexpr std::uint8_t kInt32 = 6, kReal32 = 9;             ///< MAV_PARAM_TYPE

/// Plays a script against an autopilot, real or emulated, without the daemon: its own companion computer with odometry
/// made of the truth. Writes what passed on the line, and the truth, as a trace. README.md has verbs and columns.
class Session {
 public:
  struct Options {
    std::filesystem::path script;
    double noise = 0.001;               ///< m, of the odometry's position
    bool px4 = false;                   ///< integer parameters bytewise
    std::function<void(bool)> stopped;  ///< `signal stop` and `signal cont`: the autopilot stands still
  };
  /// Throws std::runtime_error when the script cannot be read. The trace must outlive it.
  Session(Line line, const Options& options, std::ostream& trace);

  /// To be called each millisecond, with the truth that is new. False: a wait of the script has failed. Throws
  /// std::runtime_error for a line that is no verb.
  bool step(std::int64_t now_ns, const std::optional<Truth>& truth);
  bool done() const { return script_.empty() && !busy_; }
  /// The last rows: counts and rates of the messages.
  void finish();

 private:
  void read(const std::filesystem::path& path);
  void row(const char* who, const std::string& what, std::initializer_list<double> values);
  bool every(const char* what, double period);

  template <class Message>
  void on(const Message& m) {
    ++counts_[Message::kName];
    take(m);
  }
  template <class Other>
  void take(const Other&) {}
  void take(const mavlink::Heartbeat& m);
  void take(const mavlink::ExtendedSysState& m);
  void take(const mavlink::CommandAck& m);
  void take(const mavlink::Statustext& m);
  void take(const mavlink::ParamValue& m);
  void take(const mavlink::LocalPositionNed& m);
  void take(const mavlink::EstimatorStatus& m);
  void take(const mavlink::Timesync& m);

  void forward(const Truth& truth);
  void stream();
  double heading_ned() const;
  bool advance();
  void wait(std::function<bool()> done, double at_most, bool must = true);
  void begin(std::istringstream& in);
  bool turn(const std::string& verb, std::istringstream& in);
  void parameter(bool set, std::istringstream& in);
  void await(std::istringstream& in);

  Options o_;
  Peer peer_, station_;  // the companion, and the ground station at the same line
  std::ostream& trace_;
  std::deque<std::string> script_;
  std::string line_;
  std::function<bool()> done_;
  bool busy_ = false, must_ = true;
  double until_ = 0, t_ = 0;
  std::int64_t now_ns_ = 0, begun_ns_ = 0;
  long ms_ = 0;
  bool odometry_ = false, streaming_ = false, watched_ = false, sticks_ = false, have_truth_ = false, heard_ = false,
       armed_ = false;
  int landed_ = -1;
  std::uint32_t mode_ = 0;
  Truth now_;
  Vec3 setpoint_ = Vec3::Zero(), target_ = Vec3::Zero();
  double speed_ = 0, yaw_ = 0;
  std::mt19937 random_{1};
  std::map<std::string, double> last_, parameters_;
  std::map<std::uint16_t, std::uint8_t> acks_;
  std::map<std::string_view, long> counts_;
};

}  // namespace backwash::autopilots
