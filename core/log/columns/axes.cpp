// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/axes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/log/columns/column_law.hpp"
#include "core/log/columns/local_cubic.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/columns/median.hpp"
#include "core/types/formatted.hpp"

namespace backwash::log {
namespace {

constexpr double kNearAxis = 0.8;                // cosine, 37°: less than half the way to the next axis
constexpr double kNearWeight = 0.2;              // of g
constexpr double kAtFloor = 0.05, kAloft = 0.3;  // m

constexpr std::array kAttitude{"qw", "qx", "qy", "qz"};

Turn along(int x, int y, int z) {  // ±1, ±2, ±3: ours along theirs
  Turn t = Turn::Zero();
  int row = 0;
  for (const int axis : {x, y, z}) t(row++, std::abs(axis) - 1) = axis > 0 ? 1 : -1;
  return t;
}

const std::array<Vec3, 6>& axes() {
  static const std::array<Vec3, 6> all{Vec3::UnitZ(),  -Vec3::UnitZ(), Vec3::UnitY(),
                                       -Vec3::UnitY(), Vec3::UnitX(),  -Vec3::UnitX()};
  return all;
}

/// The axis that a vector of about length 1 is near.
std::optional<Vec3> axis_near(const Vec3& v) {
  for (const Vec3& axis : axes())
    if (v.dot(axis) > kNearAxis * v.norm() && std::abs(v.norm() - 1) < kNearWeight) return axis;
  return std::nullopt;
}

Mat3 rotation_at(const FlightLog& log, std::size_t row) {
  return Eigen::Quaterniond(log.column("qw")[row], log.column("qx")[row], log.column("qy")[row], log.column("qz")[row])
      .normalized()
      .toRotationMatrix();
}

/// By the specific force, which a hover alone tells.
std::optional<UpAxes> by_force(const FlightLog& log) {
  Vec3 world = Vec3::Zero(), body = Vec3::Zero();
  const auto n = static_cast<double>(log.t_s.size());
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    const Vec3 f = xyz(log, "specific_force_", "", row) / kGravity;
    body += f / n;
    world += rotation_at(log, row) * f / n;
  }
  const auto up = axis_near(world), of_body = axis_near(body);
  if (!up || !of_body) return std::nullopt;
  return UpAxes{*up, *of_body};
}

/// Sums of two directions, to see how one follows the other.
struct Followed {
  double n = 0, squares = 0, apart = 0;
  Vec3 sum_a = Vec3::Zero(), sum_b = Vec3::Zero();
  void add(const Vec3& a, const Vec3& b) {
    n += 1;
    squares += a.squaredNorm() + b.squaredNorm();
    apart += (a - b).squaredNorm();
    sum_a += a;
    sum_b += b;
  }
  /// 1 − var(a − b)/(var a + var b): 1 of the same, 0 of strangers, −1 of opposites.
  double share() const {
    const double both = squares - (sum_a.squaredNorm() + sum_b.squaredNorm()) / n;
    return both > 0 ? 1 - (apart - (sum_a - sum_b).squaredNorm() / n) / both : 0;
  }
  bool near() const { return sum_a.dot(sum_b) > kNearAxis * sum_a.norm() * sum_b.norm(); }
};

/// By what thrust along the body's axis accelerates.
std::optional<UpAxes> by_thrust(const FlightLog& log) {
  std::vector<Vec3> p;
  for (std::size_t row = 0; row < log.t_s.size(); ++row) p.push_back(xyz(log, "", "_m", row));
  const auto motion = local_cubics_but_for_holds(log.t_s, p);
  std::optional<UpAxes> best;
  double most = kFollows, next = -1;
  for (const Vec3& up : axes())
    for (const Vec3& body : axes()) {
      Followed pair;
      for (std::size_t row = 0; row < p.size(); ++row)
        if (motion[row]) pair.add((motion[row]->a + kGravity * up).normalized(), rotation_at(log, row) * body);
      if (pair.n == 0 || !pair.near()) continue;
      const double share = pair.share();
      if (share > most) {
        next = best ? most : next;
        most = share;
        best = UpAxes{up, body};
      } else {
        next = std::max(next, share);
      }
    }
  return best && next < kStranger ? best : std::nullopt;
}

}  // namespace

std::optional<Turn> turn_of(const std::string& text) {
  Turn t = Turn::Zero();
  int row = 0, sign = 1;
  for (const char c : text) {
    if (c == ' ' || c == ',' || c == '+') continue;
    if (c == '-') {
      sign = -1;
      continue;
    }
    if (c < 'x' || c > 'z' || row == 3) return std::nullopt;
    t(row++, c - 'x') = sign;
    sign = 1;
  }
  if (row != 3 || std::abs(t.determinant() - 1) > 0.5) return std::nullopt;
  return t;
}

std::string text_of(const Turn& turn) {
  std::string text;
  for (int row = 0; row < 3; ++row)
    for (int axis = 0; axis < 3; ++axis)
      if (turn(row, axis) != 0)
        text += std::string(row > 0 ? ", " : "") + (turn(row, axis) < 0 ? "-" : "") + "xyz"[axis];
  return text;
}

const std::vector<NamedTurn>& named_worlds() {
  static const std::vector<NamedTurn> all{{"enu", Turn::Identity()}, {"ned", along(2, 1, -3)}};
  return all;
}
const std::vector<NamedTurn>& named_bodies() {
  static const std::vector<NamedTurn> all{{"flu", Turn::Identity()}, {"frd", along(1, -2, -3)}};
  return all;
}
std::string called(const Turn& turn, const std::vector<NamedTurn>& names) {
  for (const auto& known : names)
    if (known.turn == turn) return known.name;
  return text_of(turn);
}

Turn upright_world(const Vec3& up) {
  // Motion capture has y up; a camera's world has y down and looks along z.
  for (const Turn& t : {named_worlds()[0].turn, named_worlds()[1].turn, along(1, -3, 2), along(3, -1, -2),
                        along(2, 3, 1), along(2, -3, -1)})
    if (t * up == Vec3::UnitZ()) return t;
  return Turn::Identity();
}

Turn upright_body(const Vec3& up) {
  // An inertial unit on its edge has x up and looks along z (EuRoC's); a camera has y down and looks along z.
  for (const Turn& t : {named_bodies()[0].turn, named_bodies()[1].turn, along(1, -3, 2), along(3, -1, -2),
                        along(3, -2, 1), along(3, 2, -1)})
    if (t * up == Vec3::UnitZ()) return t;
  return Turn::Identity();
}

std::optional<UpAxes> up_axes(const FlightLog& log) {
  if (!has_all(log, kAttitude) || log.t_s.empty()) return std::nullopt;
  if (has_xyz(log, "specific_force_", "")) return by_force(log);
  return by_thrust(log);
}

std::optional<Vec3> body_up(const FlightLog& log, const Vec3& up) {
  if (!has_all(log, kAttitude) || log.t_s.empty()) return std::nullopt;
  Vec3 mean = Vec3::Zero();
  for (std::size_t row = 0; row < log.t_s.size(); ++row) mean += rotation_at(log, row).transpose() * up;
  return axis_near(mean / static_cast<double>(log.t_s.size()));
}

std::optional<std::pair<std::string, Vec3>> flat_height(const FlightLog& log) {
  if (log.t_s.empty()) return std::nullopt;
  const auto off = [&](const char* column) {
    std::vector<double> apart = log.column(column);
    for (double& v : apart) v = std::abs(v);
    return median(std::move(apart));
  };
  const double z = off("z_m"), x = off("x_m"), y = off("y_m");
  if (const double most = std::ranges::max(log.column("z_m")); most < -kAtFloor && z > kAloft)
    return std::pair{"z is below " + formatted("%.2f", most) + " m throughout", Vec3(-Vec3::UnitZ())};
  if (z > kAtFloor || std::max(x, y) < kAloft) return std::nullopt;
  const bool is_y = y >= x;
  const double middle = median(log.column(is_y ? "y_m" : "x_m"));
  return std::pair{"z is within " + formatted("%.2g", z) + " m of 0, and " + (is_y ? "y" : "x") + " is at " +
                       formatted("%.2f", middle) + " m",
                   Vec3((middle > 0 ? 1 : -1) * (is_y ? Vec3::UnitY() : Vec3::UnitX()))};
}

}  // namespace backwash::log
