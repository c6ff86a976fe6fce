// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/loop/answer_fit.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/study/windows/signals/instrument.hpp"

namespace backwash::study {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSlowTilt =
    0.15;  // s: bell over which residuals are averaged: of a tilt, in which the loop's order shows,
constexpr double kSlowThrust = 0.02;  // and of a thrust, which is what the controller gave
constexpr double kLongest = 0.5;      // s: no craft whose loop is later than this hovers
constexpr double kMostGain = 8.0;     // times the start's, or by it
constexpr int kMostRounds = 40;

/// What is compared: a model's value and the measured one, of an axis at a sample.
struct Compared {
  std::vector<int> axes;
  std::function<std::vector<Vec3>(const AnswerLog&, const VectorXd&)> modelled;
  std::function<Vec3(const Series&, std::size_t)> measured;
  VectorXd start, low, high, step;
  double slow_s;
};

/// The vehicle of some parameters; `late`: the share of its lag that is a pure delay.
Vehicle with(Vehicle vehicle, const VectorXd& theta, bool level, double late) {
  auto& c = vehicle.controller;
  (level ? c.kp.horizontal : c.kp.vertical) = std::exp(theta[0]);
  (level ? c.kd.horizontal : c.kd.vertical) = std::exp(theta[1]);
  if (level) c.latency = theta[2];
  const double lag = theta[level ? 3 : 2];
  c.attitude_lag = (1 - late) * lag;
  c.latency += late * lag;
  c.feedback_delay += late * lag;
  return vehicle;
}

std::vector<Vec3> answer_of(const AnswerLog& log, const Vehicle& vehicle, double forward) {
  const Series& s = log.series;
  auto commands = log.commands;
  for (auto& c : commands) c.a_W *= forward;
  const auto loop = with_command_age(loop::PositionLoop(vehicle), s.t);
  return answers({s.t, s.p, s.v, commands}, loop, std::array{loop.attitude_lag}).front();
}

std::vector<Vec3> positions_of(const AnswerLog& log, const Vehicle& vehicle) {
  const Series& s = log.series;
  return loop_of({s.t, s.p, s.v, log.commands}, with_command_age(loop::PositionLoop(vehicle), s.t)).p;
}

/// slow(…, detrended(x), width) of a window as a matrix: it is asked for thousands of times.
MatrixXd slow_matrix(const Series& s, SampleRange w, double width) {
  const auto n = static_cast<Index>(w.size());
  MatrixXd straight(n, n), bells(n, n);
  for (Index k = 0; k < n; ++k) {
    std::vector<double> unit(w.size(), 0);
    unit[static_cast<std::size_t>(k)] = 1;
    const auto column = detrended(unit);
    straight.col(k) = Eigen::Map<const VectorXd>(column.data(), n);
    for (Index i = 0; i < n; ++i)
      bells(i, k) = bell(s, w.begin + static_cast<std::size_t>(i), w.begin + static_cast<std::size_t>(k), width);
  }
  const VectorXd weights = bells.rowwise().sum();
  return straight * (weights.cwiseInverse().asDiagonal() * bells) * straight;
}

/// Those of a log's windows.
struct FittedLog {
  const AnswerLog& log;
  std::vector<MatrixXd> slow;
};

/// Residuals by window: slow, all axes behind each other.
std::vector<VectorXd> residuals(const Compared& of, const FittedLog& fitted, const VectorXd& theta) {
  const auto model = of.modelled(fitted.log, theta);
  std::vector<VectorXd> all;
  for (std::size_t k = 0; k < fitted.slow.size(); ++k) {
    const SampleRange w = fitted.log.windows[k];
    const auto n = static_cast<Index>(w.size());
    VectorXd r(static_cast<Index>(of.axes.size()) * n), x(n);
    for (std::size_t a = 0; a < of.axes.size(); ++a) {
      const int axis = of.axes[a];
      for (std::size_t i = w.begin; i < w.end; ++i)
        x[static_cast<Index>(i - w.begin)] = of.measured(fitted.log.series, i)[axis] - model[i][axis];
      r.segment(static_cast<Index>(a) * n, n) = fitted.slow[k] * x;
    }
    all.push_back(std::move(r));
  }
  return all;
}

double cost(const std::vector<VectorXd>& r) {
  double sum = 0;
  for (const auto& x : r) sum += x.squaredNorm();
  return sum;
}

Answers::Part linearised(const Compared& of, const FittedLog& log, const VectorXd& theta) {
  const auto here = residuals(of, log, theta);
  const Index n = theta.size();
  std::vector<MatrixXd> J;
  for (const auto& r : here) J.emplace_back(r.size(), n);
  for (Index k = 0; k < n; ++k) {
    VectorXd there = theta;
    there[k] += of.step[k];
    const auto moved = residuals(of, log, there);
    for (std::size_t w = 0; w < here.size(); ++w) J[w].col(k) = (moved[w] - here[w]) / of.step[k];
  }
  Answers::Part part{MatrixXd::Zero(n, n), MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  for (std::size_t w = 0; w < here.size(); ++w) {
    const VectorXd score = J[w].transpose() * here[w];
    part.information += J[w].transpose() * J[w];
    part.scores += score * score.transpose();
    part.gradient += score;
  }
  return part;
}

/// Levenberg and Marquardt, within bounds.
Answers fitted(const Compared& of, std::span<const AnswerLog> given) {
  std::vector<FittedLog> logs;
  for (const auto& log : given) {
    logs.push_back({log, {}});
    for (const auto& w : log.windows) logs.back().slow.push_back(slow_matrix(log.series, w, of.slow_s));
  }
  const auto total = [&](const VectorXd& theta) {
    double sum = 0;
    for (const auto& log : logs) sum += cost(residuals(of, log, theta));
    return sum;
  };
  Answers found{of.start, {}};
  double best = total(of.start), damping = 1e-3;
  for (int round = 0; round < kMostRounds; ++round) {
    found.logs.clear();
    MatrixXd H = MatrixXd::Zero(of.start.size(), of.start.size());
    VectorXd g = VectorXd::Zero(of.start.size());
    for (const auto& log : logs) {
      found.logs.push_back(linearised(of, log, found.theta));
      H += found.logs.back().information;
      g += found.logs.back().gradient;
    }
    bool better = false;
    for (; damping < 1e6 && !better; damping *= better ? 1 : 10) {
      MatrixXd damped = H;
      damped.diagonal() += damping * (H.diagonal().array() + 1e-12 * H.trace()).matrix();
      const VectorXd next = (found.theta - damped.ldlt().solve(g)).cwiseMax(of.low).cwiseMin(of.high);
      const double there = total(next);
      if (!(there < best)) continue;
      better = best - there > 1e-9 * best;
      found.theta = next;
      best = there;
      damping = std::max(1e-6, damping / 10);
      if (!better) return found;
    }
    if (!better) break;
  }
  return found;
}

VectorXd vector(std::initializer_list<double> values) {
  VectorXd v(static_cast<Index>(values.size()));
  std::ranges::copy(values, v.begin());
  return v;
}

/// One more parameter: how much of the commanded acceleration is fed forward. It is 1 in the vehicle file's loop;
/// firmware that hears none has 0, and what a latency is out by shows in it rather than in the gains.
void with_forward(Compared& of) {
  const Index n = of.start.size();
  for (auto* v : {&of.start, &of.low, &of.high, &of.step}) v->conservativeResize(n + 1);
  of.start[n] = 1;
  of.low[n] = -0.5;
  of.high[n] = 2;
  of.step[n] = 0.01;
}

}  // namespace

MatrixXd inverse_of(const MatrixXd& symmetric) {
  const double scale = std::max(1e-300, symmetric.trace());
  return (symmetric + 1e-12 * scale * MatrixXd::Identity(symmetric.rows(), symmetric.cols())).inverse();
}

Answers fit_level(std::span<const AnswerLog> logs, const Vehicle& start, bool by_attitude, double late) {
  const auto& c = start.controller;
  const double kp = std::log(c.kp.horizontal), kd = std::log(c.kd.horizontal), wide = std::log(kMostGain);
  Compared of{{0, 1},
              {},
              {},
              vector({kp, kd, c.latency, std::max(0.01, c.attitude_lag)}),
              vector({kp - wide, kd - wide, 0, 0.002}),
              vector({kp + wide, kd + wide, kLongest, kLongest}),
              vector({0.01, 0.01, 0.002, 0.002}),
              kSlowTilt};
  if (by_attitude) {
    with_forward(of);
    of.modelled = [&start, late](const AnswerLog& log, const VectorXd& t) {
      return answer_of(log, with(start, t, true, late), t[4]);
    };
    of.measured = [](const Series& s, std::size_t i) -> Vec3 {
      const Vec3 up = s.R_WB[i].col(2);
      return up * (kGravity / std::max(0.5, up.z()));
    };
  } else {
    of.modelled = [&start, late](const AnswerLog& log, const VectorXd& t) {
      return positions_of(log, with(start, t, true, late));
    };
    of.measured = [](const Series& s, std::size_t i) { return s.p[i]; };
  }
  return fitted(of, logs);
}

Answers fit_vertical(std::span<const AnswerLog> logs, const Vehicle& start, bool by_thrust, double late) {
  const auto& c = start.controller;
  const double kp = std::log(c.kp.vertical), kd = std::log(c.kd.vertical), wide = std::log(kMostGain);
  Compared of{{2},
              {},
              {},
              vector({kp, kd, std::max(0.01, c.attitude_lag)}),
              vector({kp - wide, kd - wide, 0.002}),
              vector({kp + wide, kd + wide, kLongest}),
              vector({0.01, 0.01, 0.002}),
              by_thrust ? kSlowThrust : kSlowTilt};
  if (by_thrust) {
    with_forward(of);
    of.modelled = [&start, late](const AnswerLog& log, const VectorXd& t) {
      return answer_of(log, with(start, t, false, late), t[3]);
    };
    of.measured = [](const Series& s, std::size_t i) { return s.a_sim[i]; };
  } else {
    of.modelled = [&start, late](const AnswerLog& log, const VectorXd& t) {
      return positions_of(log, with(start, t, false, late));
    };
    of.measured = [](const Series& s, std::size_t i) { return s.p[i]; };
  }
  return fitted(of, logs);
}

}  // namespace backwash::study
