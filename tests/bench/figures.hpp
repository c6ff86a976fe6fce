// SPDX-License-Identifier: BSD-3-Clause
// Figures that are read off a trace, recorded or the profile's own, by the same code; a stated tolerance each.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/bench/playing.hpp"

namespace backwash::autopilots {

using Figure = std::function<std::optional<double>(const Trace&)>;

struct Pair {
  const Trace &real, &own;
};

/// The figure of both, one beside the other; the profile's may differ by `tolerance`.
inline void compare(const Pair& pair, const char* name, double tolerance, const Figure& figure) {
  const auto real = figure(pair.real), own = figure(pair.own);
  ASSERT_TRUE(real) << name << " is not in the recorded trace";
  ASSERT_TRUE(own) << name << " is not in the profile's trace";
  std::printf("| %s | %.3f | %.3f | ±%.3f |\n", name, *real, *own, tolerance);
  EXPECT_NEAR(*real, *own, tolerance) << name;
}
/// The same with a tolerance relative to the real one.
inline void compare_share(const Pair& pair, const char* name, double share, const Figure& figure) {
  compare(pair, name, share * std::abs(figure(pair.real).value_or(0)), figure);
}

inline std::optional<double> since(std::optional<double> t, std::optional<double> begun) {
  if (!t || !begun) return std::nullopt;
  return *t - *begun;
}
inline Figure after_arming(const std::string& what, double value) {
  return [=](const Trace& t) { return since(t.at("in", what, {value}, t.armed().value()), t.armed()); };
}
inline Figure rise(double height) {
  return [=](const Trace& t) { return since(t.crosses(2, height, t.armed().value()), t.armed()); };
}
/// The set-point after a move that steps, east, north, up.
inline Vec3 goal(const Trace& t, const std::string& move) {
  const double begun = t.note(move).value();
  const auto& out = *std::ranges::find_if(t.rows(), [&](const Row& r) { return r.t > begun && r.who == "out"; });
  return {out.values[1], out.values[0], -out.values[2]};
}
/// When this share of the way from the place at the note to the set-point is gone.
inline Figure step_time(const std::string& move, int axis, double share) {
  return [=](const Trace& t) {
    const double begun = t.note(move).value(), from = t.position(begun)[axis];
    return since(t.crosses(static_cast<std::size_t>(axis), from + share * (goal(t, move)[axis] - from), begun), begun);
  };
}
inline Figure overshoot(const std::string& move, int axis, double within) {
  return [=](const Trace& t) -> std::optional<double> {
    const double begun = t.note(move).value(), end = goal(t, move)[axis];
    return t.most(begun, begun + within, [&](double s) { return t.position(s)[axis] - end; });
  };
}
inline Figure largest_speed(const std::string& move, double within) {
  return [=](const Trace& t) -> std::optional<double> {
    const double begun = t.note(move).value();
    return t.most(begun, begun + within, [&](double s) { return t.velocity(s).norm(); });
  };
}
/// How far from where it was at the note.
inline Figure moved(const std::string& note, double later) {
  return [=](const Trace& t) -> std::optional<double> {
    const double begun = t.note(note).value();
    return (t.position(begun + later) - t.position(begun)).head<2>().norm();
  };
}
inline double stream_off(const Trace& t) { return t.note("stream off").value(); }

inline Figure heartbeat_after(const std::string& note, double custom_mode) {
  return [=](const Trace& t) -> std::optional<double> {
    const double begun = t.note(note).value();
    for (const Row& r : t.rows())
      if (r.t >= begun && r.what == "HEARTBEAT" && r.values[1] == custom_mode) return r.t - begun;
    return std::nullopt;
  };
}
/// When it first sinks at 0.2 m/s.
inline Figure descends_after(const std::string& note) {
  return [=](const Trace& t) { return since(t.crosses(5, -0.2, t.note(note).value(), true), t.note(note)); };
}
/// How far LOCAL_POSITION_NED and truth lie apart, across.
inline Figure estimate_wrong(const std::string& note, double later) {
  return [=](const Trace& t) -> std::optional<double> {
    const double at = t.note(note).value() + later;
    const Row *before = nullptr, *after = nullptr;
    for (const Row& r : t.rows()) {
      if (r.what != "LOCAL_POSITION_NED" || r.who != "in") continue;
      (r.t <= at ? before : after) = &r;
      if (after) break;
    }
    if (!before || !after) return std::nullopt;
    const auto wrong = [&](const Row& r) {
      return (t.position(r.t).head<2>() - Vec3(r.values[1], r.values[0], 0).head<2>()).norm();
    };
    return wrong(*before) + (at - before->t) / (after->t - before->t) * (wrong(*after) - wrong(*before));
  };
}
/// What was said in order from a note on; HEARTBEATs as base mode, custom mode, status.
inline std::vector<std::string> heartbeats(const Trace& t, const std::string& from) {
  return t.said("in", "HEARTBEAT", t.note(from).value());
}
/// Each answer by itself, equal ones too.
inline std::vector<std::pair<double, double>> acks(const Trace& t, const std::string& from) {
  std::vector<std::pair<double, double>> all;
  for (const Row& r : t.rows())
    if (r.t >= t.note(from).value() && r.who == "in" && r.what == "COMMAND_ACK")
      all.emplace_back(r.values[0], r.values[1]);
  return all;
}
/// Values and types of the parameters that the script reads.
inline std::map<std::string, std::vector<double>> asked_values(const Trace& t) {
  std::map<std::string, std::vector<double>> all;
  for (const Row& r : t.rows())
    if (r.what.starts_with("PARAM_VALUE ") && t.note("read " + r.what.substr(12))) all[r.what.substr(12)] = r.values;
  return all;
}

inline void compare_run_out(const Pair& pair) {
  compare_share(pair, "speed when set-points stop, m/s", 0.15,
                [](const Trace& t) { return t.velocity(stream_off(t)).head<2>().norm(); });
  compare_share(pair, "run-out, m", 0.25,
                [](const Trace& t) { return t.run_out(stream_off(t), stream_off(t) + 9).distance; });
  compare_share(pair, "until it stands, s", 0.25,
                [](const Trace& t) { return t.run_out(stream_off(t), stream_off(t) + 9).time; });
}

/// `wander`: how much later or earlier the real one may be at 90 % by its simulator's noise, s.
inline void compare_steps(const Pair& pair, double wander, double overshoots) {
  const std::string across = "move 0.5 0 0 0", up = "move 0 0 0.4 0";
  compare(pair, "step across of 0.5 m: 10 %, s", 0.3, step_time(across, 0, 0.1));
  compare(pair, "step across of 0.5 m: 50 %, s", 0.3, step_time(across, 0, 0.5));
  compare(pair, "step across of 0.5 m: 90 %, s", 0.3 + wander, step_time(across, 0, 0.9));
  compare(pair, "step across: overshoot, m", overshoots, overshoot(across, 0, 6));
  compare(pair, "step up of 0.4 m: 10 %, s", 0.3, step_time(up, 2, 0.1));
  compare(pair, "step up of 0.4 m: 50 %, s", 0.3, step_time(up, 2, 0.5));
  compare(pair, "step up of 0.4 m: 90 %, s", 0.3, step_time(up, 2, 0.9));
  compare(pair, "step up: overshoot, m", 0.03, overshoot(up, 2, 6));
  compare_share(pair, "fastest in a movement at 1 m/s, m/s", 0.15, largest_speed("move -3 0 0 1.0", 6));
}

inline void compare_landing(const Pair& pair, double down) {
  compare(pair, "landing: ground reached, s", 0.5, [down](const Trace& t) {
    const double begun = t.note("command 21").value();
    return since(t.crosses(2, down, begun, true), begun);
  });
  compare(pair, "landing: on ground said, s", 0.7, [](const Trace& t) {
    const double begun = t.note("command 21").value();
    return since(t.at("in", "EXTENDED_SYS_STATE", {1}, begun), begun);
  });
}

/// A failsafe that lands, from its cause on, while set-points go on. The cause of a silent station is its last
/// heartbeat, which the session sends each whole second.
inline void compare_failsafe(const Pair& pair, const std::string& note, double custom_mode, double stands) {
  const auto cause = [&](const Trace& t) {
    const double at = t.note(note).value();
    return note == "station off" ? std::floor(at) : at;
  };
  const auto from = [&](const Figure& figure) -> Figure {
    return [=, &note](const Trace& t) -> std::optional<double> {
      const auto found = figure(t);
      return found ? std::optional(*found + t.note(note).value() - cause(t)) : std::nullopt;
    };
  };
  const auto landed_state = [&](double state) {
    return from([=, &note](const Trace& t) {
      const double at = t.note(note).value();
      return since(t.at("in", "EXTENDED_SYS_STATE", {state}, at), at);
    });
  };
  compare(pair, "the failsafe's mode in HEARTBEAT, s", 0.7, from(heartbeat_after(note, custom_mode)));
  compare(pair, "landing said, s", 0.3, landed_state(4));
  compare(pair, "gone until it stands, m", 0.2, [&](const Trace& t) -> std::optional<double> {
    return (t.position(cause(t) + stands) - t.position(cause(t))).head<2>().norm();
  });
  compare(pair, "descends, s", 0.5, from(descends_after(note)));
  compare(pair, "ground reached, s", 0.6, from([&](const Trace& t) {
            const double at = t.note(note).value();
            return since(t.crosses(2, 0.02, at, true), at);
          }));
  compare(pair, "on ground said, s", 0.7, landed_state(1));
  EXPECT_EQ(heartbeats(pair.own, note), heartbeats(pair.real, note));
  for (const char* text : {"STATUSTEXT Radio", "STATUSTEXT GCS", "STATUSTEXT Battery Failsafe"})
    EXPECT_EQ(pair.own.said("in", text), pair.real.said("in", text));
}

}  // namespace backwash::autopilots
