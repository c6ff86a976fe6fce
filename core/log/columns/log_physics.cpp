// SPDX-License-Identifier: BSD-3-Clause
// What one column of a flight log says of another: a wrong unit, axis or frame contradicts it.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "core/log/columns/import_columns.hpp"
#include "core/log/columns/local_cubic.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/columns/median.hpp"
#include "core/types/formatted.hpp"

namespace backwash::log {
namespace {

constexpr double kLeastSpeed = 0.05;         // m/s, rms: less says nothing of velocity's axes
constexpr double kLeastAcceleration = 0.25;  // m/s², rms
constexpr double kSettled = 0.06;            // s on each side: what measured accelerations are averaged over
constexpr double kFollows = 0.7;             // correlation from which an axis follows another
constexpr double kClearly = 0.05;            // by which one correlation is more than another
constexpr double kStranger = 0.3;            // below it two that moved have nothing to do with each other
/// Slopes that are right, and whether what has nothing to do with its derivative is wrong.
struct Bounds {
  double velocity[2], acceleration[2];
  double tilt[2];  // thrust differs from weight, and drag tilts as well
  bool strangers;
};
constexpr Bounds kImported{{0.8, 1.25}, {0.6, 1.6}, {0.4, 2.5}, true};
constexpr Bounds kPossible{{1 / 3.0, 3}, {1 / 3.0, 3}, {0.2, 5}, false};
constexpr double kLongestStep = 0.5;      // s, between rows on the median
constexpr double kLength[] = {0.9, 1.1};  // of an attitude
constexpr double kGravityLeft = 2.5;      // m/s², of the median vertical acceleration
constexpr double kMostThrust = 1.2, kLeastThrust = -0.05;

using Names = std::array<const char*, 3>;
using Vectors = std::vector<Vec3>;

Vectors rows_of(const FlightLog& log, const Names& names) {
  Vectors rows;
  for (std::size_t i = 0; i < log.t_s.size(); ++i)
    rows.emplace_back(log.column(names[0])[i], log.column(names[1])[i], log.column(names[2])[i]);
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

struct Pairing {
  const char* what;     ///< "velocity"
  const char* of_what;  ///< "the derivative of position"
  Names said;           ///< columns of `what`
  Names wanted;         ///< of what it should follow
  double least;         ///< rms of an axis that says something
  const double (&right)[2];
  bool strangers;
  int axes = 3;
};

/// How an axis goes with another one, means taken off both: slope and correlation.
struct Match {
  int axis;  // the other
  double slope, correlation;
};
Match match_of(const Vectors& said, int axis, const Vectors& shown, int other) {
  const auto n = static_cast<double>(said.size());
  double mean_said = 0, mean_shown = 0, ss = 0, dd = 0, sd = 0;
  for (std::size_t i = 0; i < said.size(); ++i) {
    mean_said += said[i][axis] / n;
    mean_shown += shown[i][other] / n;
  }
  for (std::size_t i = 0; i < said.size(); ++i) {
    const double s = said[i][axis] - mean_said, d = shown[i][other] - mean_shown;
    ss += s * s;
    dd += d * d;
    sd += s * d;
  }
  return {other, dd > 0 ? sd / dd : 0, ss > 0 && dd > 0 ? sd / std::sqrt(ss * dd) : 0};
}

/// With the axis of `shown` that an axis of `said` goes with best: itself, unless another one does clearly better, and
/// better than because it goes with what is said along that one. On a way between two axes a leap of the estimate along
/// one of them would make it a stranger to its own.
Match best_match(const Vectors& said, const Vectors& shown, int axis, int axes) {
  Match best = match_of(said, axis, shown, axis);
  for (int other = 0; other < axes; ++other) {
    if (other == axis) continue;
    const Match match = match_of(said, axis, shown, other);
    const double led =
        std::abs(match_of(said, axis, said, other).correlation * match_of(said, other, shown, other).correlation);
    if (std::abs(match.correlation) > std::max(std::abs(best.correlation), led) + kClearly) best = match;
  }
  return best;
}

double rms(const Vectors& rows, int axis) {
  double sum = 0, mean = 0;
  for (const Vec3& v : rows) mean += v[axis] / static_cast<double>(rows.size());
  for (const Vec3& v : rows) sum += (v[axis] - mean) * (v[axis] - mean);
  return std::sqrt(sum / static_cast<double>(rows.size()));
}

void pair_up(const Pairing& p, const Vectors& said, const Vectors& shown, std::vector<std::string>& wrong) {
  for (int axis = 0; axis < p.axes; ++axis) {
    if (rms(shown, axis) < p.least && rms(said, axis) < p.least) continue;
    const Match match = best_match(said, shown, axis, p.axes);
    const auto i = static_cast<std::size_t>(axis), j = static_cast<std::size_t>(match.axis);
    const double r = std::abs(match.correlation);
    if (r >= kFollows) {
      if (match.axis == axis && match.slope >= p.right[0] && match.slope <= p.right[1]) continue;
      wrong.push_back(std::string(p.said[i]) + " is " + formatted("%.3g", match.slope) + " times " + p.of_what +
                      " of " + p.wanted[j] + ": a wrong unit, sign, axis or frame");
    } else if (p.strangers && r < kStranger && rms(shown, axis) > 2 * p.least && rms(said, axis) > 2 * p.least) {
      wrong.push_back(std::string(p.said[i]) + " has nothing to do with " + p.of_what + " of " + p.wanted[i] +
                      " (correlation " + formatted("%.2f", match.correlation) + "): are the " + p.what +
                      "'s columns named rightly?");
    }
  }
}

/// Directions of the body's z axis, times gravity: what a thrust of the weight along it accelerates sideways.
Vectors tilts(const FlightLog& log) {
  Vectors rows;
  for (std::size_t i = 0; i < log.t_s.size(); ++i) {
    const double w = log.column("qw")[i], x = log.column("qx")[i], y = log.column("qy")[i], z = log.column("qz")[i];
    rows.push_back(kGravity * Vec3(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)));
  }
  return rows;
}

/// Vectors of both where the first is known.
struct Both {
  Vectors derived, said;
};

constexpr Names kP{"x_m", "y_m", "z_m"}, kV{"vx_mps", "vy_mps", "vz_mps"}, kA{"ax_mps2", "ay_mps2", "az_mps2"};
constexpr std::array kQ{"qw", "qx", "qy", "qz"};

/// Both where the motion is known.
Both where_known(const std::vector<std::optional<LocalMotion>>& motion, const Vectors& said, bool second) {
  Both both;
  for (std::size_t i = 0; i < said.size(); ++i)
    if (motion[i]) {
      both.derived.push_back(second ? motion[i]->a : motion[i]->v);
      both.said.push_back(said[i]);
    }
  return both;
}

std::vector<std::string> contradictions(const FlightLog& log, const Bounds& bounds) {
  std::vector<std::string> wrong;
  const auto motion = local_cubics_but_for_holds(log.t_s, rows_of(log, kP));
  if (has_all(log, kV)) {
    const auto v = where_known(motion, rows_of(log, kV), false);
    pair_up({"velocity", "the derivative", kV, kP, kLeastSpeed, bounds.velocity, bounds.strangers}, v.said, v.derived,
            wrong);
  }
  if (has_all(log, kA)) {
    const Vectors measured = averaged(log.t_s, rows_of(log, kA));
    std::vector<double> up;
    for (const Vec3& a : measured) up.push_back(a.z());
    if (const double left = median(up); std::abs(left) > kGravityLeft)
      wrong.push_back("az_mps2 has a median of " + formatted("%.2f", left) +
                      " m/s²: gravity is in it, or its unit, sign or frame is wrong");
    const auto a = where_known(motion, measured, true);
    pair_up(
        {"acceleration", "the second derivative", kA, kP, kLeastAcceleration, bounds.acceleration, bounds.strangers},
        a.said, a.derived, wrong);
    if (has_all(log, kQ))
      pair_up({"attitude",
               "the tilt that accelerates along the axis",
               {"tilt along x", "tilt along y", ""},
               kA,
               kLeastAcceleration,
               bounds.tilt,
               bounds.strangers,
               2},
              averaged(log.t_s, tilts(log)), measured, wrong);
  }
  if (log.has("thrust")) {
    const auto [least, most] = std::ranges::minmax(log.column("thrust"));
    if (least < kLeastThrust || most > kMostThrust)
      wrong.push_back("thrust goes from " + formatted("%.3g", least) + " to " + formatted("%.3g", most) +
                      ": it is a share, 0 … 1; give its unit");
  }
  return wrong;
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
void zeros(const FlightLog& log, std::vector<std::string>& wrong) {
  const auto motion = local_cubics_but_for_holds(log.t_s, rows_of(log, kP));
  for (const bool second : {false, true}) {
    const Names& names = second ? kA : kV;
    if (!silent(log, names)) continue;
    const auto both = where_known(motion, rows_of(log, names), second);
    for (int axis = 0; axis < 3 && !both.derived.empty(); ++axis)
      if (rms(both.derived, axis) > 2 * (second ? kLeastAcceleration : kLeastSpeed)) {
        wrong.push_back(std::string(names[0]) + ", " + names[1] + " and " + names[2] +
                        " are 0 in every row, and the craft moves; leave out columns that nothing has measured");
        break;
      }
  }
}

/// How the tilts go with the accelerations along x and y: the smaller correlation of the two. Nothing of a flight that
/// does not accelerate along both.
std::optional<double> tilts_along(const FlightLog& log) {
  const Vectors measured = averaged(log.t_s, rows_of(log, kA)), tilted = averaged(log.t_s, tilts(log));
  double least = 1;
  for (int axis = 0; axis < 2; ++axis) {
    if (rms(measured, axis) < kLeastAcceleration) return std::nullopt;
    const Match match = best_match(tilted, measured, axis, 2);
    least = std::min(least, match.axis == axis ? match.correlation : 0.0);
  }
  return least;
}

void attitudes(const FlightLog& log, std::vector<std::string>& wrong) {
  if (!has_all(log, kQ)) return;
  std::size_t bad = 0;
  for (std::size_t i = 0; i < log.t_s.size(); ++i) {
    double square = 0;
    for (const char* name : kQ) square += std::pow(log.column(name)[i], 2);
    bad += std::sqrt(square) < kLength[0] || std::sqrt(square) > kLength[1] ? 1u : 0u;
  }
  if (bad > 0) {
    wrong.push_back("qw, qx, qy and qz have no length of 1 in " + std::to_string(bad) + " of " +
                    std::to_string(log.t_s.size()) + " rows; leave out rows, or columns, without an attitude");
    return;
  }
  if (!has_all(log, kA)) return;
  const auto as_it_is = tilts_along(log);
  if (!as_it_is || *as_it_is >= kStranger) return;
  for (const auto& [order, w] : {std::pair{"x, y, z, w", 3UL}, {"z, w, x, y", 1UL}}) {
    FlightLog turned = log;  // the scalar is in column w, and x, y, z are in those after it
    for (std::size_t k = 0; k < 4; ++k) turned.columns[kQ[k]] = log.column(kQ[(w + k) % 4]);
    if (*tilts_along(turned) >= kFollows)
      wrong.push_back(std::string("qw, qx, qy and qz tilt the craft where it accelerates if they are read as ") +
                      order + ": are they named rightly?");
  }
}

}  // namespace

std::vector<std::string> contradictions(const FlightLog& log) { return contradictions(log, kImported); }

std::vector<std::string> impossible(const FlightLog& log) {
  if (log.t_s.size() < 2) return {};
  if (const auto stamps = wrong_stamps(log)) return {*stamps};
  auto wrong = contradictions(log, kPossible);
  zeros(log, wrong);
  attitudes(log, wrong);
  return wrong;
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
