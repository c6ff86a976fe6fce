// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/study/findings/study.hpp"

namespace backwash::study {
namespace {

constexpr auto kWindows = static_cast<std::size_t>(kRules.manoeuvre_windows);

/// Windows of a hover where the median window was flown, changed by a manoeuvre if there is one.
Windows flown(const WindowRow& median, const Manoeuvre* manoeuvre) {
  Windows windows(kWindows, median);
  for (std::size_t i = 0; i < kWindows; ++i) {
    WindowRow& w = windows[i];
    w.path.clear();
    w.v_W.setZero();
    w.speed = 0;
    w.speeds.fill(0);
    w.delay_gain = {};
    w.slope_gain = {};
    w.command_gain = {};
    w.lag_gain = {};
    w.drag_gain = 0;
    w.mean_gain = {};
    w.tilt_gain = 0;
    if (manoeuvre) manoeuvre->set(w, (static_cast<double>(i) + 0.5) / kWindows);
  }
  return windows;
}

/// Columns the rival and free offsets have to copy the cause's prediction with.
std::vector<DesignColumn> copies_of(const Form& ours, const std::vector<DesignColumn>& our_columns, const Rival& rival,
                                    const Observations& imagined) {
  std::vector<DesignColumn> copies = rival.form->columns(imagined.windows, rival.scale);
  if (ours.constant || rival.form->constant) return copies;
  std::vector<DesignColumn> both = our_columns;
  both.insert(both.end(), copies.begin(), copies.end());
  const auto free = offsets(both, imagined);
  copies.insert(copies.end(), free.begin(), free.end());
  return copies;
}

/// What of the cause's prediction on these windows its rival cannot copy, in nats: least squares over all rows.
double nats_apart(const Evidence& evidence, const Accepted& cause, const Rival& rival, Windows windows) {
  Observations imagined;
  imagined.windows = std::move(windows);
  imagined.missing = evidence.seen().missing;
  const auto ours = cause.form->columns(imagined.windows, cause.scale);
  const auto copies = copies_of(*cause.form, ours, rival, imagined);
  const auto rows = static_cast<Eigen::Index>(kWindows * kChannels);
  const auto weighted = [&](const DesignColumn& column) {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(rows);
    for (const auto& part : decorrelated(column).parts) {
      const Scatter scatter = evidence.scatter(part.channel);
      const double weight = 1 / std::sqrt(scatter.within + kWindows * scatter.between);
      for (std::size_t i = 0; i < kWindows; ++i)
        all[static_cast<Eigen::Index>(part.channel * kWindows + i)] += weight * part.x[i];
    }
    return all;
  };
  Eigen::MatrixXd X(rows, static_cast<Eigen::Index>(copies.size()));
  for (std::size_t k = 0; k < copies.size(); ++k) X.col(static_cast<Eigen::Index>(k)) = weighted(copies[k]);
  Eigen::VectorXd target = Eigen::VectorXd::Zero(rows);
  for (std::size_t k = 0; k < ours.size(); ++k) target += cause.theta[static_cast<Eigen::Index>(k)] * weighted(ours[k]);
  const Eigen::VectorXd left = target - X * X.completeOrthogonalDecomposition().solve(target);
  return 0.5 * kRules.manoeuvre_flights * left.squaredNorm();
}

}  // namespace

std::vector<Separation> separations(const Evidence& evidence, const Accepted& cause, const Rival& rival) {
  const WindowRow& median = evidence.seen().windows[evidence.seen().windows.size() / 2];
  const double standing = nats_apart(evidence, cause, rival, flown(median, nullptr));
  std::vector<Separation> all;
  for (const Effect& effect : effects())
    for (const Manoeuvre& m : effect.manoeuvres) {
      const double nats = nats_apart(evidence, cause, rival, flown(median, &m)) - standing;
      if (nats >= kRules.manoeuvre_nats) all.push_back({rival.name, m.name, nats});
    }
  std::sort(all.begin(), all.end(), [](auto& a, auto& b) { return a.expected_nats > b.expected_nats; });
  if (all.empty())
    all.push_back({rival.name,
                   evidence.seen().has(Source::rpm)
                       ? "none of the list: the two forms do not differ in any"
                       : "none of the list: the two forms do not differ in any; log the rotors' "
                         "rpm on the same flights",
                   std::nullopt});
  return all;
}

}  // namespace backwash::study
