// SPDX-License-Identifier: BSD-3-Clause
#include "tests/fuzz/sequence/event.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <random>

namespace backwash::fuzz {
namespace {

using Kind = Event::Kind;

/// How often a kind comes, and how its numbers are drawn.
struct Draw {
  Kind kind;
  int weight;
  int most;      ///< n: 1 … most
  double scale;  ///< a, b, c: ± scale, now and then a hundredth or ten times that
};

constexpr std::array kDraws{
    Draw{Kind::command, 8, 12, 1},         Draw{Kind::foreign, 3, 12, 1},       Draw{Kind::repeated, 3, 1, 1},
    Draw{Kind::old_number, 2, 12, 1},      Draw{Kind::new_session, 3, 12, 1},   Draw{Kind::departed, 2, 3, 0},
    Draw{Kind::vio_off, 3, 40, 0},         Draw{Kind::vio_shift, 3, 100, 0.5},  Draw{Kind::vio_turn, 4, 400, 1.6},
    Draw{Kind::vio_scale, 2, 400, 1},      Draw{Kind::vio_drift, 2, 200, 0.5},  Draw{Kind::vio_freeze, 3, 20, 0},
    Draw{Kind::vio_late, 3, 100, 0.2},     Draw{Kind::vio_stamp, 2, 300, 100},  Draw{Kind::vio_repeat, 2, 6, 0},
    Draw{Kind::vio_nan, 2, 10, 10},        Draw{Kind::vio_huge, 3, 3, 1e39},    Draw{Kind::closure, 5, 1, 0.3},
    Draw{Kind::map_same, 1, 1, 0},         Draw{Kind::map_box, 2, 1, 1},        Draw{Kind::map_elsewhere, 1, 1, 1},
    Draw{Kind::map_damaged, 2, 20, 1},     Draw{Kind::map_resolution, 1, 1, 1}, Draw{Kind::scan_box, 4, 1, 1},
    Draw{Kind::noise, 3, 300, 0},          Draw{Kind::damage, 2, 40, 50},       Draw{Kind::swap, 2, 40, 0},
    Draw{Kind::mute, 2, 120, 0},           Draw{Kind::deaf, 2, 200, 0},         Draw{Kind::heartbeat, 4, 4, 0},
    Draw{Kind::take_over, 3, 1, 0},        Draw{Kind::disarm, 1, 1, 0},         Draw{Kind::ack, 2, 500, 6},
    Draw{Kind::position, 3, 1, 1e39},      Draw{Kind::attitude, 2, 1, 1},       Draw{Kind::battery, 1, 1, 0.2},
    Draw{Kind::timesync, 3, 1, 0},         Draw{Kind::reset, 4, 1, 1},          Draw{Kind::reset_counter, 3, 3, 0},
    Draw{Kind::parameter, 2, 1, 1e39},     Draw{Kind::missed, 5, 30, 0},        Draw{Kind::slow_planner, 6, 60, 0},
    Draw{Kind::late_segment, 8, 60, 0},    Draw{Kind::slow_mission, 3, 40, 0},  Draw{Kind::restart, 1, 1, 0},
    Draw{Kind::hang_up, 1, 1, 0},          Draw{Kind::plug_in, 3, 1, 0},        Draw{Kind::switch_pressed, 4, 60, 0},
    Draw{Kind::switch_broken, 2, 200, 10},
};

class Generator {
 public:
  explicit Generator(std::uint64_t seed) : random_(seed) {}

  std::vector<Event> sequence(int ticks) {
    std::vector<Event> events;
    // The operator looks at his screen more or less often, and something disturbs him more or less often.
    const double glance = 20 + 40 * uniform(), trouble = 80 + 400 * uniform();
    for (double t = 62; t < ticks; t += 1 + glance * waiting()) events.push_back(operate(static_cast<int>(t)));
    const double quiet_until = uniform() < 0.2 ? 0 : 300;
    for (double t = quiet_until + trouble * waiting(); t < ticks; t += trouble * waiting()) {
      const Event e = disturb(static_cast<int>(t));
      events.push_back(e);
      // Troubles come together; and a line that was lost comes back.
      if (uniform() < 0.3) t -= trouble * 0.5 * uniform();
      t = std::max(t, static_cast<double>(e.tick));
      if (e.kind == Kind::hang_up) events.push_back({e.tick + 1 + static_cast<int>(100 * uniform()), Kind::plug_in});
    }
    std::ranges::stable_sort(events, {}, &Event::tick);
    return events;
  }

 private:
  double uniform() { return std::uniform_real_distribution<>()(random_); }
  double waiting() { return std::exponential_distribution<>()(random_); }
  Event operate(int tick) {
    return {tick, Kind::operate, static_cast<int>(random_() % 100), uniform(), uniform(), uniform(), 0};
  }
  double number(double scale) {
    const double x = (2 * uniform() - 1) * scale;
    const double kind = uniform();
    return kind < 0.15 ? x / 100 : kind < 0.25 ? 10 * x : x;
  }
  Event disturb(int tick) {
    int total = 0;
    for (const Draw& d : kDraws) total += d.weight;
    int left = static_cast<int>(random_() % static_cast<std::uint64_t>(total));
    const auto* draw = kDraws.data();
    while (left >= draw->weight) left -= draw++->weight;
    Event e{tick, draw->kind, 1 + static_cast<int>(random_() % static_cast<std::uint64_t>(draw->most))};
    const bool in_room = draw->kind == Kind::map_box || draw->kind == Kind::scan_box || draw->kind == Kind::command ||
                         draw->kind == Kind::foreign || draw->kind == Kind::old_number ||
                         draw->kind == Kind::new_session;
    e.a = in_room ? uniform() : number(draw->scale);
    e.b = in_room ? uniform() : number(draw->scale);
    e.c = in_room ? uniform() : number(draw->scale);
    e.d = number(0.1);
    if (draw->kind == Kind::vio_huge || draw->kind == Kind::vio_nan || draw->kind == Kind::position ||
        draw->kind == Kind::ack || draw->kind == Kind::switch_broken)
      e.b = static_cast<double>(random_() % 10);
    return e;
  }

  std::mt19937_64 random_;
};

constexpr std::array kNames{
    "operate",       "command",     "foreign",        "repeated",     "old_number",    "new_session", "departed",
    "vio_off",       "vio_shift",   "vio_turn",       "vio_scale",    "vio_drift",     "vio_freeze",  "vio_late",
    "vio_stamp",     "vio_repeat",  "vio_nan",        "vio_huge",     "closure",       "map_same",    "map_box",
    "map_elsewhere", "map_damaged", "map_resolution", "scan_box",     "noise",         "damage",      "swap",
    "mute",          "deaf",        "heartbeat",      "take_over",    "disarm",        "ack",         "position",
    "attitude",      "battery",     "timesync",       "reset",        "reset_counter", "parameter",   "switch_pressed",
    "switch_broken", "missed",      "slow_planner",   "late_segment", "slow_mission",  "restart",     "hang_up",
    "plug_in",
};
static_assert(kNames.size() == static_cast<std::size_t>(Kind::kinds));

}  // namespace

std::vector<Event> sequence(std::uint64_t seed, int ticks) { return Generator(seed).sequence(ticks); }

std::string describe(const Event& e) {
  char line[200];
  std::snprintf(line, sizeof line, "{%d, Kind::%s, %d, %.17g, %.17g, %.17g, %.17g},", e.tick,
                kNames[static_cast<std::size_t>(e.kind)], e.n, e.a, e.b, e.c, e.d);
  return line;
}

}  // namespace backwash::fuzz
