// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/reach/response/response_builder.hpp"

namespace backwash::reach {
namespace {

using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

// The sampled loop from one sample instant to the next: z = (p, v, a, measurements not yet used, newest first), a
// measurement being q = −k_p p − k_d v at k dt + `measured_at`, used from (k + `delay`) dt on.
struct SampledLoop {
  explicit SampledLoop(const AxisLoop& loop);
  double feedback(double p, double v) const { return -axis.kp * p - axis.kd * v; }
  // z after a start with position p and velocity v, the measurements of earlier times being `earlier`.
  VectorXd start(double p, double v, double earlier) const {
    VectorXd z = VectorXd::Constant(3 + delay, earlier);
    z.head<3>() << p, v, 0;
    return z;
  }

  AxisLoop axis;
  int delay;                    // periods
  double measured_at;           // s
  MatrixXd A;                   // z(k + 1) = A z(k)
  MatrixXd position, velocity;  // rows: p and v at phases 1 … kPhases from z(k)
};

SampledLoop::SampledLoop(const AxisLoop& loop) : axis(loop) {
  const double periods = loop.feedback_delay / kControlPeriod;
  const double whole = std::floor(periods + 1e-9);
  const double part = periods - whole > 1e-9 ? (periods - whole) * kControlPeriod : 0.0;
  delay = static_cast<int>(whole) + (part > 0 ? 1 : 0);
  measured_at = part > 0 ? kControlPeriod - part : 0.0;

  const int n = 3 + delay;
  RowVectorXd input = RowVectorXd::Zero(n), measured = RowVectorXd::Zero(n);
  if (delay > 0)
    input(n - 1) = 1;
  else {
    input(0) = -axis.kp;
    input(1) = -axis.kd;
  }
  const auto states_at = [&](double t) {  // rows p, v, a from z(k)
    const AxisStep step = axis_step(axis, false, t);
    MatrixXd rows = MatrixXd::Zero(3, n);
    rows.leftCols<3>() = step.E;
    rows += step.F.col(0) * input;
    return rows;
  };
  A = MatrixXd::Zero(n, n);
  A.topRows<3>() = states_at(kControlPeriod);
  if (delay > 0) {
    const MatrixXd x = states_at(measured_at);
    A.row(3) = -axis.kp * x.row(0) - axis.kd * x.row(1);
    for (int i = 4; i < n; ++i) A(i, i - 1) = 1;
  }
  position = velocity = MatrixXd::Zero(kPhases, n);
  for (int phase = 1; phase <= kPhases; ++phase) {
    const MatrixXd x = states_at(phase * kPhase);
    position.row(phase - 1) = x.row(0);
    velocity.row(phase - 1) = x.row(1);
  }
}

// Σ over later steps of the largest |p| at a phase is at most weight·|z|, component by component: over a window,
// |z⁺| ≤ |Aⁿ||z|; y Σ-bounds one window, and y|Aⁿ| ≤ y/2.
RowVectorXd remainder_weight(const SampledLoop& loop) {
  const auto longest = static_cast<int>(kLongestMemory / kControlPeriod);
  RowVectorXd y = RowVectorXd::Zero(loop.A.cols());
  MatrixXd power = MatrixXd::Identity(loop.A.rows(), loop.A.cols());
  for (int k = 1; k <= longest; ++k) {
    y += (loop.position * power).cwiseAbs().colwise().maxCoeff();
    power = loop.A * power;
    if (!(power.cwiseAbs().maxCoeff() < 1e6)) break;
    if (((y * power.cwiseAbs()).array() <= y.array() / 2).all()) return 2 * y;
  }
  refuse(loop.axis, "sampled every 20 ms the loop is unstable or its position gain is too low");
}

// ∫ |·| of a function that is affine over a length, from its end values.
double affine_absolute_integral(double a, double b, double length) {
  if (a * b >= 0) return length * std::abs(a + b) / 2;
  return length * (a * a + b * b) / (2 * (std::abs(a) + std::abs(b)));
}

// Impulses of acceleration at the instants s of one step for which the later motion is affine in s.
struct ImpulseRange {
  double length;
  VectorXd first, last;  // z at the step's end for both ends of the range
};

std::vector<ImpulseRange> impulses(const SampledLoop& loop) {
  const auto after = [&loop](double s, bool measured) {
    VectorXd z = loop.start(kControlPeriod - s, 1, 0);
    if (measured) z[3] = loop.feedback(loop.measured_at - s, 1);
    return z;
  };
  std::vector<ImpulseRange> ranges;
  const double split = loop.measured_at;  // later impulses are not in this step's measurement
  if (split > 0) ranges.push_back({split, after(0, true), after(split, true)});
  ranges.push_back({kControlPeriod - split, after(split, false), after(kControlPeriod, false)});
  return ranges;
}

struct InitialMotion {
  std::vector<double> position;  // at phases
  double largest_input;          // sup |k_p p + k_d v| at phases
  double tail;                   // bound on |p| at phases after the table
};

InitialMotion initial_motion(const SampledLoop& loop, double p, double v, std::size_t steps,
                             const RowVectorXd& weight) {
  InitialMotion motion{{p}, std::abs(loop.feedback(p, v)), 0};
  VectorXd z = loop.start(p, v, loop.feedback(p, v));
  for (std::size_t j = 0; j < steps; ++j) {
    const VectorXd positions = loop.position * z, velocities = loop.velocity * z;
    for (int i = 0; i < kPhases; ++i) {
      motion.position.push_back(positions[i]);
      motion.largest_input = std::max(motion.largest_input, std::abs(loop.feedback(positions[i], velocities[i])));
    }
    z = loop.A * z;
  }
  motion.tail = weight.dot(z.cwiseAbs());
  return motion;
}

}  // namespace

AxisResponse sampled_response(const AxisLoop& axis) {
  const SampledLoop loop(axis);
  const RowVectorXd weight = remainder_weight(loop);
  std::vector<ImpulseRange> ranges = impulses(loop);

  AxisResponse response;
  Eigen::Array<double, kPhases, 1> known, speed;  // Σ_j of the shares of position and velocity at each phase
  for (int i = 0; i < kPhases; ++i) {
    known[i] = std::pow((i + 1) * kPhase, 2) / 2;
    speed[i] = (i + 1) * kPhase;
  }
  response.S.emplace_back();
  std::copy(known.begin(), known.end(), response.S.back().begin());
  do {
    std::array<double, kPhases> shares{};
    response.tail = 0;
    for (ImpulseRange& range : ranges) {
      const VectorXd p0 = loop.position * range.first, p1 = loop.position * range.last;
      const VectorXd v0 = loop.velocity * range.first, v1 = loop.velocity * range.last;
      for (int i = 0; i < kPhases; ++i) {
        shares[i] += affine_absolute_integral(p0[i], p1[i], range.length);
        speed[i] += affine_absolute_integral(v0[i], v1[i], range.length);
      }
      range.first = loop.A * range.first;
      range.last = loop.A * range.last;
      response.tail += range.length / 2 * weight.dot(range.first.cwiseAbs() + range.last.cwiseAbs());
    }
    response.S.push_back(shares);
    for (int i = 0; i < kPhases; ++i) known[i] += shares[i];
  } while (response.tail > kTailShare * known.maxCoeff());

  // Between phases p leaves the chord by at most δ²/8·|ë|, v its nearer end by δ/2·|ë|, and |ë| ≤ 1 + k_p p + k_d v.
  const double h = known.maxCoeff() + response.tail, bow = kPhase * kPhase / 8;
  const double slack = 1 - axis.kp * bow - axis.kd * kPhase / 2;
  response.acceleration_inf = (1 + axis.kp * h + axis.kd * speed.maxCoeff()) / slack;
  response.h_inf = h + bow * response.acceleration_inf;
  response.velocity_inf = speed.maxCoeff() + kPhase / 2 * response.acceleration_inf;

  InitialMotion from_position = initial_motion(loop, 1, 0, response.S.size(), weight);
  InitialMotion from_velocity = initial_motion(loop, 0, 1, response.S.size(), weight);
  response.from_position = std::move(from_position.position);
  response.from_velocity = std::move(from_velocity.position);
  response.from_position_tail = from_position.tail;
  response.from_velocity_tail = from_velocity.tail;
  response.acceleration_from_position = from_position.largest_input / slack;
  response.acceleration_from_velocity = from_velocity.largest_input / slack;
  return response;
}

}  // namespace backwash::reach
