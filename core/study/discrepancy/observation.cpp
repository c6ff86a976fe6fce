// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/discrepancy/observation.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/discrepancy/gates.hpp"
#include "core/study/discrepancy/rotor_channels.hpp"
#include "core/study/discrepancy/series.hpp"
#include "core/study/discrepancy/signals.hpp"

namespace backwash::study::discrepancy {
namespace {

constexpr double kWindow = 2.0;      // s
constexpr double kStray = 0.3;       // m: a craft farther from where its set-points lead does not follow them
constexpr std::size_t kFewest = 20;  // samples of a window

struct Stretch {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

/// Windows of 2 s (to the nearest whole number in each run of rows without a gap and of one segment).
std::vector<Stretch> cut(const Series& s) {
  std::vector<double> spacing;
  for (std::size_t i = 1; i < s.size(); ++i) spacing.push_back(s.t[i] - s.t[i - 1]);
  std::nth_element(spacing.begin(), spacing.begin() + static_cast<std::ptrdiff_t>(spacing.size() / 2), spacing.end());
  const double longest = std::max(0.1, 5 * spacing[spacing.size() / 2]);
  std::vector<Stretch> windows;
  for (std::size_t begin = 0; begin < s.size();) {
    std::size_t end = begin + 1;
    while (end < s.size() && s.segment[end] == s.segment[begin] && s.t[end] - s.t[end - 1] <= longest) ++end;
    const double length = s.t[end - 1] - s.t[begin];
    const auto parts = static_cast<std::size_t>(std::lround(length / kWindow));
    for (std::size_t k = 0; k < parts; ++k) {
      const std::size_t a = begin + k * (end - begin) / parts, b = begin + (k + 1) * (end - begin) / parts;
      if (b - a >= kFewest) windows.push_back({a, b});
    }
    begin = end;
  }
  return windows;
}

template <typename T, typename F>
T mean(Stretch w, T sum, F value) {
  for (std::size_t i = w.begin; i < w.end; ++i) sum += value(i) / static_cast<double>(w.size());
  return sum;
}

/// The attitude without its tilt, which answers the gusts as the thrust does.
Mat3 heading(const Mat3& R_WB) {
  return Eigen::AngleAxisd(std::atan2(R_WB(1, 0), R_WB(0, 0)), Vec3::UnitZ()).toRotationMatrix();
}

/// Σ z·y and Σ z·x of detrended z over √Σz²: one row of an instrumental regression; nothing without excitation.
struct Moment {
  double y = 0, square = 0;
  std::vector<double> z;
  explicit Moment(std::vector<double> instrument) : z(std::move(instrument)) {
    for (const double v : z) square += v * v;
  }
  double with(const std::vector<double>& x) const {
    double sum = 0;
    for (std::size_t i = 0; i < z.size(); ++i) sum += z[i] * x[i];
    return sum / std::sqrt(square);
  }
  bool excited(double least_rms) const { return square > least_rms * least_rms * static_cast<double>(z.size()); }
};

template <typename F>
std::vector<double> detrended_values(Stretch w, F value) {
  std::vector<double> x;
  for (std::size_t i = w.begin; i < w.end; ++i) x.push_back(value(i));
  return detrended(x);
}

/// Slope over the neighbours.
template <typename F>
std::vector<double> rates(const Series& s, Stretch w, F value) {
  std::vector<double> x;
  for (std::size_t i = w.begin; i < w.end; ++i) {
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, s.size() - 1);
    x.push_back((value(b) - value(a)) / (s.t[b] - s.t[a]));
  }
  return detrended(x);
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

Vec3 map_offset(std::size_t k) {
  const double angle = 2 * M_PI * static_cast<double>(k % 8) / 8, length = k < 8 ? 0.15 : 0.3;
  return {length * std::cos(angle), length * std::sin(angle), 0};
}

bool Observations::measured(Channel c) const {
  return std::any_of(weight[c].begin(), weight[c].end(), [](double w) { return w > 0; });
}

Observer::Observer(const Vehicle& vehicle, const Model& model, const map::OccupancyGrid* grid)
    : vehicle_(vehicle), own_(std::in_place, grid, model), surroundings_(*own_) {
  seen_.first.push_back(0);
}

Observer::Observer(const Vehicle& vehicle, Surroundings& surroundings)
    : vehicle_(vehicle), surroundings_(surroundings) {
  seen_.first.push_back(0);
}

void Observer::add(const FlightLog& log) {
  const Series s = series_of(log, vehicle_);
  for (const auto& [name, column] : log.columns) ever_.insert(name);
  const std::size_t flight = seen_.flights++;
  if (s.size() >= kFewest) {
    const auto rotors = rotor_phases(log, s);
    for (const Stretch w : cut(s)) {
      if (const char* why = gate(s, log, w.begin, w.end)) {
        ++seen_.gated_out[why];
        continue;
      }
      if (surroundings_.inside_solid(s.p[(w.begin + w.end) / 2])) {  // the map and the log contradict each other
        ++seen_.gated_out["inconsistent"];
        continue;
      }
      add_window(log, s, rotors, flight, w.begin, w.end);
    }
  }
  seen_.first.push_back(seen_.windows.size());
}

void Observer::put(std::size_t channel, double y, double weight) {
  if (!std::isfinite(y) || !(weight > 0)) return;
  seen_.y[channel].back() = y, seen_.weight[channel].back() = weight;
}

WindowRow Observer::placed(const FlightLog& log, const Series& s, std::size_t begin, std::size_t end) {
  const Stretch w{begin, end};
  WindowRow row{};
  const auto column_mean = [&](const char* name) {
    if (!log.has(name)) return 0.0;
    const auto& column = log.column(name);
    return mean(w, 0.0, [&](std::size_t i) { return column[s.row[i]]; });
  };
  const auto mean_of = [&](const std::vector<Vec3>& x) -> Vec3 {
    return mean(w, Vec3(Vec3::Zero()), [&](std::size_t i) -> Vec3 { return x[i]; });
  };
  row.segment = s.segment[begin];
  row.t = 0.5 * (s.t[begin] + s.t[end - 1]);
  row.duration = s.t[end - 1] - s.t[begin];
  // A gust that pushes the craft up is in its mean residual and in its measured height: a place that answers the gusts
  // would explain them. Where the set-points lead is known without them, unless the craft flies elsewhere.
  const bool as_told = !s.p_nominal.empty() && (mean_of(s.p_nominal) - mean_of(s.p)).norm() < kStray;
  const auto &p = as_told ? s.p_nominal : s.p, &v = as_told ? s.v_nominal : s.v;
  row.p_W = mean_of(p), row.v_W = mean_of(v);
  // The mean of the measured speed would hold every gust rectified: without set-points, the way made good.
  row.speed = as_told ? mean(w, 0.0, [&](std::size_t i) { return v[i].norm(); }) : row.v_W.norm();
  row.R_WB = Mat3::Zero();
  if (!s.R_WB.empty()) row.R_WB = mean(w, Mat3(Mat3::Zero()), [&](std::size_t i) { return heading(s.R_WB[i]); });
  row.yaw = std::atan2(row.R_WB(1, 0), row.R_WB(0, 0));
  row.thrust_acc = s.thrust_acc.empty() ? kGravity : mean(w, 0.0, [&](std::size_t i) { return s.thrust_acc[i]; });
  row.voltage = column_mean("battery_v"), row.temperature = column_mean("temperature_c");
  row.around = surroundings_.around(row.p_W);
  if (!surroundings_.has_map()) {  // imported recordings say what stood below and above (backwash import)
    if (log.has("surface_z_m")) row.around.height = row.p_W.z() - column_mean("surface_z_m");
    if (log.has("ceiling") && column_mean("ceiling") > 0.5) row.around.ceiling_gap = 0.3;
  }
  constexpr std::size_t kPoints = 7;  // along the window: a moving vehicle crosses different air
  row.sigma = Vec3::Zero();
  for (std::size_t k = 0; k < kPoints; ++k)
    row.sigma += surroundings_.sigma(p[begin + (2 * k + 1) * w.size() / (2 * kPoints)]) / kPoints;
  const Vec3 here = surroundings_.sigma(row.p_W);
  for (std::size_t k = 0; k < kMapOffsets; ++k)
    row.ln_sigma_moved[k] =
        (surroundings_.sigma(row.p_W + map_offset(k)).array() / here.array()).log().max(-2.0).min(2.0);
  return row;
}

/// Means, ln variances and the tail; returns the detrended vertical residual.
std::vector<double> Observer::put_moments(WindowRow& row, const Series& s, std::size_t begin, std::size_t end) {
  const Stretch w{begin, end};
  const bool comparable = simulated(s) || !under_way(s, begin, end);
  double tail = 0;
  std::vector<double> vertical;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const auto residual = [&](std::size_t i) { return s.a[i][axis] - s.a_sim[i][axis]; };
    // Unsimulated, a mean would be the velocity's change and no push. It scatters with the modelled variance; the
    // constant stands for the accelerometer's noise.
    if (simulated(s))
      put(kMeanX + a, mean(w, 0.0, residual), row.duration / kWindow * 0.01 / (row.sigma[axis] + kMeanNoise));
    const auto x = detrended_values(w, residual);
    const auto [variance, samples] = spread(x);
    row.measured_variance[axis] = variance;
    if (comparable && variance > 0 && samples > 2) {
      const double own = ln_variance(samples);
      put(kVarX + a, std::log(variance / row.sigma[axis]) - ln_bias(samples), 1 / (own + kScatter2));
    }
    tail += excess_tail(x, 3) / 3;
    if (axis == 2) vertical = x;
  }
  if (comparable) put(kTail, tail, 1);
  return vertical;
}

/// How late and how steeply thrust and commands act.
void Observer::put_delays(WindowRow& row, const Series& s, std::size_t begin, std::size_t end) {
  const Stretch w{begin, end};
  const auto nominal = [&](int axis) { return [&s, axis](std::size_t i) { return s.a_nominal[i][axis]; }; };
  if (s.simulated_by_thrust) {
    // Instrument and design both come from the set-points alone: the logged thrust also answers the gusts, and a
    // design that shares their noise with the residual would be biased.
    const auto r = detrended_values(w, [&](std::size_t i) { return s.R_WB[i].col(2).dot(s.a[i] - s.a_sim[i]); });
    const auto rate = rates(s, w, nominal(2)), level = detrended_values(w, nominal(2));
    const Moment delay(rate), slope(level);
    if (delay.excited(0.05)) {
      row.delay_gain = {-delay.with(rate), delay.with(level)};
      put(kThrustDelay, delay.with(r), 1);
    }
    if (slope.excited(0.05)) {
      row.slope_gain = {-slope.with(rate), slope.with(level)};
      put(kThrustSlope, slope.with(r), 1);
    }
  }
  double y_h = 0, g_h = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Moment m(rates(s, w, nominal(axis)));
    if (!m.excited(0.05)) continue;
    const auto late = detrended_values(w, [&](std::size_t i) { return s.a[i][axis] - s.a_nominal[i][axis]; });
    const double y = m.with(late), gain = -std::sqrt(m.square);
    if (axis < 2) y_h += y * gain, g_h += gain * gain;
    if (axis == 2) put(kCommandDelayZ, y, 1), row.command_gain[1] = gain;
  }
  if (g_h > 0) put(kCommandDelayH, y_h / std::sqrt(g_h), 1), row.command_gain[0] = std::sqrt(g_h);
}

void Observer::add_window(const FlightLog& log, const Series& s, const RotorPhases& rotors, std::size_t flight,
                          std::size_t begin, std::size_t end) {
  for (std::size_t c = 0; c < kChannels; ++c) seen_.y[c].push_back(0), seen_.weight[c].push_back(0);
  WindowRow row = placed(log, s, begin, end);
  row.flight = flight;
  const auto vertical = put_moments(row, s, begin, end);
  if (!s.a_nominal.empty()) put_delays(row, s, begin, end);
  for (const auto& [channel, value, weight] : rotor_values(log, s, rotors, vehicle_, vertical, begin, end))
    put(channel, value, weight);
  seen_.windows.push_back(std::move(row));
}

Observations Observer::finish() {
  const auto need = [&](const std::string& name, std::initializer_list<const char*> columns) {
    for (const char* column : columns)
      if (!ever_.contains(column)) seen_.missing.emplace(name, std::string("no ") + column + " column");
  };
  need("battery", {"battery_v"});
  need("temperature", {"temperature_c"});
  need("attitude", {"qw", "qx", "qy", "qz"});
  need("thrust", {"thrust"});
  need("setpoints", {"cmd_x_m", "cmd_y_m", "cmd_z_m"});
  need("rpm", {"rpm1", "rpm2", "rpm3", "rpm4"});
  need("motors", {"motor1", "motor2", "motor3", "motor4"});
  if (!surroundings_.has_map() && !ever_.contains("ceiling")) seen_.missing.emplace("ceiling", "no map given");
  if (!surroundings_.has_map()) seen_.missing.emplace("map", "no map given");
  return std::move(seen_);
}

}  // namespace backwash::study::discrepancy
