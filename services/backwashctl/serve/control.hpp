// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>

#include "services/backwashctl/serve/gate.hpp"
#include "services/backwashctl/station.hpp"

namespace backwash::ctl {

/// Three finite numbers, m, map.
std::optional<Vec3> point_of(const nlohmann::json& said);

/// Which page commands, and what became of its commands. Pages stand to this process as stations to the daemon: the
/// first command takes the session, which lasts until 10 s after the page's last command or until the page has been
/// gone for 2 s; STOP is taken from every page. To the daemon all of them are one station.
///
/// Pages and commands come from any thread; run() alone speaks to the daemon.
class Control {
 public:
  static constexpr double kLease_s = 10, kGone_s = 2;
  static constexpr std::size_t kPages = 16;  ///< of those with the token, and as many without

  explicit Control(Station& station) : station_(station) {}

  /// A page, by the name that it drew for itself, listens. False: there is one of that name, or there are too many.
  bool enter(const std::string& page);
  void leave(const std::string& page);
  /// A page that has the token is about to listen: pages without it cannot take its place. False: too many are.
  bool admit(const std::string& page);
  bool admitted(const std::string& page) const;

  /// Takes a command of a page: {page, verb, goal, stops}. A goal is refused if a STOP has come since the page was told
  /// of that many. What becomes of it is in told().
  Reply command(const nlohmann::json& said, const std::string& remote);
  /// {session, command} as a page is told.
  nlohmann::json told(const std::string& page) const;

  /// Sends what pages command until stopped or interrupted. A STOP is repeated until it is acknowledged, and cuts off
  /// the wait for any other answer.
  void run(const std::stop_token& stopped);

 private:
  using Clock = std::chrono::steady_clock;
  struct Verb {
    const char* name;
    std::uint8_t code;
    int urgency;  // what is more urgent cuts off the wait for an answer
  };
  static const Verb kVerbs[];
  struct Wish {
    const Verb* verb;
    Vec3 goal_W;
    std::uint64_t number;
    Clock::time_point since;
  };
  struct Holder {
    std::string page, remote;
    Clock::time_point until;
  };
  struct Listener {
    bool admitted = false;
    std::optional<Clock::time_point> left;  // when, of one that is not here
  };
  void forget(Clock::time_point now);
  bool full(bool admitted) const;
  bool gone(const std::string& page, Clock::time_point now) const;
  bool held_by_another(const std::string& page, Clock::time_point now) const;
  void let_go();
  void carry_out(const Wish& wish);
  bool cut_off(int urgency) const;
  void say(const Wish& wish, const std::string& state, const std::string& reason);

  Station& station_;
  mutable std::mutex mutex_;
  std::condition_variable wished_;
  std::map<std::string, Listener> pages_;
  std::optional<Holder> holder_;
  std::optional<Wish> wish_;               // the next one
  std::uint64_t numbers_ = 0, stops_ = 0;  // of commands, and of STOPs among them
  Clock::time_point ours_until_{};         // the daemon may hold its session for us until then
  nlohmann::json command_;                 // the newest, and what became of it
};

}  // namespace backwash::ctl
