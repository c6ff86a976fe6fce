// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/column_law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/log/columns/import_columns.hpp"
#include "core/types/formatted.hpp"

namespace backwash::log {
namespace {

constexpr std::size_t kParts = 10;  // of a flight, left out in turn
constexpr double kErrors = 3.25;    // Student's t at 99 %, two-sided, of kParts
constexpr double kClearly = 0.05;   // by which one correlation is more than another
constexpr double kEverything = std::numeric_limits<double>::infinity();

struct Moments {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  void add(double a, double b) {
    n += 1;
    x += a;
    y += b;
    xx += a * a;
    yy += b * b;
    xy += a * b;
  }
  Moments without(const Moments& part) const {
    return {n - part.n, x - part.x, y - part.y, xx - part.xx, yy - part.yy, xy - part.xy};
  }
  double var_x() const { return xx - x * x / n; }
  double var_y() const { return yy - y * y / n; }
  double cov() const { return xy - x * y / n; }
  /// cov/var(x), cov/var(y), correlation.
  std::array<double, 3> shares() const {
    return {cov() / var_x(), cov() / var_y(), cov() / std::sqrt(var_x() * var_y())};
  }
};

std::vector<double> axis_of(std::span<const Vec3> rows, std::size_t axis) {
  std::vector<double> values;
  for (const Vec3& row : rows) values.push_back(row[static_cast<Eigen::Index>(axis)]);
  return values;
}

double rms(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const double v : values) sum += v, squares += v * v;
  return std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)));
}

/// What may be said of one axis.
struct Axis {
  enum class Verdict { silent, agrees, unit, sign, exchanged, off, stranger } verdict = Verdict::silent;
  std::size_t other = 0;  ///< the axis that it follows
  Gain gain;              ///< of that
  std::string way;        ///< what would be right
};

/// The unit of `said` or of `wanted` whose factor is in the gain, as a sentence; empty: none.
std::string unit_within(const std::string& said, const std::string& wanted, const Gain& gain, double sane) {
  std::string best;
  double nearest = sane;  // a factor is as far from the next as 1 is, or farther
  const double middle = std::isfinite(gain.high) ? std::sqrt(gain.low * gain.high) : gain.low;
  const auto look = [&](const std::string& column, const std::string& unit, double factor) {
    const double off = std::max(factor / middle, middle / factor);
    if (!gain.within(factor / sane, factor * sane) || off > nearest) return;
    nearest = off;
    best = column + " is in " + unit + ": give it that unit, or take it times " +
           formatted("%.4g", *unit_factor(column, unit));
  };
  for (const auto& unit : units_of(said))
    if (const double to_ours = *unit_factor(said, unit); to_ours != 1) look(said, unit, 1 / to_ours);
  for (const auto& unit : units_of(wanted))
    if (const double to_ours = *unit_factor(wanted, unit); to_ours != 1) look(wanted, unit, to_ours);
  return best;
}

/// The other axis that this one follows clearly better than its own, and not because what is said along the two goes
/// together: on a way between two axes a leap of the estimate along one would make it a stranger to its own.
std::optional<std::pair<std::size_t, Gain>> followed(std::size_t axis, std::span<const std::vector<double>> said,
                                                     std::span<const std::vector<double>> shown, const Gain& own) {
  std::optional<std::pair<std::size_t, Gain>> best;
  for (std::size_t other = 0; other < said.size(); ++other) {
    if (other == axis) continue;
    const Gain gain = gain_of(shown[other], said[axis]);
    const double led =
        std::abs(gain_of(said[other], said[axis]).correlation * gain_of(shown[other], said[other]).correlation);
    const double r = std::abs(gain.correlation);
    if (r < kFollows || r <= std::max(std::abs(own.correlation), led) + kClearly) continue;
    if (!best || r > std::abs(best->second.correlation)) best = {other, gain};
  }
  return best;
}

Axis judged(const ColumnPair& pair, std::size_t axis, std::span<const std::vector<double>> said,
            std::span<const std::vector<double>> shown) {
  using enum Axis::Verdict;
  std::vector<double> apart;
  for (std::size_t i = 0; i < said[axis].size(); ++i) apart.push_back(said[axis][i] - shown[axis][i]);
  const double moved = rms(shown[axis]), told = rms(said[axis]);
  const Gain own = gain_of(shown[axis], said[axis]);
  if (std::max(moved, told) < pair.least) return {silent, axis, own, ""};
  const std::string &name = pair.said[axis], &wanted = pair.wanted[axis];
  const bool sane = own.sign > 0 && own.within(1 / pair.sane_most, pair.sane_most);
  if (rms(apart) < pair.least) return {sane ? agrees : silent, axis, own, ""};
  if (const auto other = followed(axis, said, shown, own))
    return {exchanged, other->first, other->second,
            "are " + name + " and " + pair.said[other->first] + " exchanged, or the world turned?"};
  if (sane && own.correlation >= kFollows) return {agrees, axis, own, ""};
  if (own.sign < 0 && own.correlation <= -kFollows)
    return {sign, axis, own, "turn the sign of " + name + " or of " + wanted};
  if (own.sign > 0 && !sane) {
    const std::string way = pair.units ? unit_within(name, wanted, own, pair.sane_most) : "";
    return {way.empty() ? off : unit, axis, own, way.empty() ? "no unit is so far off: which column is it?" : way};
  }
  const double r = std::abs(own.correlation);  // a leap of the estimate, which lowers it, makes it uncertain as well
  if (r < kStranger && r + own.correlation_error < kFollows && std::min(moved, told) > 2 * pair.least)
    return {stranger, axis, own, "is " + name + " named rightly?"};
  return {silent, axis, own, ""};
}

std::string figures(const ColumnPair& pair, std::size_t axis, const Axis& a, double moved) {
  const std::string of = pair.of_what + " of " + pair.wanted[a.other], r = formatted("%.2f", a.gain.correlation),
                    seen = ", correlation " + r + formatted(", rms %.2g)", moved);
  if (a.verdict == Axis::Verdict::stranger)
    return pair.said[axis] + " has nothing to do with " + of + " (" + seen.substr(2);
  const std::string sign = a.gain.sign < 0 ? "−" : "";
  return pair.said[axis] + " is " + sign + formatted("%.3g", a.gain.low) + " to " + sign +
         formatted("%.3g", a.gain.high) + " times " + of + " (99 %" + seen;
}

}  // namespace

Gain gain_of(std::span<const double> x, std::span<const double> y) {
  Gain gain{0, 0, kEverything, 0, 1};
  const std::size_t n = x.size();
  if (n < 2 * kParts) return gain;
  std::array<Moments, kParts> parts;
  Moments all;
  for (std::size_t i = 0; i < n; ++i) {
    // From the first on, so that what is constant is so to the last bit.
    parts[i * kParts / n].add(x[i] - x[0], y[i] - y[0]);
    all.add(x[i] - x[0], y[i] - y[0]);
  }
  if (!(all.var_x() > 0) || !(all.var_y() > 0)) return gain;
  const auto whole = all.shares();
  std::array<double, 3> error{};
  for (const auto& part : parts) {
    const auto without = all.without(part);
    if (!(without.var_x() > 0) || !(without.var_y() > 0)) return gain;
    const auto shares = without.shares();
    for (std::size_t k = 0; k < 3; ++k) error[k] += std::pow(shares[k] - whole[k], 2);
  }
  constexpr double kShare = (kParts - 1.0) / kParts;
  for (double& e : error) e = kErrors * std::sqrt(kShare * e);
  gain.correlation = whole[2];
  gain.correlation_error = error[2];
  const double least = std::abs(whole[0]) - error[0], inverse = std::abs(whole[1]) - error[1];
  if (least > 0) {
    gain.sign = whole[0] > 0 ? 1 : -1;
    gain.low = least;
  }
  if (inverse > 0) gain.high = 1 / inverse;
  return gain;
}

std::vector<ColumnDoubt> doubts_of(const ColumnPair& pair, std::span<const Vec3> said, std::span<const Vec3> shown) {
  std::vector<std::vector<double>> said_along, shown_along;
  for (std::size_t axis = 0; axis < pair.said.size(); ++axis) {
    said_along.push_back(axis_of(said, axis));
    shown_along.push_back(axis_of(shown, axis));
  }
  if (said.empty()) return {};
  std::vector<Axis> axes;
  for (std::size_t axis = 0; axis < pair.said.size(); ++axis)
    axes.push_back(judged(pair, axis, said_along, shown_along));
  using enum Axis::Verdict;
  const auto count = [&](auto holds) { return std::ranges::count_if(axes, holds); };
  const auto first = std::ranges::find_if(axes, [](const Axis& a) { return a.verdict > agrees; });
  if (first == axes.end()) return {};
  const bool explained = first->verdict == unit || first->verdict == sign || first->verdict == exchanged;
  const bool whole = explained && count([](const Axis& a) { return a.verdict == agrees; }) == 0 &&
                     count([&](const Axis& a) { return a.verdict > agrees && a.verdict != first->verdict; }) == 0;
  std::vector<ColumnDoubt> doubts;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const Axis& a = axes[axis];
    if (a.verdict <= agrees) continue;
    auto columns = pair.leave_out.empty() ? std::vector{pair.said[axis]} : pair.leave_out;
    doubts.push_back({std::move(columns), figures(pair, axis, a, rms(shown_along[a.other])) + ": " + a.way, whole});
  }
  return doubts;
}

double nearest_unit(const std::string& column, const std::string& derived_from) {
  double nearest = kEverything;
  for (const auto& name : {column, derived_from})
    for (const auto& unit : units_of(name))
      if (const double factor = *unit_factor(name, unit); factor != 1)
        nearest = std::min(nearest, std::max(factor, 1 / factor));
  return std::sqrt(nearest);
}

}  // namespace backwash::log
