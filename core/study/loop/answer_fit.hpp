// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "core/study/windows/loop.hpp"
#include "core/study/windows/stretch.hpp"

namespace backwash::study {

/// A log as the fit reads it: its samples, set-points, and windows that are good.
struct AnswerLog {
  Series series;
  std::vector<Setpoint> commands;
  std::vector<SampleRange> windows;
};

/// A least-squares fit: its parameters, and what each log adds to JᵀJ, to Σ of windows' scores gᵀg, and to Jᵀr, at
/// them.
struct Answers {
  struct Part {
    Eigen::MatrixXd information, scores;
    Eigen::VectorXd gradient;
  };
  Eigen::VectorXd theta;
  std::vector<Part> logs;
};

/// Inverse of a symmetric matrix that may lack rank: what it lacks is hardly known.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& symmetric);

/// `late` below: the share of the lag that is a pure delay, 0 for a lag of first order.
///
/// ln k_p, ln k_d, latency, lag of the level axes, and by attitude the share of the acceleration that is fed forward.
/// By the tilt's answer to the logged state, or by positions.
Answers fit_level(std::span<const AnswerLog> logs, const Vehicle& start, bool by_attitude, double late);
/// ln k_p, ln k_d, lag of the thrust, and by thrust that share. Latency as in `start`.
Answers fit_vertical(std::span<const AnswerLog> logs, const Vehicle& start, bool by_thrust, double late);

}  // namespace backwash::study
