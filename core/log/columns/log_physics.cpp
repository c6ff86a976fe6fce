// SPDX-License-Identifier: BSD-3-Clause
// What one column of a flight log says of another: a wrong unit, axis or frame contradicts it.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "core/log/columns/column_law.hpp"
#include "core/log/columns/import_columns.hpp"
#include "core/log/columns/local_cubic.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/columns/median.hpp"
#include "core/types/formatted.hpp"

namespace backwash::log {
namespace {

constexpr double kLeastSpeed = 0.05;            // m/s, rms: what a sane velocity may be off by
constexpr double kLeastAcceleration = 0.25;     // m/s², rms
constexpr double kSettled = 0.06;               // s on each side: what accelerations are averaged over beside tilts
constexpr double kMostThrustToWeight = 2.5;     // on the mean, or its inverse: what a tilt may accelerate more, or less
constexpr double kLongestStep = 0.5;            // s, between rows on the median
constexpr double kLength[] = {0.9, 1.1};        // of an attitude
constexpr double kGravityLeft = 2.5;            // m/s², of the median vertical acceleration
constexpr double kFastest = 50, kHardest = 30;  // m/s and m/s², rms over a flight: beyond any multirotor
constexpr double kMostThrust = 1.2, kLeastThrust = -0.05;

using Names = std::array<const char*, 3>;
using Vectors = std::vector<Vec3>;

constexpr Names kP{"x_m", "y_m", "z_m"}, kV{"vx_mps", "vy_mps", "vz_mps"}, kA{"ax_mps2", "ay_mps2", "az_mps2"};
constexpr std::array kQ{"qw", "qx", "qy", "qz"};

template <typename Columns>
std::vector<std::string> list(const Columns& names) {
  return {names.begin(), names.end()};
}

Vectors rows_of(const FlightLog& log, const Names& names) {
  Vectors rows;
  const auto &x = log.column(names[0]), &y = log.column(names[1]), &z = log.column(names[2]);
  for (std::size_t i = 0; i < log.t_s.size(); ++i) rows.emplace_back(x[i], y[i], z[i]);
  return rows;
}

/// Means over ± kSettled around each row.
Vectors averaged(const std::vector<double>& t, const Vectors& rows) {
  Vectors means;
  std::size_t first = 0, last = 0;
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < t.size(); ++i) {
    while (last < t.size() && t[last] <= t[i] + kSettled) sum += rows[last++];
    while (t[first] < t[i] - kSettled) sum -= rows[first++];
    means.push_back(sum / static_cast<double>(last - first));
  }
  return means;
}

/// The way that rows lead from 0 on.
Vectors integral(const std::vector<double>& t, const Vectors& rows) {
  Vectors sums(rows.size(), Vec3::Zero());
  for (std::size_t i = 1; i < rows.size(); ++i)
    sums[i] = sums[i - 1] + 0.5 * (t[i] - t[i - 1]) * (rows[i] + rows[i - 1]);
  return sums;
}

using Motion = std::vector<std::optional<LocalMotion>>;

/// Derivatives of the positions, and what the rows themselves say, both through the same filter: local_cubics of the
/// way that the rows lead.
struct Both {
  Vectors derived, said;
};
Both both_of(const FlightLog& log, const Motion& motion, const Names& names, bool second) {
  Vectors way = integral(log.t_s, rows_of(log, names));
  if (second) way = integral(log.t_s, way);
  const auto said = local_cubics(log.t_s, way);
  Both both;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    if (!motion[i] || !said[i]) continue;
    both.derived.push_back(second ? motion[i]->a : motion[i]->v);
    both.said.push_back(second ? said[i]->a : said[i]->v);
  }
  return both;
}

double rms(const Vectors& rows, int axis) {
  double sum = 0, mean = 0;
  for (const Vec3& v : rows) mean += v[axis] / static_cast<double>(rows.size());
  for (const Vec3& v : rows) sum += (v[axis] - mean) * (v[axis] - mean);
  return std::sqrt(sum / static_cast<double>(rows.size()));
}

/// Directions of the body's z axis, times gravity: what a thrust of the weight along it accelerates sideways.
Vectors tilts(const FlightLog& log) {
  Vectors rows;
  const auto &qw = log.column("qw"), &qx = log.column("qx"), &qy = log.column("qy"), &qz = log.column("qz");
  for (std::size_t i = 0; i < log.t_s.size(); ++i) {
    const double w = qw[i], x = qx[i], y = qy[i], z = qz[i];
    rows.push_back(kGravity * Vec3(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)));
  }
  return rows;
}

using Doubts = std::vector<ColumnDoubt>;
void add(Doubts& doubts, Doubts more) { std::ranges::move(more, std::back_inserter(doubts)); }

Doubts of_motion(const FlightLog& log, const Motion& motion, const Names& names, bool second) {
  const auto both = both_of(log, motion, names, second);
  return doubts_of({list(names), list(kP), second ? "the second derivative" : "the derivative",
                    second ? kLeastAcceleration : kLeastSpeed, nearest_unit(names[0], kP[0]), true},
                   both.said, both.derived);
}

/// Positions that move as no multirotor does.
Doubts of_extent(const Motion& motion) {
  double n = 0, v = 0, a = 0;
  for (const auto& m : motion) {
    if (!m) continue;
    n += 1;
    v += m->v.squaredNorm();
    a += m->a.squaredNorm();
  }
  v = std::sqrt(v / n);
  a = std::sqrt(a / n);
  if (n == 0 || (v <= kFastest && a <= kHardest)) return {};
  std::string fitting;
  for (const auto& unit : units_of(kP[0]))
    if (const double f = *unit_factor(kP[0], unit); f < 1 && f * v <= kFastest && f * a <= kHardest)
      fitting +=
          (fitting.empty() ? "" : " or ") + unit + formatted(" (%.3g m/s,", f * v) + formatted(" %.3g m/s²)", f * a);
  return {{list(kP),
           "x_m, y_m and z_m move by" + formatted(" %.4g m/s and", v) +
               formatted(" %.4g m/s² (rms), as no multirotor does: ", a) +
               (fitting.empty() ? "which columns are the positions, and in which unit?"
                                : "give their unit, which fits if it is " + fitting),
           true}};
}

Doubts of_gravity(const FlightLog& log) {
  const double left = median(log.column("az_mps2"));
  if (std::abs(left) <= kGravityLeft) return {};
  return {{{"az_mps2"},
           "az_mps2 has a median of " + formatted("%.2f", left) +
               " m/s²: gravity is in it, or its unit, sign or frame is wrong; take 9.81 off, or give specific_force_z",
           true}};
}

Doubts of_axes(const FlightLog& log) {
  const auto words = turned_axes(log);
  return words.empty() ? Doubts{} : Doubts{{list(kP), words, true}};
}

Doubts of_tilt(const FlightLog& log) {
  return doubts_of({{"tilt along x (pitch)", "tilt along y (roll)"},
                    {kP[0], kP[1]},
                    "the tilt that accelerates along the axis",
                    kLeastAcceleration,
                    kMostThrustToWeight,
                    true,
                    list(kQ)},
                   averaged(log.t_s, tilts(log)), averaged(log.t_s, rows_of(log, kA)));
}

/// Commands that are no shares. Without the rotors' a flight is still one, without the thrust's it is not as logged.
Doubts of_commands(const FlightLog& log) {
  constexpr std::array kCommands{"thrust", "motor1", "motor2", "motor3", "motor4"};
  for (const std::string name : kCommands) {
    if (!log.has(name) || log.column(name).empty()) continue;
    const auto [least, most] = std::ranges::minmax(log.column(name));
    if (least >= kLeastThrust && most <= kMostThrust) continue;
    const bool whole = name == kCommands[0];
    return {{whole ? std::vector{name} : std::vector<std::string>(kCommands.begin() + 1, kCommands.end()),
             name + " goes from " + formatted("%.4g", least) + " to " + formatted("%.4g", most) +
                 ": it is a share, 0 … 1; give its unit",
             whole}};
  }
  return {};
}

/// Stamps that are none of a flight.
std::optional<std::string> wrong_stamps(const FlightLog& log) {
  std::vector<double> steps;
  std::size_t rising = 0;
  for (std::size_t i = 1; i < log.t_s.size(); ++i) {
    steps.push_back(log.t_s[i] - log.t_s[i - 1]);
    rising += steps.back() > 0 ? 1u : 0u;
  }
  if (steps.empty()) return std::nullopt;
  if (2 * rising < steps.size()) return "t_s does not rise from row to row; give the rows in their order";
  if (const double step = median(steps); step > kLongestStep)
    return "t_s goes on by " + formatted("%.3g", step) +
           " a row: it is in s, and a flight has 10 rows a second or more";
  return std::nullopt;
}

bool silent(const FlightLog& log, std::span<const char* const> names) {
  return has_all(log, names) && std::ranges::all_of(names, [&](const char* name) {
           return std::ranges::all_of(log.column(name), [](double x) { return x == 0; });
         });
}

/// Velocities or accelerations that are 0 while the positions move.
Doubts of_zeros(const FlightLog& log, const Motion& motion, const Names& names, bool second) {
  const auto both = both_of(log, motion, names, second);
  for (int axis = 0; axis < 3 && !both.derived.empty(); ++axis)
    if (rms(both.derived, axis) > 2 * (second ? kLeastAcceleration : kLeastSpeed))
      return {{list(names), std::string(names[0]) + ", " + names[1] + " and " + names[2] +
                                " are 0 in every row, and the craft moves: nothing has measured them"}};
  return {};
}

/// How the tilts go with the accelerations along x and y: the smaller correlation of the two. Nothing of a flight that
/// does not accelerate along both.
std::optional<double> tilts_along(const FlightLog& log) {
  const Vectors measured = averaged(log.t_s, rows_of(log, kA)), tilted = averaged(log.t_s, tilts(log));
  double least = 1;
  for (int axis = 0; axis < 2; ++axis) {
    if (rms(measured, axis) < kLeastAcceleration) return std::nullopt;
    std::vector<double> x, y;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      x.push_back(measured[i][axis]);
      y.push_back(tilted[i][axis]);
    }
    least = std::min(least, gain_of(x, y).correlation);
  }
  return least;
}

/// An attitude of no length, or whose parts stand in another order.
Doubts of_attitude(const FlightLog& log) {
  std::size_t bad = 0;
  std::vector<double> squares(log.t_s.size(), 0);
  for (const char* name : kQ)
    std::ranges::transform(log.column(name), squares, squares.begin(),
                           [](double q, double sum) { return sum + q * q; });
  for (const double square : squares) {
    bad += std::sqrt(square) < kLength[0] || std::sqrt(square) > kLength[1] ? 1u : 0u;
  }
  if (bad > 0)
    return {{list(kQ), "qw, qx, qy and qz have no length of 1 in " + std::to_string(bad) + " of " +
                           std::to_string(log.t_s.size()) + " rows: leave out rows without an attitude"}};
  if (!has_all(log, kA)) return {};
  if (const auto as_it_is = tilts_along(log); as_it_is && *as_it_is < kStranger)
    for (const auto& [order, w] : {std::pair{"x, y, z, w", 3UL}, {"z, w, x, y", 1UL}}) {
      FlightLog turned = log;  // the scalar is in column w, and x, y, z are in those after it
      for (std::size_t k = 0; k < 4; ++k) turned.columns[kQ[k]] = log.column(kQ[(w + k) % 4]);
      if (*tilts_along(turned) >= kFollows)
        return {{list(kQ),
                 std::string("qw, qx, qy and qz tilt the craft where it accelerates if they are read as ") + order +
                     ": are they named rightly?",
                 true}};
    }
  return has_all(log, kA) ? of_tilt(log) : Doubts{};
}

}  // namespace

std::string turned_axes(const FlightLog& log) {
  if (!has_all(log, kP)) return "";
  const auto readings = axes_readings(log);
  if (readings.empty() || !readings.front().keys.empty()) return "";
  const auto& up = readings.front().up;
  if (up.world == Vec3::UnitZ() && up.body == Vec3::UnitZ()) return "";
  return "the weight and the thrust are along other axes than z: import it with frame.world = \"" +
         called(upright_world(up.world), named_worlds()) + "\" and frame.body = \"" +
         called(upright_body(up.body), named_bodies()) + "\"";
}

Doubts contradictions(const FlightLog& log) {
  Doubts doubts;
  const auto motion = local_cubics_but_for_holds(log.t_s, rows_of(log, kP));
  for (const bool second : {false, true}) {
    const Names& names = second ? kA : kV;
    if (!has_all(log, names)) continue;
    add(doubts, silent(log, names) ? of_zeros(log, motion, names, second) : of_motion(log, motion, names, second));
  }
  add(doubts, of_extent(motion));
  add(doubts, of_axes(log));
  if (has_all(log, kA)) add(doubts, of_gravity(log));
  if (has_all(log, kQ)) add(doubts, of_attitude(log));
  add(doubts, of_commands(log));
  return doubts;
}

tl::expected<std::vector<std::string>, std::string> leave_out_doubted(FlightLog& log) {
  std::vector<std::string> told;
  if (log.t_s.size() < 2) return told;
  if (const auto stamps = wrong_stamps(log)) return tl::make_unexpected(*stamps);
  const auto doubts = contradictions(log);
  if (const auto whole = std::ranges::find_if(doubts, &ColumnDoubt::whole); whole != doubts.end())
    return tl::make_unexpected(whole->words);
  for (const auto& doubt : doubts) {
    std::string names;
    for (const auto& name : doubt.columns) {
      log.columns.erase(name);
      names += (names.empty() ? "" : ", ") + name;
    }
    told.push_back(doubt.words + "; left out: " + names);
  }
  return told;
}

std::vector<std::string> silent_columns(const FlightLog& log) {
  constexpr std::array kRpm{"rpm1", "rpm2", "rpm3", "rpm4"}, kMotors{"motor1", "motor2", "motor3", "motor4"};
  std::vector<std::string> all;
  const auto look = [&](std::span<const char* const> names) {
    if (silent(log, names)) all.insert(all.end(), names.begin(), names.end());
  };
  look(kRpm);
  look(kMotors);
  look(std::array{"thrust"});
  look(std::array{"battery_v"});
  return all;
}

}  // namespace backwash::log
