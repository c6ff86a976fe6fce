// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/observation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "core/study/windows/gates/gates.hpp"
#include "core/study/windows/signals/instrument.hpp"
#include "core/study/windows/signals/rotor_channels.hpp"
#include "core/study/windows/signals/series.hpp"
#include "core/study/windows/signals/signals.hpp"
#include "core/study/windows/signals/texture.hpp"
#include "core/study/windows/stretch.hpp"

namespace backwash::study {
namespace {

template <typename T, typename F>
T mean(SampleRange w, T sum, F value) {
  for (std::size_t i = w.begin; i < w.end; ++i) sum += value(i) / static_cast<double>(w.size());
  return sum;
}

/// Power of gusts of variance 1 and correlation e^{−|t|/τ} at a share of the sampling rate, over that of white
/// noise of variance 1.
double gusts_at(double folded, double dt, double tau) {
  const double a = std::exp(-dt / tau);
  return (1 - a * a) / (1 + a * a - 2 * a * std::cos(2 * std::numbers::pi * folded));
}

/// The attitude without its tilt, which answers the gusts as the thrust does.
Mat3 heading(const Mat3& R_WB) {
  return Eigen::AngleAxisd(std::atan2(R_WB(1, 0), R_WB(0, 0)), Vec3::UnitZ()).toRotationMatrix();
}

}  // namespace

const char* channel_name(Channel c) {
  static const char* const kNames[] = {"mean x",
                                       "mean y",
                                       "mean z",
                                       "ln variance x",
                                       "ln variance y",
                                       "ln variance z",
                                       "tail",
                                       "thrust delay",
                                       "thrust slope",
                                       "command delay, level",
                                       "command delay, z",
                                       "tilt delay",
                                       "line 1",
                                       "line 2",
                                       "line 3",
                                       "line 4",
                                       "motor 1",
                                       "motor 2",
                                       "motor 3",
                                       "motor 4",
                                       "rpm 1",
                                       "rpm 2",
                                       "rpm 3",
                                       "rpm 4",
                                       "dropout 1",
                                       "dropout 2",
                                       "dropout 3",
                                       "dropout 4"};
  return kNames[c];
}

bool Observations::measured(Channel c) const {
  return std::any_of(weight[c].begin(), weight[c].end(), [](double w) { return w > 0; });
}

Observer::Observer(const Vehicle& vehicle, const Model& model, const map::OccupancyGrid* grid)
    : vehicle_(vehicle), own_(std::in_place, grid, model), surroundings_(*own_) {
  all_.seen.first.push_back(0);
}

Observer::Observer(const Vehicle& vehicle, MapView& surroundings) : vehicle_(vehicle), surroundings_(surroundings) {
  all_.seen.first.push_back(0);
}

void Observer::add(const log::FlightLog& log) {
  const Series s = series_of(log, vehicle_);
  for (const auto& [name, column] : log.columns)
    if (!s.strayed || !name.starts_with("cmd_")) all_.ever.insert(name);
  all_.strayed = all_.strayed || s.strayed;
  ++all_.seen.flights;
  if (static_cast<double>(s.size()) >= kWindowRules.fewest_rows) {
    const auto rotors = rotor_phases(log, s);
    std::vector<SampleRange> good;
    const WindowOptions options;
    const LogGates gates(log, s.row, vehicle_, options);
    for (const SampleRange w : cut(s)) {
      auto why = gates(w);
      if (!why) why = unfit(s, log, w, options);
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

void Observer::put(std::size_t channel, double y, double weight) {
  if (!std::isfinite(y) || !(weight > 0)) return;
  all_.seen.y[channel].back() = y;
  all_.seen.weight[channel].back() = weight;
}

WindowRow Observer::placed(const log::FlightLog& log, const Series& s, SampleRange w) {
  WindowRow row{};
  const auto column_mean = [&](const char* name) {
    if (!log.has(name)) return 0.0;
    const auto& column = log.column(name);
    return mean(w, 0.0, [&](std::size_t i) { return column[s.row[i]]; });
  };
  const auto mean_of = [&](const std::vector<Vec3>& x) -> Vec3 {
    return mean(w, Vec3(Vec3::Zero()), [&](std::size_t i) -> Vec3 { return x[i]; });
  };
  row.segment = s.segment[w.begin];
  row.t = 0.5 * (s.t[w.begin] + s.t[w.end - 1]);
  row.duration = s.t[w.end - 1] - s.t[w.begin];
  // A gust that pushes the craft up is in its mean residual and in its measured height: a place that answers the gusts
  // would explain them. Where the set-points lead is known without them, unless the craft flies elsewhere.
  const bool as_told = !s.p_nominal.empty() && (mean_of(s.p_nominal) - mean_of(s.p)).norm() < kWindowRules.stray;
  const auto &p = as_told ? s.p_nominal : s.p, &v = as_told ? s.v_nominal : s.v;
  row.p_W = mean_of(p), row.v_W = mean_of(v);
  row.give = as_told ? Vec3(loop::PositionLoop(vehicle_).kp.cwiseInverse()) : Vec3(Vec3::Zero());
  row.held_off = vehicle_.controller.velocity_integrator.horizontal > 0;
  if (as_told) row.slowed = (row.v_W - mean_of(s.v_dragged)) / kWindowRules.loop_drag;
  const auto varied2 = [&](const std::vector<Vec3>& x) {
    Vec3 square = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis)
      for (const double off : detrended_values(w, [&](std::size_t i) { return x[i][axis]; }))
        square[axis] += off * off / static_cast<double>(w.size());
    return square;
  };
  row.varied2 = varied2(v);
  if (as_told) {
    row.asked_W = mean_of(s.a_nominal);
    row.asked2 = varied2(s.a_nominal);
  }
  row.off_W = as_told ? Vec3(mean_of(s.p) - row.p_W) : Vec3(Vec3::Zero());
  // The mean of the measured speed would hold every gust rectified: without set-points, the way made good.
  row.speed = as_told ? mean(w, 0.0, [&](std::size_t i) { return v[i].norm(); }) : row.v_W.norm();
  row.R_WB = Mat3::Zero();
  if (!s.R_WB.empty()) row.R_WB = mean(w, Mat3(Mat3::Zero()), [&](std::size_t i) { return heading(s.R_WB[i]); });
  row.yaw = std::atan2(row.R_WB(1, 0), row.R_WB(0, 0));
  row.thrust_acc = s.thrust_acc.empty() ? kGravity : mean(w, 0.0, [&](std::size_t i) { return s.thrust_acc[i]; });
  row.voltage = column_mean("battery_v");
  row.temperature = column_mean("temperature_c");
  row.around = surroundings_.around(row.p_W);
  if (!surroundings_.has_map()) {  // imported recordings say what stood below and above (backwash import)
    if (log.has("surface_z_m")) row.around.height = row.p_W.z() - column_mean("surface_z_m");
    if (log.has("ceiling") && column_mean("ceiling") > kWindowRules.yes)
      row.around.ceiling_gap = kWindowRules.said_ceiling;
  }
  look_along(row, w, p, v);
  if (!as_told) row.speeds.fill(row.speed);
  return row;
}

/// Means; returns the detrended residuals.
Residual Observer::put_means(const WindowRow& row, const Series& s, SampleRange w) {
  // What differentiation makes of the noise of positions or velocities is no gust, and its share follows Σ.
  Residual rest{{}, row.sigma, s.has_acceleration && (simulated(s) || !under_way(s, w))};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const auto residual = [&](std::size_t i) { return s.a[i][axis] - s.a_sim[i][axis]; };
    // Unsimulated, a mean would be the velocity's change and no push. It scatters with the modelled variance; the
    // constant stands for the accelerometer's noise.
    if (simulated(s))
      put(kMeanX + a, mean(w, 0.0, residual),
          row.duration / kWindowRules.window_length * kWindowRules.mean_unit /
              (row.sigma[axis] + kWindowRules.mean_noise));
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
    all_.seen.windows.push_back(placed(log, s, w));
    WindowRow& row = all_.seen.windows.back();
    row.flight = all_.seen.flights - 1;
    residuals.push_back(put_means(row, s, w));
    if (!s.a_nominal.empty()) put_delays(s, w);
    for (const auto& [channel, value, weight] :
         rotor_values(log, s, rotors, vehicle_, residuals.back().x[2], w.begin, w.end, residuals.size(), row.lines))
      put(channel, value, weight);
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

void Observations::group(const std::vector<double>& by_flight) {
  units = {};
  for (std::size_t f = 0; f < by_flight.size(); ++f)
    if (f + 1 == by_flight.size() || by_flight[f + 1] != by_flight[f]) units.first.push_back(first[f + 1]);
}

Observations Observer::finish() {
  all_.seen.units.first = all_.seen.first;
  follow_thrust();
  settle_commands();
  put_tails();
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

}  // namespace backwash::study
