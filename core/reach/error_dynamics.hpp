// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::reach {

/// Which closed loop the sets are exact for (model.md section 4, "The loop").
enum class Loop {
  vehicle,     ///< continuous feedback with the vehicle's feedback delay and attitude lag: what flies
  continuous,  ///< the paper's second-order loop ë = −k_p e − k_d ė + w
  sampled,     ///< the vehicle's loop with the feedback computed every 20 ms and held
};

/// One axis of the error dynamics: ė_p = e_v, ė_v = a + w, lag·ȧ = u − a, u = −k_p e_p(t − delay) − k_d e_v(t − delay).
struct AxisLoop {
  double kp;              ///< 1/s²
  double kd;              ///< 1/s
  double feedback_delay;  ///< s, ≥ 0
  double attitude_lag;    ///< s, ≥ 0; 0: a = u
};

/// The horizontal or vertical axis of a vehicle, as `loop` sees it (continuous: delay and lag dropped).
AxisLoop axis_loop(const Vehicle& vehicle, bool vertical, Loop loop);

/// Response of one axis, sampled so that exact supports become a sum (model.md section 5.2):
///   h(k dt) = √(q_p² r_p(k)² + q_v² r_v(k)²) + Σ_j w̄_{k−1−j} G_j,   G_j = ∫_{j dt}^{(j+1) dt} |g|,
/// with g the impulse response from acceleration to position. All vectors have one entry per step of dt = 20 ms,
/// or kPhases entries per step where the name says so.
struct AxisResponse {
  static constexpr int kPhases = 8;   ///< sub-steps per period at which sets between samples are evaluated
  std::vector<double> G;              ///< G_j, s² (m per m/s²), j = 0 … N − 1
  std::vector<double> P;              ///< P(m dt/kPhases) = ∫_0 |g|, s², m = 0 … N·kPhases: for sets between samples
  std::vector<double> from_position;  ///< position at m dt/kPhases after a unit position error at 0
  std::vector<double> from_velocity;  ///< position at m dt/kPhases after a unit velocity error at 0, s
  double tail;                        ///< bound on Σ_{j ≥ N} G_j, s²; below 1e-6 h_inf
  double h_inf;                       ///< Σ_j G_j + tail, s²: hover half width for w̄ = 1 m/s²
  double velocity_inf;                ///< ∫ |ġ|, s: velocity half width for w̄ = 1 m/s², bounds growth between phases
};

/// Computes the response of an axis. Accuracy 1e-6 relative. Errors: throws std::invalid_argument for gains, delay and
/// lag whose loop is unstable (no finite support exists).
AxisResponse axis_response(const AxisLoop& axis, Loop loop);

/// Predicted motion of the vehicle under held, delayed commands without disturbance: the centre of the sets
/// (model.md section 4, "Centre"). The set-point is held for one period and reaches the controller `latency` later; the
/// acceleration follows with the first-order attitude lag. Propagated exactly (matrix exponential).
class CentrePredictor {
 public:
  /// Starts at `start` with acceleration `a_W` (m/s², the commanded one when in doubt); `previous` is the command that
  /// is active until the first new one arrives.
  CentrePredictor(const Vehicle& vehicle, Loop loop, const State& start, const Vec3& a_W, const Setpoint& previous);
  /// Issues the command of the next period and moves on by 20 ms. Real-time: wait-free, no allocation.
  State step(const Setpoint& command) noexcept;
  const State& state() const noexcept { return state_; }
  const Vec3& acceleration() const noexcept { return a_W_; }

 private:
  // One period of an axis: x⁺ = A x + b_old·r_old + b_new·r_new with x = (p, v, a) and r = k_p p_cmd + k_d v_cmd + a_cmd.
  struct AxisStep {
    Eigen::Matrix3d A;
    Eigen::Vector3d b_old, b_new;
  };
  static constexpr int kMaxDelaySteps = 16;
  AxisStep horizontal_, vertical_;
  Eigen::Vector2d kp_, kd_;  // horizontal, vertical
  int delay_steps_;          // whole periods of latency
  std::array<Vec3, kMaxDelaySteps + 2> r_;  // recent r, newest first
  State state_;
  Vec3 a_W_;
};

}  // namespace backwash::reach
