// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace backwash::promises {

/// One axis of a vehicle and its loop as docs/model.md 4-1, 4-4 and 4-16 write it.
struct Plant {
  double kp = 0, kd = 0, ki = 0;                     ///< 1/s², 1/s, 1/s²
  double lag = 0;                                    ///< s
  int delay = 0;                                     ///< of the feedback, in steps
  int per_period = 10;                               ///< steps in 20 ms
  bool sampled = false;                              ///< the feedback is taken every 20 ms and held
  double step() const { return 0.02 / per_period; }  ///< s
};

/// Oracle: eight motions of one axis side by side, moved on in steps of 20 ms/per_period. Within a step the set-point
/// and the push are held; what was fed back `delay` steps ago is a cubic through both ends. Each step is one matrix
/// exponential of the whole, by a Taylor series and squarings of our own. Shares no code with core.
class Motions {
 public:
  static constexpr int kLanes = 8;
  using Lanes = Eigen::Array<double, kLanes, 1>;
  /// Starts at p, v with acceleration a; before, p and v were what they are.
  Motions(const Plant& plant, const Lanes& p, const Lanes& v, const Lanes& a);
  /// A step under the acting set-point (as k_p p + k_d v, and its acceleration) and an acceleration by the air.
  void step(const Lanes& off, const Lanes& a_cmd, const Lanes& w);
  Lanes p() const { return z_.col(kP); }
  Lanes v() const { return z_.col(kV); }
  Lanes held() const { return z_.col(kI); }  ///< by the integrator, m/s²

 private:
  enum Column { kP, kV, kA, kI, kOff, kCommand, kW, kF0, kF1, kF2, kF3, kColumns };
  struct Fed {  // what is fed back at both ends of a step, and its slopes there
    Lanes f0, f1, end0, end1;
  };
  Lanes feedback() const { return -plant_.kp * p() - plant_.kd * v(); }
  Lanes acceleration() const;
  void take_feedback();

  Plant plant_;
  bool closed_;
  Eigen::Matrix<double, kColumns, 4> move_;
  Eigen::Matrix<double, kLanes, kColumns> z_;
  std::vector<Fed> past_;  // ring of the last `delay` steps
  std::size_t count_ = 0;
};

/// What an axis answers, by its own motion.
struct Answer {
  int per_period = 0;
  /// Position and what is held at each step after a push of 1 m/s² in one step: that of the n-th step of a period is
  /// push[n] (all the same but for `sampled`, where per_period is 6 at most).
  std::vector<std::vector<double>> push, charge;
  std::vector<double> from_position, from_velocity;  ///< position at each step after a unit error
  double reach = 0, speed = 0;  ///< positions and their changes by a push each step, summed: s², s
  /// Largest acceleration by pushes of 1 m/s², by a unit error of position, and of velocity; steps apart.
  double by_push = 0, by_position = 0, by_velocity = 0;
  /// After `steps` steps.
  Answer(const Plant& plant, int steps);
  /// Position at the end of step `to` (from 0) by a push in step `from`.
  double at(int from, int to) const {
    return push.size() == 1 ? push[0][static_cast<std::size_t>(to - from)]
                            : push[static_cast<std::size_t>(from % per_period)]
                                  [static_cast<std::size_t>(to - from / per_period * per_period)];
  }
};

}  // namespace backwash::promises
