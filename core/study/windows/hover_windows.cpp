// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/hover_windows.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/windows/log_stretch.hpp"

namespace backwash::study {
namespace {

Vec3 mean_of(const std::vector<Vec3>& x, Span s) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = s.begin; k < s.end; ++k) sum += x[k];
  return sum / static_cast<double>(s.size());
}

bool perched(const Even& e, Span s, const std::optional<Vehicle>& vehicle, const WindowOptions& options) {
  Vec3 square = Vec3::Zero();
  const Vec3 mean = mean_of(e.p, s);
  for (std::size_t k = s.begin; k < s.end; ++k) square += (e.p[k] - mean).cwiseAbs2();
  if (std::sqrt(square.maxCoeff() / static_cast<double>(s.size())) < options.perched_m) return true;
  if (e.thrust.empty() || !vehicle) return false;
  double thrust = 0;
  for (std::size_t k = s.begin; k < s.end; ++k) {
    const double f = vehicle->propulsion.thr_mdl_fac, u = e.thrust[k];
    thrust += vehicle->propulsion.max_thrust * (f * u * u + (1 - f) * u) / static_cast<double>(s.size());
  }
  return thrust < options.perched_thrust * vehicle->body.mass * kGravity;
}

std::optional<Gate> gate(const Even& e, Span s, const std::optional<Vehicle>& vehicle, const WindowOptions& options) {
  std::size_t frozen = 0, saturated = 0;
  for (std::size_t k = s.begin; k < s.end; ++k) {
    frozen += e.frozen[k] ? 1 : 0;
    if (!e.fullest.empty() && (e.fullest[k] >= 0.99 || e.emptiest[k] <= 0.01)) saturated += 1;
  }
  if (frozen > 0) return Gate::frozen;
  if (perched(e, s, vehicle, options)) return Gate::perched;
  if (static_cast<double>(saturated) > options.saturated_share * static_cast<double>(s.size())) return Gate::saturated;
  return std::nullopt;
}

/// The windows of one unbroken stretch of good ones.
void add_windows(const Even& e, Span stretch, std::size_t length, FlightWindows& flight) {
  std::array<std::vector<double>, 3> filtered;
  std::array<Correlation, 3> rho;
  for (int axis = 0; axis < 3; ++axis) {
    Rows w;
    for (std::size_t k = stretch.begin; k < stretch.end; ++k) w.push_back(e.w[k][axis]);
    const auto i = static_cast<std::size_t>(axis);
    filtered[i] = band_passed(w, e.rate, flight.band);
    rho[i] = correlation(filtered[i], e.rate);
  }
  for (std::size_t begin = stretch.begin; begin < stretch.end; begin += length) {
    const Span s{begin, begin + length};
    Window window{e.t0 + static_cast<double>(begin) / e.rate,
                  e.segment[begin],
                  mean_of(e.p, s),
                  {},
                  0,
                  mean_of(e.w, s),
                  Vec3::Zero(),
                  Vec3::Zero(),
                  Vec3::Zero()};
    const double n = static_cast<double>(length);
    for (std::size_t k = s.begin; k < s.end; ++k) window.speed_mps += e.v[k].squaredNorm() / n;
    window.speed_mps = std::sqrt(window.speed_mps);
    if (!e.q.empty()) {
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();  // of nearby quaternions, signs made equal
      for (std::size_t k = s.begin; k < s.end; ++k)
        sum += e.q[k].coeffs() * (e.q[k].coeffs().dot(e.q[s.begin].coeffs()) < 0 ? -1 : 1);
      window.attitude = Eigen::Quaterniond(sum.normalized());
    }
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      for (std::size_t k = s.begin; k < s.end; ++k) {
        const double x = filtered[i][k - stretch.begin];
        window.variance[axis] += x * x / (n * flight.attenuation[axis]);
      }
      window.effective_samples[axis] = std::max(1.0, n / e.rate / rho[i].variance_time_s);
      window.tau_w[axis] = rho[i].time_s;
    }
    flight.windows.push_back(window);
  }
}

void cut(const Even& e, const std::optional<Vehicle>& vehicle, const WindowOptions& options, FlightWindows& flight) {
  const auto length = static_cast<std::size_t>(std::lround(options.length_s * e.rate));
  const auto in_windows = [length](std::size_t rows) { return (rows + length / 2) / length; };
  auto& transit = flight.gated[static_cast<std::size_t>(Gate::transit)];
  for (std::size_t begin = 0; begin < e.size();) {
    std::size_t end = begin;
    while (end < e.size() && e.segment[end] == e.segment[begin]) ++end;
    const bool hover = e.segment[begin] >= 0;
    const auto settling = static_cast<std::size_t>(std::lround(options.settle_s * e.rate));
    const std::size_t first = hover ? std::min(end, begin + settling) : end;
    transit += in_windows(first - begin);
    Span good{first, first};
    for (std::size_t at = first; at + length <= end; at += length) {
      if (const auto why = gate(e, {at, at + length}, vehicle, options)) {
        flight.gated[static_cast<std::size_t>(*why)] += 1;
        if (good.size() > 0) add_windows(e, good, length, flight);
        good = {at + length, at + length};
      } else {
        good.end = at + length;
      }
    }
    if (good.size() > 0) add_windows(e, good, length, flight);
    begin = end;
  }
}

}  // namespace

const char* to_string(Signal signal) noexcept {
  switch (signal) {
    case Signal::commanded:
      return "acceleration beyond the command";
    case Signal::divided:
      return "raw acceleration, the loop's attenuation divided out";
    default:
      return "raw acceleration";
  }
}

tl::expected<FlightWindows, log::LogError> flight_windows(const log::FlightLog& log,
                                                          const std::optional<Vehicle>& vehicle,
                                                          const WindowOptions& options, const std::string& path) {
  const auto bad = [&](const std::string& what) {
    return tl::make_unexpected(log::LogError{log::LogError::Kind::bad_data, std::string(path).append(what)});
  };
  for (const char* name : {"x_m", "y_m", "z_m", "ax_mps2", "ay_mps2", "az_mps2"}) {
    if (!log.has(name)) return bad(":1: no column '" + std::string(name) + "'; windows need position and acceleration");
  }
  const auto& t = log.t_s;
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (!(t[i] > t[i - 1]))
      return bad(std::string(":").append(std::to_string(i + 2)).append(": t_s does not rise; sort the rows by time"));
  }
  if (t.size() < 2 || t.back() - t.front() < options.length_s)
    return bad(":1: shorter than one window; give a longer flight");

  FlightWindows flight;
  Rows spacing;
  for (std::size_t i = 1; i < t.size(); ++i) spacing.push_back(t[i] - t[i - 1]);
  std::nth_element(spacing.begin(), spacing.begin() + static_cast<std::ptrdiff_t>(spacing.size() / 2), spacing.end());
  const double longest = std::max(0.05, 5 * spacing[spacing.size() / 2]);
  std::vector<Span> stretches{{0, 1}};
  double seconds = 0;
  std::size_t intervals = 0;
  for (std::size_t i = 1; i < t.size(); ++i) {
    const double dt = t[i] - t[i - 1];
    if (dt > longest) {
      const auto lost = static_cast<std::size_t>(std::lround(dt / options.length_s));
      flight.gated[static_cast<std::size_t>(Gate::gap)] += std::max<std::size_t>(1, lost);
      stretches.push_back({i, i});
    } else {
      seconds += dt, intervals += 1;
    }
    stretches.back().end = i + 1;
  }
  flight.rate_hz = static_cast<double>(intervals) / seconds;
  flight.band = options.band.within(flight.rate_hz);
  flight.attenuation = Vec3::Ones();
  const bool commanded = has_xyz(log, "cmd_", "_m");
  flight.signal = !vehicle ? Signal::raw : commanded ? Signal::commanded : Signal::divided;
  if (flight.signal == Signal::divided) {
    const auto& c = vehicle->controller;
    const auto of = [&](double kp, double kd) {
      return loop_attenuation(kp, kd, c.feedback_delay, c.attitude_lag, options.tau_w, flight.band);
    };
    const double horizontal = of(c.kp.horizontal, c.kd.horizontal);
    flight.attenuation = {horizontal, horizontal, of(c.kp.vertical, c.kd.vertical)};
  }
  flight.segments_from_log = log.has("segment");
  if (!log.has("thrust") && !log.has("motor1"))
    flight.not_tested.emplace_back("saturated: no column 'thrust' or 'motor1' … 'motor4'");

  int next_segment = 0;
  for (const auto& rows : stretches) {
    if (t[rows.end - 1] - t[rows.begin] < options.length_s) continue;
    cut(even_stretch(log, rows, flight.rate_hz, flight.signal, vehicle, options, next_segment), vehicle, options,
        flight);
  }
  return flight;
}

}  // namespace backwash::study
