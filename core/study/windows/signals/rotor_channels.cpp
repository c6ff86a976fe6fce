// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/rotor_channels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/log/columns/median.hpp"
#include "core/study/windows/gates/window_rules.hpp"
#include "core/study/windows/signals/signals.hpp"

namespace backwash::study {
namespace {

std::string name_of(const char* kind, std::size_t rotor) { return kind + std::to_string(rotor + 1); }

using Rates = std::array<std::optional<double>, 4>;  // Hz

Rates rates_of(const RotorPhases& phases, const Series& s, std::size_t begin, std::size_t end) {
  Rates rates;
  for (std::size_t rotor = 0; rotor < rates.size(); ++rotor)
    if (const auto& phase = phases.phase[rotor]; !phase.empty())
      rates[rotor] = (phase[end - 1] - phase[begin]) / (2 * std::numbers::pi * (s.t[end - 1] - s.t[begin]));
  return rates;
}

/// Whether a rotor's line is its value in this window, and not that of another one whose line it is, too.
bool speaks(const Rates& rates, std::size_t rotor, std::size_t turn) {
  constexpr double kApart = kWindowRules.line_alike / kWindowRules.line_block;
  std::vector<std::size_t> alike;
  for (std::size_t other = 0; other < rates.size(); ++other)
    if (rates[other] && std::abs(*rates[other] - *rates[rotor]) < kApart) alike.push_back(other);
  return alike.empty() || alike[turn % alike.size()] == rotor;  // none: no rate is a number
}

using Readings = std::array<std::vector<double>, 4>;  // of the rotors that a log has

/// The step in which a column was written down: the least by which it differs from row to row.
double step_of(const std::vector<double>& column) {
  double step = HUGE_VAL;
  for (std::size_t i = 1; i < column.size(); ++i)
    if (const double d = std::abs(column[i] - column[i - 1]); d > 0) step = std::min(step, d);
  return step;
}

/// Median of the other rotors' readings in one row, each over its own middle; 1 without another.
double others_at(const Readings& readings, const std::array<double, 4>& middle, std::size_t rotor, std::size_t i) {
  std::vector<double> all;
  for (std::size_t r = 0; r < readings.size(); ++r)
    if (r != rotor && middle[r] > 0) all.push_back(readings[r][i] / middle[r]);
  return all.empty() ? 1 : log::median(all);
}

/// Share of readings that are missing, or stuck: the same three times and more, while the other rotors moved by more
/// than `stuck_steps`.
double failing(const Readings& readings, const std::array<double, 4>& middle, std::size_t rotor, double step) {
  const auto& own = readings[rotor];
  double bad = 0;
  for (std::size_t begin = 0, end = 0; begin < own.size(); begin = end) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (; end < own.size() && own[end] == own[begin]; ++end) {
      const double others = others_at(readings, middle, rotor, end);
      low = std::min(low, others);
      high = std::max(high, others);
    }
    const std::size_t length = end - begin;
    if (own[begin] < kWindowRules.dropout * middle[rotor])
      bad += static_cast<double>(length);
    else if (length > 2 && (high - low) * middle[rotor] > kWindowRules.stuck_steps * step)
      bad += static_cast<double>(length - 2);
  }
  return bad / static_cast<double>(own.size());
}

/// Puts the channels of failing readings: what all rotors share is the log's own, and no sensor's.
void put_failing(const Readings& readings, const std::array<double, 4>& middle, const std::array<double, 4>& step,
                 std::vector<ChannelValue>& values) {
  std::array<double, 4> share{};
  for (std::size_t r = 0; r < readings.size(); ++r)
    if (!readings[r].empty()) share[r] = failing(readings, middle, r, step[r]);
  for (std::size_t r = 0; r < readings.size(); ++r) {
    std::vector<double> others;
    for (std::size_t k = 0; k < readings.size(); ++k)
      if (k != r && !readings[k].empty()) others.push_back(share[k]);
    if (!readings[r].empty())
      values.push_back({kDropout1 + r, share[r] - (others.empty() ? 0 : log::median(others)), 1});
  }
}

/// Mean of the readings that are not missing: rounding of single ones is spread over them.
double mean_reading(const std::vector<double>& readings, double middle) {
  double sum = 0, count = 0;
  for (const double x : readings)
    if (!(x < kWindowRules.dropout * middle)) {
      sum += x;
      count += 1;
    }
  return sum / count;
}

}  // namespace

RotorPhases rotor_phases(const log::FlightLog& log, const Series& s) {
  RotorPhases phases;
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    if (!log.has(name_of("rpm", rotor))) continue;
    const auto& rpm = log.column(name_of("rpm", rotor));
    auto& phase = phases.phase[rotor];
    phases.step[rotor] = step_of(rpm);
    phase.assign(s.size(), 0);
    for (std::size_t i = 1; i < s.size(); ++i) {
      const double a = rpm[s.row[i - 1]], b = rpm[s.row[i]], c = rpm[s.row[std::min(i + 1, s.size() - 1)]];
      const double middle = std::max(std::min(a, b), std::min(std::max(a, b), c));
      phase[i] = phase[i - 1] + 2 * std::numbers::pi * middle / 60 * (s.t[i] - s.t[i - 1]);
    }
  }
  return phases;
}

std::vector<ChannelValue> rotor_values(const log::FlightLog& log, const Series& s, const RotorPhases& phases,
                                       const Vehicle& vehicle, std::span<const double> residual, std::size_t begin,
                                       std::size_t end, std::size_t turn,
                                       std::array<std::optional<RotorLine>, 4>& lines) {
  std::vector<ChannelValue> values;
  std::array<double, 4> share{}, ratio{}, middle{};
  Readings readings;
  bool motors = true, rpms = true;
  const std::span<const double> t(s.t.data() + begin, end - begin);
  const Rates rates = rates_of(phases, s, begin, end);
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    const bool has_motor = log.has(name_of("motor", rotor)), has_rpm = log.has(name_of("rpm", rotor));
    motors = motors && has_motor;
    rpms = rpms && has_rpm;
    if (has_motor) {
      const auto& motor = log.column(name_of("motor", rotor));
      double sum = 0;
      for (std::size_t i = begin; i < end; ++i)
        sum += thrust_share(vehicle, motor[s.row[i]]) / static_cast<double>(end - begin);
      share[rotor] = std::log(std::max(sum, kWindowRules.least_motor.value));
    }
    if (has_rpm) {
      const auto& rpm = log.column(name_of("rpm", rotor));
      for (std::size_t i = begin; i < end; ++i) readings[rotor].push_back(rpm[s.row[i]]);
      middle[rotor] = log::median(readings[rotor]);
      ratio[rotor] = 2 * std::log(std::max(mean_reading(readings[rotor], middle[rotor]), kWindowRules.least_rpm.value));
      const std::span<const double> phase(phases.phase[rotor].data() + begin, end - begin);
      lines[rotor] = rotor_line(residual, t, phase);
      if (lines[rotor] && speaks(rates, rotor, turn)) values.push_back({kLine1 + rotor, lines[rotor]->excess, 1});
    }
  }
  put_failing(readings, middle, phases.step, values);
  const auto put_contrast = [&](std::size_t channel, const std::array<double, 4>& x) {
    const double mean = (x[0] + x[1] + x[2] + x[3]) / 4;
    for (std::size_t rotor = 0; rotor < 4; ++rotor) values.push_back({channel + rotor, x[rotor] - mean, 1});
  };
  if (motors) put_contrast(kMotor1, share);
  if (motors)
    for (std::size_t rotor = 0; rotor < 4; ++rotor) ratio[rotor] -= share[rotor];
  if (rpms) put_contrast(kRpm1, ratio);
  return values;
}

}  // namespace backwash::study
