// SPDX-License-Identifier: BSD-3-Clause
// The lines of a session's script.
#include <fstream>
#include <iostream>

#include "tests/autopilots/session.hpp"

namespace backwash::autopilots {

/// Begins the next line of the script when the last is done.
bool Session::advance() {
  if (busy_) {
    if (done_()) {
      busy_ = false;
    } else if (t_ > until_) {
      std::cerr << "at " << t_ << " s: waited in vain: " << line_ << "\n";
      row("note", "waited in vain: " + line_, {});
      busy_ = false;
      return !must_;
    } else {
      return true;
    }
  }
  if (script_.empty()) return true;
  line_ = script_.front();
  script_.pop_front();
  row("note", line_, {});
  std::istringstream in(line_);
  begin(in);
  return true;
}

void Session::wait(std::function<bool()> done, double at_most, bool must) {
  busy_ = true;
  must_ = must;
  done_ = std::move(done);
  until_ = t_ + at_most;
}

void Session::begin(std::istringstream& in) {
  std::string verb, word;
  in >> verb;
  const auto number = [&] {
    double v = 0;
    in >> v;
    return v;
  };
  if (verb == "sleep") {
    const double end = t_ + number();
    wait([this, end] { return t_ >= end; }, 1e9);
  } else if (verb == "await") {
    await(in);
  } else if (turn(verb, in)) {
    return;
  } else if (verb == "here") {  // the set-point is where the vehicle is
    setpoint_ = target_ = now_.p_E;
    yaw_ = heading_ned();
  } else if (verb == "move") {  // by x y z (east north up, m), at a speed, m/s
    const double x = number(), y = number(), z = number();
    target_ = target_ + Vec3(x, y, z);
    speed_ = number();
  } else if (verb == "command") {
    std::array<float, 7> p{};
    const auto id = static_cast<std::uint16_t>(number());
    for (float& v : p) v = float(number());
    acks_.erase(id);
    peer_.send(mavlink::CommandLong{p[0], p[1], p[2], p[3], p[4], p[5], p[6], id, kSystem, kFlightController, 0});
  } else if (verb == "retry") {  // seconds, then a command: every second until it is accepted
    const double at_most = number();
    const auto id = static_cast<std::uint16_t>(number());
    mavlink::CommandLong m{0, 0, 0, 0, 0, 0, 0, id, kSystem, kFlightController, 0};
    m.param1 = float(number());
    m.param2 = float(number());
    m.param3 = float(number());
    acks_.erase(id);
    wait(
        [this, m, id] {
          if (acks_.contains(id) && acks_[id] == 0) return true;
          if (every("retry", 1)) peer_.send(m);
          return false;
        },
        at_most);
  } else if (verb == "origin") {
    const auto lat = std::int32_t(number() * 1e7), lon = std::int32_t(number() * 1e7),
               alt = std::int32_t(number() * 1e3);
    peer_.send(mavlink::SetGpsGlobalOrigin{lat, lon, alt, kSystem, 0});
  } else if (verb == "read" || verb == "set") {
    parameter(verb == "set", in);
  } else if (verb == "signal") {
    in >> word;
    if (o_.stopped) o_.stopped(word == "stop");
  } else {
    throw std::runtime_error("no such verb: " + line_);
  }
}

/// What goes on until it is turned off: VERB on|off.
bool Session::turn(const std::string& verb, std::istringstream& in) {
  const std::map<std::string_view, bool*> all{
      {"odometry", &odometry_}, {"stream", &streaming_}, {"station", &watched_}, {"sticks", &sticks_}};
  const auto found = all.find(verb);
  if (found == all.end()) return false;
  std::string word;
  in >> word;
  *found->second = word == "on";
  return true;
}

void Session::parameter(bool set, std::istringstream& in) {
  std::string name, type;
  double value = 0;
  in >> name;
  std::array<char, 16> id{};
  std::ranges::copy(name.substr(0, 16), id.begin());
  parameters_.erase(name);
  if (set) {
    in >> value >> type;
    const bool whole = o_.px4 && type == "int";
    peer_.send(mavlink::ParamSet{whole ? std::bit_cast<float>(std::int32_t(value)) : float(value), kSystem,
                                 kFlightController, id, whole ? kInt32 : kReal32});
  } else {
    peer_.send(mavlink::ParamRequestRead{-1, kSystem, kFlightController, id});
  }
  wait([this, name] { return parameters_.contains(name); }, 2, false);
}

void Session::await(std::istringstream& in) {
  std::string what;
  double a = 0, at_most = 10;
  in >> what;
  if (what == "heartbeat") return in >> at_most, wait([this] { return heard_; }, at_most);
  if (what == "truth") return in >> at_most, wait([this] { return have_truth_; }, at_most);
  in >> a >> at_most;
  if (what == "ack") return wait([this, a] { return acks_.contains(std::uint16_t(a)); }, at_most);
  if (what == "accepted")
    return wait([this, id = std::uint16_t(a)] { return acks_.contains(id) && acks_[id] == 0; }, at_most);
  if (what == "landed") return wait([this, a] { return landed_ == a; }, at_most);
  if (what == "armed") return wait([this, a] { return armed_ == (a != 0); }, at_most);
  if (what == "mode") return wait([this, a] { return mode_ == std::uint32_t(a); }, at_most);
  if (what == "height") return wait([this, a] { return now_.p_E.z() > a; }, at_most);
  if (what == "rest") return wait([this, a] { return now_.v_E.norm() < a; }, at_most);
  throw std::runtime_error("nothing to wait for: " + line_);
}

}  // namespace backwash::autopilots
