// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/axes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

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

/// A reading of four columns as an attitude: the column of the scalar, the others after it; turned round or not.
struct Reading {
  std::size_t scalar = 0;
  bool inverse = false;
};
constexpr Reading kReadings[] = {{0, false}, {3, false}, {1, false}, {0, true}, {3, true}, {1, true}};

Mat3 rotation_at(const FlightLog& log, std::size_t row, const Reading& reading = {}) {
  const auto part = [&](std::size_t k) { return log.column(kAttitude[(reading.scalar + k) % 4])[row]; };
  const Eigen::Quaterniond q(part(0), part(1), part(2), part(3));
  return (reading.inverse ? q.conjugate() : q).normalized().toRotationMatrix();
}

/// By the specific force, which a hover alone tells.
std::optional<UpAxes> by_force(const FlightLog& log, const Reading& reading = {}) {
  Vec3 world = Vec3::Zero(), body = Vec3::Zero();
  const auto n = static_cast<double>(log.t_s.size());
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    const Vec3 f = xyz(log, "specific_force_", "", row) / kGravity;
    body += f / n;
    world += rotation_at(log, row, reading) * f / n;
  }
  const auto up = axis_near(world), of_body = axis_near(body);
  if (!up || !of_body) return std::nullopt;
  return UpAxes{*up, *of_body};
}

/// Accelerations of the positions, and the rows beside them, of kMostRows rows at most.
class Thrust {
 public:
  explicit Thrust(const FlightLog& log) : log_(log) {
    constexpr std::size_t kMostRows = 4000;
    std::vector<Vec3> p;
    for (std::size_t row = 0; row < log.t_s.size(); ++row) p.push_back(xyz(log, "", "_m", row));
    const auto motion = local_cubics_but_for_holds(log.t_s, p);
    for (std::size_t row = 0; row < p.size(); row += 1 + p.size() / kMostRows) {
      if (!motion[row]) continue;
      a_.push_back(motion[row]->a);
      rows_.push_back(row);
    }
  }

  /// The axes along which thrust accelerates (3-11).
  std::optional<UpAxes> up(const Reading& reading) const {
    std::vector<Mat3> R;
    for (const std::size_t row : rows_) R.push_back(rotation_at(log_, row, reading));
    std::optional<UpAxes> best;
    double most = kFollows, next = -1;
    for (const Vec3& world : axes())
      for (const Vec3& body : axes()) {
        const double share = share_of(world, body, R);
        if (share > most) {
          next = best ? most : next;
          most = share;
          best = UpAxes{world, body};
        } else {
          next = std::max(next, share);
        }
      }
    return best && next < kStranger ? best : std::nullopt;
  }

 private:
  /// 1 − var(n − R b)/(var n + var R b): 1 of the same, 0 of strangers, −1 of opposites and of what is not near.
  double share_of(const Vec3& world, const Vec3& body, const std::vector<Mat3>& R) const {
    double squares = 0, apart = 0;
    Vec3 sum_n = Vec3::Zero(), sum_b = Vec3::Zero();
    for (std::size_t row = 0; row < R.size(); ++row) {
      const Vec3 n = (a_[row] + kGravity * world).normalized(), b = R[row] * body;
      squares += n.squaredNorm() + b.squaredNorm();
      apart += (n - b).squaredNorm();
      sum_n += n;
      sum_b += b;
    }
    if (!(sum_n.dot(sum_b) > kNearAxis * sum_n.norm() * sum_b.norm())) return -1;
    const auto rows = static_cast<double>(R.size());
    const double both = squares - (sum_n.squaredNorm() + sum_b.squaredNorm()) / rows;
    return both > 0 ? 1 - (apart - (sum_n - sum_b).squaredNorm() / rows) / both : -1;
  }

  const FlightLog& log_;
  std::vector<Vec3> a_;
  std::vector<std::size_t> rows_;
};

/// What a column map has to say for a reading.
std::string keys_of(const Reading& reading) {
  std::string keys;
  for (std::size_t k = 0; reading.scalar > 0 && k < 4; ++k)
    keys += std::string(k > 0 ? ", " : "") + kAttitude[k] + " from the column given as " +
            kAttitude[(reading.scalar + k) % 4];
  if (reading.inverse) keys += std::string(keys.empty() ? "" : ", ") + "frame.attitude = \"world to body\"";
  return keys;
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
  return Thrust(log).up({});
}

std::vector<AxesReading> axes_readings(const FlightLog& log) {
  if (!has_all(log, kAttitude) || log.t_s.empty()) return {};
  const Thrust thrust(log);
  const bool force = has_xyz(log, "specific_force_", "");
  const auto same = [](const UpAxes& a, const UpAxes& b) { return a.world == b.world && a.body == b.body; };
  std::vector<AxesReading> moved, weighed, all;
  for (const Reading& reading : kReadings) {
    const auto up = thrust.up(reading), felt = force ? by_force(log, reading) : up;
    if (felt && std::ranges::none_of(weighed, [&](const auto& r) { return same(r.up, *felt); }))
      weighed.push_back({*felt, keys_of(reading)});
    if (up && felt && same(*up, *felt)) moved.push_back({*up, keys_of(reading)});
  }
  if (moved.empty()) moved = weighed;  // by the weight alone
  const auto highest = [&](const AxesReading& reading) {
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t row = 0; row < log.t_s.size(); ++row)
      most = std::max(most, reading.up.world.dot(xyz(log, "", "_m", row)));
    return most;
  };
  std::ranges::copy_if(moved, std::back_inserter(all), [&](const auto& r) { return highest(r) > -kAtFloor; });
  return all.empty() ? moved : all;
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
