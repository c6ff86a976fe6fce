// SPDX-License-Identifier: BSD-3-Clause
// What one column of a flight log says of another: a wrong unit, axis or frame contradicts it.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/log/import_columns.hpp"
#include "core/log/local_cubic.hpp"
#include "core/log/log_columns.hpp"
#include "core/log/median.hpp"
#include "core/types/formatted.hpp"

namespace backwash::log {
namespace {

constexpr double kLeastSpeed = 0.05;         // m/s, rms: less says nothing of velocity's axes
constexpr double kLeastAcceleration = 0.25;  // m/s², rms
constexpr double kSettled = 0.06;            // s on each side: what measured accelerations are averaged over
constexpr double kFollows = 0.7;             // correlation from which an axis follows another
constexpr double kStranger = 0.3;            // below it two that moved have nothing to do with each other
constexpr double kVelocityRight[] = {0.8, 1.25}, kAccelerationRight[] = {0.6, 1.6};
constexpr double kTiltRight[] = {0.4, 2.5};  // thrust differs from weight, and drag tilts as well
constexpr double kGravityLeft = 2.5;         // m/s², of the median vertical acceleration
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
  int axes = 3;
};

/// How an axis of `said` goes with each axis of `shown` (means taken off both): slope and correlation with the one that
/// it goes with best.
struct Match {
  int axis;
  double slope, correlation;
};
Match best_match(const Vectors& said, const Vectors& shown, int axis, int axes) {
  Match best{axis, 0, 0};
  const auto n = static_cast<double>(said.size());
  Vec3 mean_said = Vec3::Zero(), mean_shown = Vec3::Zero();
  for (std::size_t i = 0; i < said.size(); ++i) mean_said += said[i] / n, mean_shown += shown[i] / n;
  for (int other = 0; other < axes; ++other) {
    double ss = 0, dd = 0, sd = 0;
    for (std::size_t i = 0; i < said.size(); ++i) {
      const double s = said[i][axis] - mean_said[axis], d = shown[i][other] - mean_shown[other];
      ss += s * s, dd += d * d, sd += s * d;
    }
    const double r = ss > 0 && dd > 0 ? sd / std::sqrt(ss * dd) : 0;
    // The axis itself, unless another one goes with it clearly better.
    if (std::abs(r) > std::abs(best.correlation) + (other == axis ? -0.05 : 0.05) || (other == 0))
      best = {other, dd > 0 ? sd / dd : 0, r};
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
    } else if (r < kStranger && rms(shown, axis) > 2 * p.least && rms(said, axis) > 2 * p.least) {
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

}  // namespace

std::vector<std::string> contradictions(const FlightLog& log) {
  constexpr Names kP{"x_m", "y_m", "z_m"}, kV{"vx_mps", "vy_mps", "vz_mps"}, kA{"ax_mps2", "ay_mps2", "az_mps2"};
  std::vector<std::string> wrong;
  const auto motion = local_cubics(log.t_s, rows_of(log, kP));
  const auto known = [&](const Vectors& said, bool second) {
    Both both;
    for (std::size_t i = 0; i < said.size(); ++i)
      if (motion[i]) both.derived.push_back(second ? motion[i]->a : motion[i]->v), both.said.push_back(said[i]);
    return both;
  };
  if (has_all(log, kV)) {
    const auto v = known(rows_of(log, kV), false);
    pair_up({"velocity", "the derivative", kV, kP, kLeastSpeed, kVelocityRight}, v.said, v.derived, wrong);
  }
  if (has_all(log, kA)) {
    const Vectors measured = averaged(log.t_s, rows_of(log, kA));
    std::vector<double> up;
    for (const Vec3& a : measured) up.push_back(a.z());
    if (const double left = median(up); std::abs(left) > kGravityLeft)
      wrong.push_back("az_mps2 has a median of " + formatted("%.2f", left) +
                      " m/s²: gravity is in it, or its unit, sign or frame is wrong");
    const auto a = known(measured, true);
    pair_up({"acceleration", "the second derivative", kA, kP, kLeastAcceleration, kAccelerationRight}, a.said,
            a.derived, wrong);
    if (has_all(log, std::array{"qw", "qx", "qy", "qz"}))
      pair_up({"attitude",
               "the tilt that accelerates along the axis",
               {"tilt along x", "tilt along y", ""},
               kA,
               kLeastAcceleration,
               kTiltRight,
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

}  // namespace backwash::log
