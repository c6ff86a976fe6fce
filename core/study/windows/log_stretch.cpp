// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/log_stretch.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/study/windows/loop.hpp"

namespace backwash::study {
namespace {

/// The rows of a log at even times.
class Resampler {
 public:
  Resampler(const log::FlightLog& log, SampleRange rows, double rate) : log_(log) {
    const auto& t = log.t_s;
    const auto count = static_cast<std::size_t>((t[rows.end - 1] - t[rows.begin]) * rate + kWindowRules.row_error) + 1;
    std::size_t row = rows.begin;
    for (std::size_t k = 0; k < count; ++k) {
      const double time = t[rows.begin] + static_cast<double>(k) / rate;
      while (row + 2 < rows.end && t[row + 1] <= time) ++row;
      const std::size_t next = std::min(row + 1, rows.end - 1);
      const double share = next > row ? std::clamp((time - t[row]) / (t[next] - t[row]), 0.0, 1.0) : 0;
      at_.push_back({row, next, share});
    }
  }
  std::size_t size() const { return at_.size(); }
  std::size_t nearest(std::size_t k) const { return at_[k].share < 0.5 ? at_[k].row : at_[k].next; }
  Rows column(const std::string& name) const {
    Rows even;
    const auto& c = log_.column(name);
    for (const auto& [row, next, share] : at_) even.push_back((1 - share) * c[row] + share * c[next]);
    return even;
  }
  std::vector<Vec3> xyz(const std::string& prefix, const std::string& unit) const {
    const Rows x = column(prefix + "x" + unit), y = column(prefix + "y" + unit), z = column(prefix + "z" + unit);
    std::vector<Vec3> even;
    for (std::size_t k = 0; k < size(); ++k) even.emplace_back(x[k], y[k], z[k]);
    return even;
  }

 private:
  struct At {
    std::size_t row, next;
    double share;
  };
  const log::FlightLog& log_;
  std::vector<At> at_;
};

std::vector<Vec3> differentiated(const std::vector<Vec3>& x, double rate) {
  std::vector<Vec3> rates;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const std::size_t low = k > 0 ? k - 1 : 0, high = std::min(k + 1, x.size() - 1);
    rates.push_back(high > low ? Vec3((x[high] - x[low]) * rate / static_cast<double>(high - low)) : Vec3::Zero());
  }
  return rates;
}

/// a minus what the vehicle's loop answers to the motion and the set-points.
std::vector<Vec3> beyond_command(const Even& e, const Resampler& rows, const log::FlightLog& log,
                                 const Vehicle& vehicle) {
  const auto p = rows.xyz("cmd_", "_m");
  const auto v = has_xyz(log, "cmd_v", "_mps") ? rows.xyz("cmd_v", "_mps") : differentiated(p, e.rate);
  const auto a =
      has_xyz(log, "cmd_a", "_mps2") ? rows.xyz("cmd_a", "_mps2") : std::vector<Vec3>(e.size(), Vec3::Zero());
  std::vector<double> t;
  std::vector<Setpoint> commands;
  for (std::size_t k = 0; k < e.size(); ++k) {
    t.push_back(static_cast<double>(k) / e.rate);
    commands.push_back({p[k], v[k], a[k]});
  }
  const auto loop = with_command_age(loop::PositionLoop(vehicle), t);
  auto w = answers({t, e.p, e.v, commands}, loop, std::array{loop.attitude_lag}).front();
  for (std::size_t k = 0; k < e.size(); ++k) w[k] = e.a[k] - w[k];
  return w;
}

/// Hover positions found by the speed, averaged over still_time.
std::vector<std::optional<int>> found_segments(const std::vector<Vec3>& path, double rate, double still_mps,
                                               int& next) {
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(kWindowRules.still_time / 2 * rate)));
  std::vector<std::optional<int>> segment(path.size());
  for (std::size_t k = 0; k < path.size(); ++k) {
    const std::size_t low = k > half ? k - half : 0, high = std::min(k + half, path.size() - 1);
    const double seconds = static_cast<double>(high - low) / rate;
    const bool still = seconds > 0 && (path[high] - path[low]).norm() < still_mps * seconds;
    if (still) segment[k] = k > 0 && segment[k - 1] ? *segment[k - 1] : next++;
  }
  return segment;
}

}  // namespace

Even even_stretch(const log::FlightLog& log, SampleRange raw, double rate, Signal signal,
                  const std::optional<Vehicle>& vehicle, const WindowOptions& options, int& next_segment) {
  const Resampler rows(log, raw, rate);
  Even e{log.t_s[raw.begin], rate, rows.xyz("", "_m"), {}, rows.xyz("a", "_mps2"), {}, {}, {}};
  e.v = has_xyz(log, "v", "_mps") ? rows.xyz("v", "_mps") : differentiated(e.p, rate);
  if (log.has("qw") && log.has("qx") && log.has("qy") && log.has("qz")) {
    for (std::size_t k = 0; k < e.size(); ++k) {
      const auto i = rows.nearest(k);
      e.q.emplace_back(log.column("qw")[i], log.column("qx")[i], log.column("qy")[i], log.column("qz")[i]);
    }
  }
  if (log.has("segment")) {
    for (std::size_t k = 0; k < e.size(); ++k) e.segment.push_back(segment_of(log.column("segment")[rows.nearest(k)]));
  } else {
    const bool commanded = has_xyz(log, "cmd_", "_m");
    e.segment = found_segments(commanded ? rows.xyz("cmd_", "_m") : e.p, rate,
                               commanded ? kWindowRules.still_command.value : options.still_mps, next_segment);
  }
  e.w = signal == Signal::commanded ? beyond_command(e, rows, log, *vehicle) : e.a;
  return e;
}

}  // namespace backwash::study
