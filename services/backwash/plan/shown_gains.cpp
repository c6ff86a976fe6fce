// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/plan/shown_gains.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/log/columns/column_law.hpp"

namespace backwash::services {
namespace {

using Topic = log::TopicLog::Topic;
constexpr double kOldest = 0.15;  // s, what is said behind a set-point
constexpr double kWidest = 2;     // ratio of bounds that still tell a gain

/// The newest value that a column had at a time; nothing: none that young, or none that is finite.
std::optional<double> at(const Topic* topic, const std::string& column, double t_s) {
  if (!topic) return std::nullopt;
  const auto found = topic->columns.find(column);
  const auto after = std::ranges::upper_bound(topic->t_s, t_s) - topic->t_s.begin();
  if (found == topic->columns.end() || after == 0) return std::nullopt;
  const auto row = static_cast<std::size_t>(after - 1);
  if (t_s - topic->t_s[row] > kOldest || !std::isfinite(found->second[row])) return std::nullopt;
  return found->second[row];
}

/// Columns of a set-point, of what was flown and of what is asked for because of the difference, and what is fed
/// forward into that, in an axis of "xyz".
struct Names {
  std::string wanted, flown, asked, forward;
};

std::optional<Shown> gain_of(const log::TopicLog& topics, std::initializer_list<Names> axes) {
  const auto* followed = topics.find("vehicle_local_position_setpoint");
  const auto* flown = topics.find("vehicle_local_position");
  const auto* forward = topics.find("trajectory_setpoint");
  if (!followed || !flown) return std::nullopt;
  std::vector<double> errors, answers;
  for (const Names& names : axes) {
    std::vector<double> x, y;
    double mean_x = 0, mean_y = 0;
    for (const double t : followed->t_s) {
      const auto wanted = at(followed, names.wanted, t), is = at(flown, names.flown, t),
                 asked = at(followed, names.asked, t);
      if (!wanted || !is || !asked) continue;
      x.push_back(*wanted - *is);
      y.push_back(*asked - at(forward, names.forward, t).value_or(0));
      mean_x += x.back();
      mean_y += y.back();
    }
    for (std::size_t k = 0; k < x.size(); ++k) {
      errors.push_back(x[k] - mean_x / static_cast<double>(x.size()));
      answers.push_back(y[k] - mean_y / static_cast<double>(x.size()));
    }
  }
  const auto gain = log::gain_of(errors, answers);
  if (gain.sign <= 0 || !(gain.high <= kWidest * gain.low)) return std::nullopt;
  return Shown{std::sqrt(gain.low * gain.high), gain.low, gain.high};
}

}  // namespace

ShownGains shown_gains(const log::TopicLog& topics) {
  const auto position = [](std::size_t i) {
    const std::string axis(1, "xyz"[i]);
    return Names{axis, axis, "v" + axis, "velocity[" + std::to_string(i) + "]"};
  };
  const auto velocity = [](std::size_t i) {
    const std::string of = std::string("v") + "xyz"[i], asked = "acceleration[" + std::to_string(i) + "]";
    return Names{of, of, asked, asked};
  };
  return {{gain_of(topics, {position(0), position(1)}), gain_of(topics, {position(2)})},
          {gain_of(topics, {velocity(0), velocity(1)}), gain_of(topics, {velocity(2)})}};
}

}  // namespace backwash::services
