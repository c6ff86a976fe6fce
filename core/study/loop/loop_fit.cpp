// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/loop/loop_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/log/columns/log_columns.hpp"
#include "core/study/loop/answer_fit.hpp"
#include "core/study/windows/gates/gates.hpp"
#include "core/study/windows/signals/distributions.hpp"

namespace backwash::study {
namespace {

constexpr std::array<std::string_view, kLoopKeys> kNames{"controller.kp.horizontal", "controller.kd.horizontal",
                                                         "controller.latency",       "controller.attitude_lag",
                                                         "controller.kp.vertical",   "controller.kd.vertical"};
constexpr double kConfidence = 0.9;
constexpr int kRounds = 2;  // of vertical and level fit in turn
/// Of a gain's logarithm and of a delay, s: a log whose own interval is wider says nothing of it.
const double kUselessGain = std::log(2);
constexpr double kUselessDelay = 0.05;
/// What a loop of another form than both adds to half an interval, of a gain and of a delay, s: measured with
/// tests/nightly/vehicle_fit.py, other hands, seeds 1 to 20.
constexpr double kOtherGain = 0.01, kOtherDelay = 0.001;

/// What a key is among the parameters of a problem, and how its value comes of one.
struct Told {
  LoopKey key;
  Eigen::Index at;
  bool gain;
};
constexpr std::array<Told, 4> kLevelKeys{
    {{kKpLevel, 0, true}, {kKdLevel, 1, true}, {kLatency, 2, false}, {kLag, 3, false}}};
constexpr std::array<Told, 2> kUpKeys{{{kKpUp, 0, true}, {kKdUp, 1, true}}};

tl::expected<AnswerLog, LoopError> opened(const LoopLog& given, const Vehicle& vehicle) {
  const auto& log = *given.log;
  const auto bad = [&](const char* what) { return tl::make_unexpected(LoopError{given.name, what}); };
  if (!has_xyz(log, "", "_m")) return bad("has no positions x_m, y_m, z_m");
  if (!has_xyz(log, "cmd_", "_m")) return bad("has no set-points cmd_x_m, cmd_y_m, cmd_z_m");
  AnswerLog one{series_of(log, vehicle), {}, {}};
  if (one.series.strayed) return bad("was flown elsewhere than its set-points say");
  if (one.series.size() < 2) return bad("has fewer than two rows");
  one.commands = commands_of(log, one.series.row);
  const LogGates gates(log, one.series.row, vehicle);
  for (const auto& w : cut(one.series))
    if (!gates(w)) one.windows.push_back(w);
  if (one.windows.size() < 5) return bad("holds less than 10 s in the air that can be used");
  return one;
}

/// Standard error of each parameter, of windows and of logs left out in turn, whichever gives the wider interval: half
/// of it.
Eigen::VectorXd half_widths(const Answers& fitted, std::size_t windows) {
  const auto n = static_cast<double>(fitted.logs.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(fitted.theta.size(), fitted.theta.size()), S = H;
  for (const auto& part : fitted.logs) {
    H += part.information;
    S += part.scores;
  }
  const Eigen::MatrixXd inverse = inverse_of(H), cov = inverse * S * inverse;
  std::vector<Eigen::VectorXd> without;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(fitted.theta.size());
  for (const auto& part : fitted.logs) {
    without.push_back(inverse_of(H - part.information) * part.gradient);
    mean += without.back() / n;
  }
  Eigen::VectorXd jackknife = Eigen::VectorXd::Zero(fitted.theta.size());
  for (const auto& shift : without) jackknife += (n - 1) / n * (shift - mean).cwiseAbs2();
  const double of_windows = student_quantile(0.5 + kConfidence / 2, static_cast<double>(windows)),
               of_logs = student_quantile(0.5 + kConfidence / 2, n - 1);
  return (of_windows * cov.diagonal().cwiseSqrt()).cwiseMax(of_logs * jackknife.cwiseSqrt());
}

/// Half the interval of each parameter by one log alone, its residuals as scattered as all.
Eigen::VectorXd alone(const Answers& fitted, const Answers::Part& part) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(fitted.theta.size(), fitted.theta.size()), S = H;
  for (const auto& other : fitted.logs) {
    H += other.information;
    S += other.scores;
  }
  const double scatter = (inverse_of(H) * S).trace() / static_cast<double>(fitted.theta.size());
  return student_quantile(0.5 + kConfidence / 2, 30) * (scatter * inverse_of(part.information).diagonal()).cwiseSqrt();
}

void tell(LoopFit& fit, const Answers& fitted, const Answers& other, std::span<const Told> told,
          std::span<const LoopLog> logs, double unknowable) {
  const Eigen::VectorXd form = 0.5 * (other.theta - fitted.theta), middle = fitted.theta + form,
                        half = half_widths(fitted, fit.windows) + form.cwiseAbs();
  for (const auto& [key, at, gain] : told) {
    bool excited = true;
    for (std::size_t n = 0; n < logs.size(); ++n) {
      if (alone(fitted, fitted.logs[n])[at] <= (gain ? kUselessGain : kUselessDelay)) continue;
      fit.unexcited.push_back({logs[n].name, key});
      excited = false;
    }
    if (!excited) continue;
    const double value = middle[at], wide = half[at] + (gain ? kOtherGain : kOtherDelay) +
                                            (key == kLatency || (key == kLag && !fit.by_attitude) ? unknowable : 0);
    fit.keys[key] = gain ? LoopEstimate{std::exp(value), std::exp(value - wide), std::exp(value + wide)}
                         : LoopEstimate{value, std::max(0.0, value - wide), value + wide};
  }
}

}  // namespace

std::string_view name_of(LoopKey key) { return kNames[key]; }

double value_of(const Vehicle& vehicle, LoopKey key) {
  const auto& c = vehicle.controller;
  const std::array<double, kLoopKeys> values{c.kp.horizontal, c.kd.horizontal, c.latency,
                                             c.attitude_lag,  c.kp.vertical,   c.kd.vertical};
  return values[key];
}

tl::expected<LoopFit, LoopError> fit_loop(std::span<const LoopLog> logs, const Vehicle& start) {
  std::vector<AnswerLog> opened_logs;
  LoopFit fit;
  fit.by_attitude = fit.by_thrust = true;
  double period = 0;
  for (const auto& log : logs) {
    auto one = opened(log, start);
    if (!one) return tl::make_unexpected(one.error());
    fit.by_attitude = fit.by_attitude && !one->series.R_WB.empty();
    fit.by_thrust = fit.by_thrust && one->series.simulated_by_thrust;
    fit.windows += one->windows.size();
    period = std::max(period, one->series.t.back() / static_cast<double>(one->series.size() - 1));
    opened_logs.push_back(std::move(*one));
  }
  std::array<Answers, 2> level, up;  // by a lag of first order, and by one of which half is a pure delay
  for (const std::size_t k : {0u, 1u}) {
    const double late = 0.5 * static_cast<double>(k);
    // The force that the tilt turns is the vertical loop's, and what that hears is as late as the level one.
    Vehicle so_far = start;
    for (int round = 0; round < kRounds; ++round) {
      up[k] = fit_vertical(opened_logs, so_far, fit.by_thrust, late);
      so_far.controller.kp.vertical = std::exp(up[k].theta[0]);
      so_far.controller.kd.vertical = std::exp(up[k].theta[1]);
      level[k] = fit_level(opened_logs, so_far, fit.by_attitude, late);
      so_far.controller.latency = level[k].theta[2];
    }
  }
  tell(fit, level[0], level[1], kLevelKeys, logs, period / 4);
  tell(fit, up[0], up[1], kUpKeys, logs, 0);
  return fit;
}

}  // namespace backwash::study
