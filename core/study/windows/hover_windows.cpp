// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/hover_windows.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "core/study/windows/log_stretch.hpp"

namespace backwash::study {
namespace {

Vec3 mean_of(const std::vector<Vec3>& x, SampleRange s) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = s.begin; k < s.end; ++k) sum += x[k];
  return sum / static_cast<double>(s.size());
}

/// The rows of a stretch at times from … to.
SampleRange rows_between(const std::vector<double>& t, SampleRange raw, double from, double to) {
  const auto at = [&](double time) {
    return static_cast<std::size_t>(std::lower_bound(t.begin() + static_cast<std::ptrdiff_t>(raw.begin),
                                                     t.begin() + static_cast<std::ptrdiff_t>(raw.end), time) -
                                    t.begin());
  };
  return {at(from), at(to)};
}

/// The windows of one unbroken stretch of good ones.
void add_windows(const Even& e, SampleRange stretch, std::size_t length, FlightWindows& flight) {
  std::array<std::vector<double>, 3> filtered;
  std::array<std::vector<double>, 3> signal;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    for (std::size_t k = stretch.begin; k < stretch.end; ++k) signal[i].push_back(e.w[k][axis]);
    filtered[i] = band_passed(signal[i], e.rate, flight.band);
  }
  flight.gusts.push_back(gust_fits(signal, e.rate, flight.band, [&flight](std::size_t axis, double f_hz) {
    return flight.loop ? flight.loop->passes(static_cast<int>(axis), f_hz) : 1;
  }));
  for (std::size_t begin = stretch.begin; begin < stretch.end; begin += length) {
    const SampleRange s{begin, begin + length};
    Window window{e.t0 + static_cast<double>(begin) / e.rate,
                  *e.segment[begin],
                  mean_of(e.p, s),
                  {},
                  0,
                  mean_of(e.w, s),
                  Vec3::Zero(),
                  flight.gusts.size() - 1};
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
    }
    flight.windows.push_back(window);
  }
}

/// Windows of a stretch `raw` of the log, e at even times.
void cut(const Even& e, const log::FlightLog& log, SampleRange raw, const LogGates& gates, const WindowOptions& options,
         FlightWindows& flight) {
  const auto length = static_cast<std::size_t>(std::lround(options.length_s * e.rate));
  const auto in_windows = [length](std::size_t rows) { return (rows + length / 2) / length; };
  const auto why_left_out = [&](std::size_t at) {
    const double from = e.t0 + (static_cast<double>(at) - 0.5) / e.rate;
    return gates(rows_between(log.t_s, raw, from, from + options.length_s));
  };
  auto& transit = flight.gated[static_cast<std::size_t>(Gate::transit)];
  for (std::size_t begin = 0; begin < e.size();) {
    std::size_t end = begin;
    while (end < e.size() && e.segment[end] == e.segment[begin]) ++end;
    const bool hover = e.segment[begin].has_value();
    const auto settling = static_cast<std::size_t>(std::lround(kWindowRules.settle * e.rate));
    const std::size_t first = hover ? std::min(end, begin + settling) : end;
    transit += in_windows(first - begin);
    SampleRange good{first, first};
    for (std::size_t at = first; at + length <= end; at += length) {
      if (const auto why = why_left_out(at)) {
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

/// What makes a log one that cannot be cut; nothing if it can.
std::optional<std::string> refusal(const log::FlightLog& log, double length_s) {
  for (const char* name : {"x_m", "y_m", "z_m", "ax_mps2", "ay_mps2", "az_mps2"})
    if (!log.has(name)) return ":1: no column '" + std::string(name) + "'; windows need position and acceleration";
  const auto& t = log.t_s;
  for (std::size_t i = 1; i < t.size(); ++i)
    if (!(t[i] > t[i - 1]))
      return std::string(":").append(std::to_string(i + 2)).append(": t_s does not rise; sort the rows by time");
  if (t.size() < 2 || t.back() - t.front() < length_s) return ":1: shorter than one window; give a longer flight";
  return std::nullopt;
}

/// What stands for the disturbance, and what of it the closed loop swallows.
void choose_signal(FlightWindows& flight, bool commanded, const std::optional<Vehicle>& vehicle, double tau_w) {
  flight.attenuation = Vec3::Ones();
  flight.signal = !vehicle ? Signal::raw : commanded ? Signal::commanded : Signal::divided;
  if (flight.signal != Signal::divided) return;
  flight.loop = loop::PositionLoop(*vehicle);
  for (int axis = 0; axis < 3; ++axis)
    flight.attenuation[axis] = loop_attenuation(*flight.loop, axis, tau_w, flight.band);
}

/// Windows that gaps between stretches swallowed; mean rate within them, Hz.
std::pair<std::size_t, double> gaps_and_rate(const std::vector<double>& t, const std::vector<SampleRange>& stretches,
                                             double length_s) {
  std::size_t lost = 0, intervals = 0;
  double seconds = 0;
  for (std::size_t k = 0; k < stretches.size(); ++k) {
    const auto [begin, end] = stretches[k];
    for (std::size_t i = begin + 1; i < end; ++i) seconds += t[i] - t[i - 1];
    intervals += end - begin - 1;
    if (k > 0)
      lost += std::max<std::size_t>(1, static_cast<std::size_t>(std::lround((t[begin] - t[begin - 1]) / length_s)));
  }
  return {lost, static_cast<double>(intervals) / seconds};
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

GustShape FlightWindows::gust_shape() const {
  std::array<double, kGustShapes> sum{};
  for (const auto& fits : gusts)
    for (std::size_t k = 0; k < kGustShapes; ++k) sum[k] += fits[k].ln_likelihood;
  return static_cast<GustShape>(std::max_element(sum.begin(), sum.end()) - sum.begin());
}

double FlightWindows::tau_w(const Window& window) const {
  return gusts[window.stretch][static_cast<std::size_t>(gust_shape())].tau_s;
}

tl::expected<FlightWindows, log::LogError> flight_windows(const log::FlightLog& log,
                                                          const std::optional<Vehicle>& vehicle,
                                                          const WindowOptions& options, const std::string& path) {
  if (const auto why = refusal(log, options.length_s))
    return tl::make_unexpected(log::LogError{log::LogError::Kind::bad_data, path + *why});
  std::vector<std::size_t> rows(log.t_s.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  const LogGates gates(log, std::move(rows), vehicle);
  const auto stretches = unbroken(log.t_s);
  FlightWindows flight;
  std::tie(flight.gated[static_cast<std::size_t>(Gate::gap)], flight.rate_hz) =
      gaps_and_rate(log.t_s, stretches, options.length_s);
  flight.band = Band{}.within(flight.rate_hz);
  choose_signal(flight, has_xyz(log, "cmd_", "_m"), vehicle, options.tau_w);
  if (!log.has("thrust") && !log.has("motor1"))
    flight.not_tested.emplace_back("saturated: no column 'thrust' or 'motor1' … 'motor4'");
  int next_segment = 0;
  for (const SampleRange raw : stretches) {
    if (log.t_s[raw.end - 1] - log.t_s[raw.begin] < options.length_s) continue;
    const Even e = even_stretch(log, raw, flight.rate_hz, flight.signal, vehicle, options, next_segment);
    cut(e, log, raw, gates, options, flight);
  }
  return flight;
}

}  // namespace backwash::study
