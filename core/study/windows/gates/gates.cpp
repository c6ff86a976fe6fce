// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/gates/gates.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "core/types/quantile.hpp"

namespace backwash::study {
namespace {

/// Rows whose position is exactly that of the row before, as many and as long as the rules say.
std::vector<char> frozen_rows(const log::FlightLog& log, const std::vector<std::size_t>& rows) {
  const auto &x = log.column("x_m"), &y = log.column("y_m"), &z = log.column("z_m");
  const auto repeats = [&](std::size_t k) {
    const std::size_t i = rows[k], last = rows[k - 1];
    return x[i] == x[last] && y[i] == y[last] && z[i] == z[last];
  };
  std::vector<char> frozen(rows.size());
  for (std::size_t k = 1; k < rows.size();) {
    std::size_t end = k;
    while (end < rows.size() && repeats(end)) ++end;
    if (static_cast<double>(end - k + 1) >= kWindowRules.frozen_rows &&
        log.t_s[rows[end - 1]] - log.t_s[rows[k - 1]] >= kWindowRules.frozen)
      std::fill(frozen.begin() + static_cast<std::ptrdiff_t>(k - 1), frozen.begin() + static_cast<std::ptrdiff_t>(end),
                char{1});
    k = std::max(end, k + 1);
  }
  return frozen;
}

}  // namespace

const char* to_string(Gate gate) noexcept {
  constexpr const char* kNames[] = {"frozen", "perched", "saturated", "transit", "gap", "inconsistent", "outside"};
  return kNames[static_cast<std::size_t>(gate)];
}

bool ByName::operator()(Gate a, Gate b) const noexcept { return std::strcmp(to_string(a), to_string(b)) < 0; }

std::vector<SampleRange> unbroken(const std::vector<double>& t) {
  if (t.empty()) return {};
  std::vector<double> spacing;
  for (std::size_t i = 1; i < t.size(); ++i) spacing.push_back(t[i] - t[i - 1]);
  const double longest =
      spacing.empty() ? 0
                      : std::max(kWindowRules.gap.value, kWindowRules.gap_periods * quantile(std::move(spacing), 0.5));
  std::vector<SampleRange> stretches{{0, 1}};
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] - t[i - 1] > longest) stretches.push_back({i, i});
    stretches.back().end = i + 1;
  }
  return stretches;
}

std::vector<SampleRange> cut(const Series& s) {
  constexpr double kLength = kWindowRules.window_length;
  constexpr auto kFewest = static_cast<std::size_t>(kWindowRules.fewest_rows);
  std::vector<SampleRange> windows;
  for (const auto& [from, to] : unbroken(s.t))
    for (std::size_t begin = from; begin < to;) {
      std::size_t end = begin + 1;
      while (end < to && s.segment[end] == s.segment[begin]) ++end;
      const double length = s.t[end - 1] - s.t[begin];
      const double most = static_cast<double>(end - begin) / (kFewest - 1);  // of parts that hold enough samples
      const auto parts = static_cast<std::size_t>(std::lround(length / kLength < most ? length / kLength : 0.0));
      for (std::size_t k = 0; k < parts; ++k) {
        const std::size_t a = begin + k * (end - begin) / parts, b = begin + (k + 1) * (end - begin) / parts;
        if (b - a >= kFewest) windows.push_back({a, b});
      }
      begin = end;
    }
  return windows;
}

LogGates::LogGates(const log::FlightLog& log, std::vector<std::size_t> rows, const std::optional<Vehicle>& vehicle)
    : log_(log), rows_(std::move(rows)), vehicle_(vehicle), frozen_(frozen_rows(log, rows_)) {
  for (const char* name : {"motor1", "motor2", "motor3", "motor4"})
    if (log.has(name)) motors_.push_back(&log.column(name));
  commands_ = motors_;
  if (!log.has("thrust")) return;
  commands_.push_back(&log.column("thrust"));
  hover_thrust_ = hover_thrust();
}

double LogGates::share_of(double u) const { return vehicle_ ? thrust_share(*vehicle_, u) : u; }

/// What the log itself holds in the air: the median of all that is no less than perched_thrust of it. It is looked for
/// from the mean of the shares by their own size on: a log that mostly stands is judged by what it does off the ground.
std::optional<double> LogGates::hover_thrust() const {
  std::vector<double> shares;
  double sum = 0, squares = 0;
  const auto& thrust = log_.column("thrust");
  for (const auto row : rows_) {
    shares.push_back(share_of(thrust[row]));
    sum += shares.back();
    squares += shares.back() * shares.back();
  }
  if (!(sum > 0)) return std::nullopt;
  for (double held = squares / sum;;) {
    std::vector<double> flown;
    for (const double share : shares)
      if (share >= kWindowRules.perched_thrust * held) flown.push_back(share);
    const double next = quantile(std::move(flown), 0.5);
    if (next == held) return held;
    held = next;
  }
}

bool LogGates::rotors_rest(SampleRange w) const {
  if (motors_.size() < 4) return false;
  for (std::size_t k = w.begin; k < w.end; ++k)
    if (std::all_of(motors_.begin(), motors_.end(), [&](auto* m) { return (*m)[rows_[k]] <= kWindowRules.idle; }))
      return true;
  return false;
}

bool LogGates::perched(SampleRange w) const {
  const double n = static_cast<double>(w.size());
  const auto mean = [&](auto value) {
    double sum = 0;
    for (std::size_t k = w.begin; k < w.end; ++k) sum += value(rows_[k]) / n;
    return sum;
  };
  double most = 0;
  for (const char* axis : {"x_m", "y_m", "z_m"}) {
    const auto& x = log_.column(axis);
    const double middle = mean([&](std::size_t row) { return x[row]; });
    most = std::max(most, mean([&](std::size_t row) { return std::pow(x[row] - middle, 2); }));
  }
  if (std::sqrt(most) < kWindowRules.perched_spread || rotors_rest(w)) return true;
  if (hover_thrust_) {
    const auto& u = log_.column("thrust");
    if (mean([&](std::size_t row) { return share_of(u[row]); }) < kWindowRules.perched_thrust * *hover_thrust_)
      return true;
  }
  if (!log_.has("stood_z_m")) return false;
  const auto &z = log_.column("z_m"), &stood = log_.column("stood_z_m");
  return mean([&](std::size_t row) { return z[row] - stood[row]; }) < kWindowRules.clear;
}

std::optional<Gate> LogGates::operator()(SampleRange w) const {
  for (std::size_t k = w.begin; k < w.end; ++k)
    if (frozen_[k]) return Gate::frozen;
  if (perched(w)) return Gate::perched;
  std::size_t saturated = 0;
  for (std::size_t k = w.begin; k < w.end; ++k)
    saturated += std::any_of(commands_.begin(), commands_.end(), [&](auto* c) {
      const double u = (*c)[rows_[k]];
      return u <= kWindowRules.rotor_limit || u >= 1 - kWindowRules.rotor_limit;
    });
  if (static_cast<double>(saturated) > kWindowRules.saturated_share * static_cast<double>(w.size()))
    return Gate::saturated;
  return std::nullopt;
}

bool simulated(const Series& s) { return s.simulated_by_thrust || !s.a_nominal.empty(); }

bool under_way(const Series& s, SampleRange w) {
  for (std::size_t a = w.begin, b = w.begin; b < w.end; ++b) {
    while (s.t[b] - s.t[a] > kWindowRules.still_time) ++a;
    const double time = s.t[b] - s.t[a];
    if (time > kWindowRules.still_enough * kWindowRules.still_time &&
        (s.p[b] - s.p[a]).norm() > kWindowRules.still_speed * time)
      return true;
  }
  return false;
}

std::optional<Gate> unfit(const Series& s, const log::FlightLog& log, SampleRange w) {
  if (!simulated(s) && !log.has("motor1") && under_way(s, w)) return Gate::transit;
  if (!s.has_velocity) return std::nullopt;
  const double time = s.t[w.end - 1] - s.t[w.begin];
  Vec3 flown = Vec3::Zero();
  for (std::size_t i = w.begin + 1; i < w.end; ++i) flown += 0.5 * (s.v[i] + s.v[i - 1]) * (s.t[i] - s.t[i - 1]);
  const Vec3 off = s.p[w.end - 1] - s.p[w.begin] - flown;  // position and velocity must tell the same story
  if ((off / time).norm() > kWindowRules.inconsistent) return Gate::inconsistent;
  return std::nullopt;
}

}  // namespace backwash::study
