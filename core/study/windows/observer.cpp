// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/observer.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <span>
#include <utility>

#include "core/study/windows/gates/gates.hpp"
#include "core/study/windows/signals/instrument.hpp"
#include "core/study/windows/signals/signals.hpp"

namespace backwash::study {
namespace {

/// Power of gusts of variance 1 and correlation e^{−|t|/τ} at a share of the sampling rate, over that of white
/// noise of variance 1.
double gusts_at(double folded, double dt, double tau) {
  const double a = std::exp(-dt / tau);
  return (1 - a * a) / (1 + a * a - 2 * a * std::cos(2 * std::numbers::pi * folded));
}

/// Σ at each sample over the window's, by lines between the points at which it is known.
std::vector<double> shares_of_samples(const WindowRow& row, SampleRange w) {
  std::vector<double> all(w.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double q = (static_cast<double>(i) + 0.5) / static_cast<double>(all.size()) * kPoints - 0.5,
                 at = std::clamp(q, 0.0, kPoints - 1.0);
    const std::size_t k = std::min(static_cast<std::size_t>(at), kPoints - 2);
    all[i] = kPoints * (row.shares[k] + (at - static_cast<double>(k)) * (row.shares[k + 1] - row.shares[k]));
  }
  return all;
}

/// Without commands the rpm channels hold rpm² alone. That is no value beside windows in which it is over the command:
/// there the others have a gap.
void leave_one_meaning(Observations& seen) {
  const auto measured = [&](Channel c, std::size_t i) { return seen.weight[c][i] > 0; };
  bool over_command = false;
  for (std::size_t i = 0; i < seen.windows.size(); ++i)
    over_command = over_command || (measured(kMotor1, i) && measured(kRpm1, i));
  for (std::size_t i = 0; i < seen.windows.size() && over_command; ++i)
    for (std::size_t r = 0; r < 4; ++r)
      if (!measured(kMotor1, i)) seen.y[kRpm1 + r][i] = seen.weight[kRpm1 + r][i] = 0;
}

}  // namespace

Observer::Observer(const Vehicle& vehicle, const Model& model, const map::OccupancyGrid* grid)
    : vehicle_(vehicle), own_(std::in_place, grid, model), surroundings_(*own_) {}

Observer::Observer(const Vehicle& vehicle, MapView& surroundings) : vehicle_(vehicle), surroundings_(surroundings) {}

void Observer::add(const log::FlightLog& log) {
  const Series s = series_of(log, vehicle_);
  for (const auto& [name, column] : log.columns)
    if (!s.strayed || !name.starts_with("cmd_")) all_.ever.insert(name);
  all_.strayed = all_.strayed || s.strayed;
  ++all_.seen.flights;
  if (static_cast<double>(s.size()) >= kWindowRules.fewest_rows) {
    const auto rotors = rotor_phases(log, s);
    std::vector<SampleRange> good;
    const LogGates gates(log, s.row, vehicle_);
    for (const SampleRange w : cut(s)) {
      auto why = gates(w);
      if (!why) why = unfit(s, log, w);
      if (!why) why = misplaced(s, w);
      if (why)
        ++all_.seen.gated_out[*why];
      else
        good.push_back(w);
    }
    add_windows(log, s, rotors, good);
  }
  all_.seen.first.push_back(all_.seen.windows.size());
}

std::optional<Gate> Observer::misplaced(const Series& s, SampleRange w) const {
  for (const auto* x : {&s.p, &s.p_nominal})
    for (std::size_t i = w.begin; i < w.end && !x->empty(); ++i)
      if (!surroundings_.near((*x)[i])) return Gate::outside;
  if (surroundings_.inside_solid(s.p[(w.begin + w.end) / 2])) return Gate::inconsistent;
  return std::nullopt;
}

void Observer::smooth_voltage() {
  const auto windows = std::span(all_.seen.windows).subspan(all_.seen.first.back());
  std::vector<double> t, volts;
  for (const auto& w : windows) {
    t.push_back(w.t);
    volts.push_back(w.voltage);
  }
  const auto course = slow_course(t, volts);
  for (std::size_t i = 0; i < windows.size(); ++i) windows[i].voltage = course[i];
}

void Observer::put_tails() {
  std::vector<Fourth> whole;
  std::vector<std::size_t> of;
  for (std::size_t i = 0; i < all_.tails.size(); ++i)
    if (all_.tails[i].at_once > 0) {
      whole.push_back(all_.tails[i]);
      of.push_back(i);
    }
  const auto y = tails(whole);
  for (std::size_t i = 0; i < y.size(); ++i) {
    all_.seen.y[kTail][of[i]] = y[i];
    all_.seen.weight[kTail][of[i]] = 1;
  }
}

void Observer::put(const ChannelValue& measured) {
  if (!std::isfinite(measured.value) || !(measured.weight > 0)) return;
  all_.seen.y[measured.channel].back() = measured.value;
  all_.seen.weight[measured.channel].back() = measured.weight;
}

/// Means; returns the detrended residuals.
Residual Observer::put_means(const WindowRow& row, const Series& s, SampleRange w) {
  // What differentiation makes of the noise of positions or velocities is no gust, and its share follows Σ.
  Residual rest{{}, row.sigma, s.has_acceleration && (simulated(s) || !under_way(s, w)), shares_of_samples(row, w)};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const auto residual = [&](std::size_t i) { return s.a[i][axis] - s.a_sim[i][axis]; };
    // Unsimulated, a mean would be the velocity's change and no push. It scatters with the modelled variance; the
    // constant stands for the accelerometer's noise.
    if (simulated(s))
      put({kMeanX + a, mean_over(w, 0.0, residual),
           row.duration / kWindowRules.window_length * kWindowRules.mean_unit /
               (row.sigma[axis] + kWindowRules.mean_noise)});
    rest.x[a] = detrended_values(w, residual);
  }
  return rest;
}

/// ln variances of the last windows, the accelerometer's noise taken out, and what their tails are made of.
void Observer::put_spreads(const std::vector<Residual>& residuals, double rate_hz) {
  const Texture texture = texture_of(residuals, rate_hz);
  const std::size_t first = all_.seen.windows.size() - residuals.size();
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    WindowRow& row = all_.seen.windows[first + i];
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const auto [variance, samples] = spread(residuals[i].x[a]);
      row.measured_variance[axis] = variance;
      if (!residuals[i].comparable || !(variance > 0) || !(samples > 2)) continue;
      const double gusts = std::max(variance - texture.white[axis], kWindowRules.least_gusts * variance);
      const double own = ln_variance(samples) * std::pow(variance / gusts, 2);
      const std::size_t n = residuals[i].x[a].size();
      const double left = left_by_a_line(n, row.duration / static_cast<double>(n - 1), surroundings_.tau_w());
      all_.seen.y[kVarX + a][first + i] = std::log(gusts / (left * row.sigma[axis])) - ln_bias(samples);
      all_.seen.weight[kVarX + a][first + i] = 1 / (own + kWindowRules.scatter2);
    }
    all_.tails.push_back(residuals[i].comparable ? fourth_moments(residuals[i], texture) : Fourth{});
  }
}

void Observer::add_windows(const log::FlightLog& log, const Series& s, const RotorPhases& rotors,
                           const std::vector<SampleRange>& good) {
  std::vector<Residual> residuals;
  for (const SampleRange w : good) {
    for (std::size_t c = 0; c < kChannels; ++c) {
      all_.seen.y[c].push_back(0);
      all_.seen.weight[c].push_back(0);
    }
    all_.seen.windows.push_back(placed(log, s, w, vehicle_, surroundings_));
    WindowRow& row = all_.seen.windows.back();
    row.flight = all_.seen.flights - 1;
    residuals.push_back(put_means(row, s, w));
    if (!s.a_nominal.empty())
      for (const auto& measured : all_.delays.add(s, w, all_.seen.windows.size() - 1, row)) put(measured);
    for (const auto& measured :
         rotor_values(log, s, rotors, vehicle_, residuals.back().x[2], w.begin, w.end, residuals.size(), row.lines))
      put(measured);
    const double dt = row.duration / static_cast<double>(w.size() - 1);
    for (auto& line : row.lines)
      if (line)
        line->floor2 = std::max(0.0, line->floor2 - row.sigma.z() * gusts_at(line->folded, dt, surroundings_.tau_w()));
  }
  const double period = s.t.back() / static_cast<double>(s.size() - 1);
  all_.seen.row_period = std::max(all_.seen.row_period, period);
  put_spreads(residuals, 1 / period);
  smooth_voltage();
}

Observations Observer::finish() {
  all_.seen.units.first = all_.seen.first;
  all_.delays.settle(all_.seen.windows);
  put_tails();
  leave_one_meaning(all_.seen);
  const auto need = [&](Source source, std::initializer_list<const char*> columns) {
    for (const char* column : columns)
      if (!all_.ever.contains(column)) all_.seen.missing.emplace(source, std::string("no ") + column + " column");
  };
  need(Source::acceleration, {"ax_mps2", "ay_mps2", "az_mps2"});
  need(Source::battery, {"battery_v"});
  need(Source::temperature, {"temperature_c"});
  need(Source::attitude, {"qw", "qx", "qy", "qz"});
  need(Source::thrust, {"thrust"});
  if (all_.strayed && !all_.ever.contains("cmd_x_m"))
    all_.seen.missing.emplace(Source::setpoints, "the craft flew elsewhere than the set-points lead");
  need(Source::setpoints, {"cmd_x_m", "cmd_y_m", "cmd_z_m"});
  need(Source::rpm, {"rpm1", "rpm2", "rpm3", "rpm4"});
  need(Source::motors, {"motor1", "motor2", "motor3", "motor4"});
  if (!surroundings_.has_map() && !all_.ever.contains("ceiling"))
    all_.seen.missing.emplace(Source::ceiling, "no map given");
  if (!surroundings_.has_map()) all_.seen.missing.emplace(Source::map, "no map given");
  return std::move(all_.seen);
}

Observations Observer::so_far() const {
  Observer copy(vehicle_, surroundings_);
  copy.all_ = all_;
  return copy.finish();
}

Observed Observer::take() { return std::exchange(all_, {}); }

void Observer::expect(std::size_t windows) {
  const std::size_t all = all_.seen.windows.size() + windows;
  all_.seen.windows.reserve(all);
  for (std::size_t c = 0; c < kChannels; ++c) {
    all_.seen.y[c].reserve(all);
    all_.seen.weight[c].reserve(all);
  }
}

void Observer::add(Observed flights) {
  Observations &seen = all_.seen, &more = flights.seen;
  const std::size_t windows = seen.windows.size();
  for (auto& row : more.windows) row.flight += seen.flights;
  std::ranges::move(more.windows, std::back_inserter(seen.windows));
  for (std::size_t c = 0; c < kChannels; ++c) {
    seen.y[c].insert(seen.y[c].end(), more.y[c].begin(), more.y[c].end());
    seen.weight[c].insert(seen.weight[c].end(), more.weight[c].begin(), more.weight[c].end());
  }
  seen.flights += more.flights;
  for (std::size_t f = 1; f < more.first.size(); ++f) seen.first.push_back(windows + more.first[f]);
  seen.row_period = std::max(seen.row_period, more.row_period);
  for (const auto& [gate, count] : more.gated_out) seen.gated_out[gate] += count;
  all_.delays.add(flights.delays, windows);
  all_.tails.insert(all_.tails.end(), flights.tails.begin(), flights.tails.end());
  all_.ever.merge(flights.ever);
  all_.strayed = all_.strayed || flights.strayed;
}

}  // namespace backwash::study
