// SPDX-License-Identifier: BSD-3-Clause
#include "tests/autopilots/truth.hpp"

#include <sys/socket.h>
#include <sys/un.h>

#include <cmath>
#include <map>
#include <sstream>
#include <vector>

#include "firmware_bridge/mavlink/frames.hpp"
#include "services/backwashd/channels.hpp"
#include "tests/autopilots/device.hpp"

namespace backwash::autopilots {
namespace {

constexpr double kMetresPerStep = 0.011131884502145034;  // of 1e-7 degrees of latitude
constexpr double kHalfStep = 0.0056;                     // m: half a step of the position, horizontal or vertical

class ArduPilotTruth : public TruthSource {
 public:
  explicit ArduPilotTruth(const std::string& device) : peer_(open_line(device), 254, 190) { ask(); }

  std::optional<Truth> newest() override {
    std::optional<Truth> last;
    peer_.poll([&](const mavlink::Sender&, const auto& m) {
      if constexpr (std::is_same_v<std::decay_t<decltype(m)>, mavlink::SimState>) last = take(m);
    });
    if (!last && daemon::now_ns() - asked_ns_ > 1'000'000'000) ask();
    return last;
  }

 private:
  void ask() {  // SET_MESSAGE_INTERVAL, again until the first comes
    asked_ns_ = daemon::now_ns();
    peer_.send(mavlink::CommandLong{mavlink::SimState::kId, 10'000, 0, 0, 0, 0, 0, 511, 1, 1, 0});
  }

  Truth take(const mavlink::SimState& m) {
    asked_ns_ = daemon::now_ns();
    Truth t;
    t.at_ns = daemon::now_ns();
    t.v_E = mavlink::swap_ned({m.vn, m.ve, m.vd});
    t.q_EB = mavlink::swap_ned_frd(Eigen::Quaterniond(m.q1, m.q2, m.q3, m.q4).normalized());
    t.omega_B = mavlink::swap_frd({m.xgyro, m.ygyro, m.zgyro});
    if (!first_) {
      first_ = m;
      last_ = t;
    }
    const double north = (m.lat_int - first_->lat_int) * kMetresPerStep;
    const double east = (m.lon_int - first_->lon_int) * kMetresPerStep * std::cos(first_->lat_int * 1e-7 * kDegree);
    const Vec3 step(east, north, static_cast<double>(m.alt) - static_cast<double>(first_->alt));
    const double dt = static_cast<double>(t.at_ns - last_.at_ns) * 1e-9;
    const Vec3 p = last_.p_E + dt / 2 * (last_.v_E + t.v_E);
    t.p_E = p.cwiseMax(step - Vec3::Constant(kHalfStep)).cwiseMin(step + Vec3::Constant(kHalfStep));
    return last_ = t;
  }

  Peer peer_;
  std::int64_t asked_ns_ = 0;
  std::optional<mavlink::SimState> first_;
  Truth last_;
};

/// What PX4's command `listener` says of a topic: its fields by name.
using Sample = std::map<std::string, std::vector<double>, std::less<>>;

/// Lines "name: value", lists in brackets, remarks in parentheses behind.
Sample parse_sample(const std::string& text) {
  Sample sample;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto begin = line.find_first_not_of(" \t"), colon = line.find(": ");
    if (colon == line.npos) continue;
    std::string values = line.substr(colon + 2);
    if (const auto remark = values.find(" ("); remark != values.npos) values.resize(remark);
    for (char& c : values)
      if (c == '[' || c == ']' || c == ',') c = ' ';
    std::istringstream in(values);
    auto& into = sample[line.substr(begin, colon - begin)];
    for (double v; in >> v;) into.push_back(v);
  }
  return sample;
}

/// Asks PX4's shell, as its own clients do: the command, a zero (no terminal); the answer ends with the connection.
Sample ask_px4(const std::string& socket_path, const std::string& topic) {
  firmware_bridge::FileDescriptor fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un there{};
  there.sun_family = AF_UNIX;
  std::copy_n(socket_path.begin(), std::min(socket_path.size(), sizeof there.sun_path - 1), there.sun_path);
  const std::string command = "listener " + topic + '\0';
  const timeval patience{5, 0};
  ::setsockopt(fd.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&there), sizeof there) != 0 ||
      ::send(fd.get(), command.data(), command.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(command.size()))
    throw std::runtime_error(socket_path + ": PX4 does not answer");
  std::string text;
  std::array<char, 4096> bytes;
  for (ssize_t n; (n = ::recv(fd.get(), bytes.data(), bytes.size(), 0)) > 0;)
    text.append(bytes.data(), static_cast<std::size_t>(n));
  return parse_sample(text);
}

class Px4Truth : public TruthSource {
 public:
  explicit Px4Truth(std::string socket_path) : socket_path_(std::move(socket_path)) {}

  std::optional<Truth> newest() override {
    if (daemon::now_ns() < due_ns_) return std::nullopt;
    due_ns_ = std::max(due_ns_ + 10'000'000, daemon::now_ns());
    Sample at = ask_px4(socket_path_, "vehicle_attitude_groundtruth");
    Sample p = ask_px4(socket_path_, "vehicle_local_position_groundtruth");
    if (at["q"].size() != 4) return std::nullopt;
    for (const char* key : {"timestamp_sample", "x", "y", "z", "vx", "vy", "vz"})
      if (p[key].size() != 1) return std::nullopt;
    Truth t;
    t.at_ns = static_cast<std::int64_t>(p["timestamp_sample"][0]) * 1000;  // PX4's clock on Linux is CLOCK_MONOTONIC
    t.p_E = mavlink::swap_ned({p["x"][0], p["y"][0], p["z"][0]});
    if (!first_) first_ = t.p_E;
    t.p_E -= *first_;
    t.v_E = mavlink::swap_ned({p["vx"][0], p["vy"][0], p["vz"][0]});
    t.q_EB = mavlink::swap_ned_frd(Eigen::Quaterniond(at["q"][0], at["q"][1], at["q"][2], at["q"][3]).normalized());
    if (t.at_ns == last_ns_) return std::nullopt;
    last_ns_ = t.at_ns;
    return t;
  }

 private:
  std::string socket_path_;
  std::int64_t due_ns_ = 0, last_ns_ = 0;
  std::optional<Vec3> first_;
};

}  // namespace

std::unique_ptr<TruthSource> truth_source(const std::string& where) {
  if (where.starts_with('/')) return std::make_unique<Px4Truth>(where);
  return std::make_unique<ArduPilotTruth>(where);
}

}  // namespace backwash::autopilots
