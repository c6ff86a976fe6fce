// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "core/reach/response/axis_step.hpp"
#include "core/reach/response/delay_recursion.hpp"
#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::reach {

/// Which closed loop the sets are exact for (docs/model.md section 4, "Loop").
enum class Loop {
  vehicle,     ///< continuous feedback with the vehicle's feedback delay and attitude lag: what flies
  continuous,  ///< the paper's second-order loop ë = −k_p e − k_d ė + w
  sampled,     ///< the vehicle's loop with the feedback computed every 20 ms and held
};

/// The horizontal or vertical axis of a vehicle, as `loop` sees it (continuous: delay and lag dropped).
AxisLoop axis_loop(const Vehicle& vehicle, bool vertical, Loop loop);

/// Response of one axis, sampled so that exact supports become a sum (docs/model.md section 5.2):
///   h(k dt) = √(q_p² r_p(k)² + q_v² r_v(k)²) + Σ_j w̄_{k−1−j} G_j,   G_j = ∫_{j dt}^{(j+1) dt} |g|,
/// with g the impulse response from acceleration to position. Under sampled feedback g depends on the instant s of the
/// impulse within its step, and G_j = ∫₀^dt |g((j + 1) dt, s)| ds. Tables have one entry per step of dt = 20 ms or,
/// where the name says phase, kPhases per step.
struct AxisResponse {
  static constexpr int kPhases = 8;  ///< sub-steps per period at which sets between samples are evaluated
  std::vector<double> G;             ///< G_j, s² (m per m/s²), j = 0 … N − 1
  /// Share of a step of age j (whole steps from its start to the current sample) in the half width at phase φ = 1 … 8
  /// after that sample, s²: S[j][φ − 1]; S[j][7] = G_j. Age 0 is the step in progress.
  std::vector<std::array<double, kPhases>> S;
  /// Half width at m dt/kPhases under w̄ = 1 m/s² from time 0, s², m = 0 … N·kPhases (continuous feedback: ∫₀ |g|).
  std::vector<double> P;
  std::vector<double> from_position;  ///< r_p: position at m dt/kPhases after a unit position error at 0
  std::vector<double> from_velocity;  ///< r_v: position at m dt/kPhases after a unit velocity error at 0, s
  double tail;                        ///< bound on the shares of all steps of age ≥ N at any time, s²; < 1e-6 h_inf
  double from_position_tail;          ///< bound on |r_p| after the table's end
  double from_velocity_tail;          ///< bound on |r_v| after the table's end, s
  double h_inf;                       ///< hover half width for w̄ = 1 m/s² at any time (Σ_j G_j + tail), s²
  double velocity_inf;                ///< velocity half width for w̄ = 1 m/s² (∫ |ġ|), s
  /// Bounds on |ë| per unit of w̄ (m/s²), of initial position error (m) and of initial velocity error (m/s): they limit
  /// how far the position leaves the chord between two phases, δ²/8·|ë|.
  double acceleration_inf, acceleration_from_position, acceleration_from_velocity;
  /// How far the shares of past steps pass the chord over a step, s²: at phase φ = m/kPhases, for every age j ≥ 1,
  ///   S_j(φ) ≤ (1 − φ) G_{j−1} + φ G_j + 4 φ (1 − φ) chord_excess·chord_decay^{j−1}.
  double chord_excess = 0, chord_decay = 0;
  /// The same supports by the delay recursion, where the loop has it: second order and continuous.
  std::optional<DelayRecursion> delay;
};

inline constexpr double kMinFeedbackDelay = 1e-4;  ///< s

/// Computes the response of an axis. Loop::vehicle and Loop::continuous: continuous feedback with the axis' own delay
/// and lag. Loop::sampled: u is computed at the instants k dt from the error at k dt − delay and held for dt; the steps
/// of the disturbance begin at these instants. Initial errors: e_p(0) and e_v(0) are held constant for t < 0 (what the
/// delayed feedback sees), the error of the acceleration is 0. Delays below kMinFeedbackDelay but not 0 count as that.
/// Accuracy 1e-6 relative (1e-9 without delay). Tens of milliseconds. Errors: throws std::invalid_argument, naming
/// gains, delay and lag, if the loop is unstable or does not contract within two minutes (no useful support exists).
AxisResponse axis_response(const AxisLoop& axis, Loop loop);

/// Acceleration that the controller commands in a state, a_cmd + k_p (p_cmd − p) + k_d (v_cmd − v), m/s²: the start of
/// CentrePredictor for which the sets' assumption holds that the acceleration's error is 0 at first.
Vec3 commanded_acceleration(const Vehicle& vehicle, const State& state, const Setpoint& command) noexcept;

/// Predicted motion of the vehicle under held, delayed commands without disturbance: the centre of the sets
/// (docs/model.md section 4, "Centre"):  lag·ȧ = r(t) − k_p p(t − δ) − k_d v(t − δ) − a,  r = k_p p_cmd + k_d v_cmd +
/// a_cmd. The set-point is held for one period and acts `latency` later: in a period the older command acts for the
/// remainder of latency/dt, then the newer one. attitude_lag 0: the acceleration is the right-hand side at once.
/// Loop::continuous drops lag and delay δ, not the latency. Loop::sampled: feedback of the state at k dt − δ, held for
/// dt; the set-point part still switches in the period. Before the start the state is held constant for the delayed
/// feedback, and `previous` is the active command. Exact (matrix exponentials) without delay and for Loop::sampled;
/// continuous feedback with delay: steps of at most 1 ms with cubic interpolation of the feedback, within 1e-6 m.
class CentrePredictor {
 public:
  static constexpr int kMaxDelaySteps = 16;  ///< longest latency and feedback delay, periods

  /// Starts at `start` with acceleration `a_W` (m/s²; commanded_acceleration() when it is not known). Errors: throws
  /// std::invalid_argument for a negative or too long latency or feedback delay.
  CentrePredictor(const Vehicle& vehicle, Loop loop, const State& start, const Vec3& a_W, const Setpoint& previous);
  /// From here as if made anew. Real-time: wait-free, no allocation.
  void begin(const State& start, const Vec3& a_W, const Setpoint& previous) noexcept;
  /// Issues the command of the next period and moves on by 20 ms. `push_W`: mean acceleration d by the air, held over
  /// the period, m/s²: v̇ = a + d. Real-time: wait-free, no allocation.
  State step(const Setpoint& command, const Vec3& push_W = Vec3::Zero()) noexcept;
  const State& state() const noexcept { return state_; }
  const Vec3& acceleration() const noexcept { return a_W_; }  ///< v̇, the push included

 private:
  enum class Feedback { immediate, held, delayed };
  using Axes = Eigen::Matrix3d;               // rows p, v, a; one column per world axis
  using Input = Eigen::Matrix<double, 4, 3>;  // u and its first three derivatives at a subinterval's start
  struct Lookup {                             // where the delayed feedback lies
    int back;                                 // subintervals before the current one
    double s;                                 // time after that subinterval's start, s
  };
  struct Subinterval {  // part of a period with one command and no kink
    AxisStep horizontal, vertical;
    double length;      // s
    bool new_command;   // whether the newer command acts already
    bool measure;       // held: feedback is measured at the subinterval's start
    Lookup start, end;  // delayed only
  };
  struct FeedbackPiece {  // −k_p p − k_d v and its derivative over a past subinterval
    double length;
    Vec3 u0, du0, u1, du1;
  };
  Vec3 feedback(const Axes& x) const noexcept;
  Vec3 feedback_rate(const Axes& x) const noexcept;
  Input delayed_input(const Subinterval& subinterval) const noexcept;
  std::pair<Vec3, Vec3> past_feedback(const Lookup& at) const noexcept;
  void run(const Subinterval& subinterval, const Vec3& r) noexcept;
  void add_subintervals(const AxisLoop& horizontal, const AxisLoop& vertical, double switch_time);

  Feedback kind_;
  bool lag_;
  Vec3 kp_, kd_;
  int command_delay_;  // whole periods of latency
  int sample_delay_;   // held: periods from a measurement to its use
  std::vector<Subinterval> subintervals_;
  std::array<Vec3, kMaxDelaySteps + 2> r_;     // commands r, newest first
  std::array<Vec3, kMaxDelaySteps + 2> held_;  // held: measured feedback, newest first
  std::vector<FeedbackPiece> past_;            // delayed: ring of past subintervals
  std::size_t newest_ = 0;
  Axes x_;  // row a: v̇, the push included
  Vec3 push_W_ = Vec3::Zero();
  State state_;
  Vec3 a_W_;
};

}  // namespace backwash::reach
