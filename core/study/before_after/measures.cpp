// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/before_after/measures.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "core/log/columns/log_columns.hpp"
#include "core/study/before_after/before_after_rules.hpp"
#include "core/study/windows/signals/band.hpp"
#include "core/types/formatted.hpp"
#include "core/types/quantile.hpp"

namespace backwash::study {
namespace {

/// What is measured of each flight's windows: `of` gives a window's number or NaN.
template <typename Of>
FlightMeasure by_window(const Observations& seen, const std::string& name, const std::string& unit, bool ratio,
                        const Of& of) {
  FlightMeasure measure{name, unit, ratio, {}};
  for (std::size_t f = 0; f < seen.flights; ++f) {
    std::vector<MeasuredValue> flight;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i)
      if (const auto [cell, y] = of(f, i); std::isfinite(y)) flight.push_back({f, cell, y});
    if (static_cast<double>(flight.size()) >= kBeforeAfterRules.fewest_windows)
      measure.values.insert(measure.values.end(), flight.begin(), flight.end());
  }
  return measure;
}

/// `without`: why nothing of it is measured.
void add(FlightMeasures& all, FlightMeasure measure, const std::string& without) {
  if (measure.values.empty())
    all.not_tested.emplace_back(measure.name, without);
  else
    all.tested.push_back(std::move(measure));
}

/// The octave of x, 0 up to `least`.
int octave(double x, double least) { return x > least ? 1 + static_cast<int>(std::log2(x / least)) : 0; }

double nearest_surface(const WindowRow& w) {
  double nearest = std::min(w.around.height, w.around.ceiling_gap);
  for (const auto& wall : w.around.walls) nearest = std::min(nearest, wall.first);
  return nearest;
}

Cell cell_of(const WindowRow& w) {
  return {octave(std::min(nearest_surface(w), kBeforeAfterRules.farthest_cell.value), kBeforeAfterRules.nearest_cell),
          octave(w.speed, kBeforeAfterRules.slowest_cell)};
}

/// Rows of a window in its log.
std::pair<std::size_t, std::size_t> rows_of(const WindowRow& w, const log::FlightLog& log) {
  const auto at = [&](double t) {
    return static_cast<std::size_t>(std::ranges::lower_bound(log.t_s, log.t_s.front() + t) - log.t_s.begin());
  };
  return {at(w.t - w.duration / 2), at(w.t + w.duration / 2)};
}

/// ln of the mean of `square` over a window's rows; NaN without rows.
template <typename Square>
double ln_mean(const WindowRow& w, const log::FlightLog& log, const Square& square) {
  const auto [from, until] = rows_of(w, log);
  double sum = 0;
  for (std::size_t k = from; k < until; ++k) sum += square(k);
  return until > from && sum > 0 ? std::log(sum / static_cast<double>(until - from)) : NAN;
}

/// s between changes of the set-points' positions, on the median of a flight; longer ones are steps. NaN: only those.
double period_of_set_points(const log::FlightLog& log) {
  std::vector<double> periods;
  double last = NAN;
  for (std::size_t k = 1; k < log.t_s.size() && log.has("cmd_x_m"); ++k) {
    const auto moved = [&](const char* name) { return log.column(name)[k] != log.column(name)[k - 1]; };
    if (!moved("cmd_x_m") && !moved("cmd_y_m") && !moved("cmd_z_m")) continue;
    if (log.t_s[k] - last < kWindowRules.settle) periods.push_back(log.t_s[k] - last);
    last = log.t_s[k];
  }
  return periods.empty() ? NAN : quantile(periods, 0.5);
}

/// Hz, of a flight's rows on the mean.
double rate_of(const log::FlightLog& log) {
  return static_cast<double>(log.t_s.size() - 1) / std::max(log.t_s.back() - log.t_s.front(), kWindowRules.gap.value);
}

/// The columns that the simulation is fed with.
std::string fed_by(const log::FlightLog& log) {
  std::string names;
  for (const auto& [name, values] : log.columns)
    if (name.starts_with("cmd_") || name == "thrust" || name == "qw" || name == "ax_mps2" || name == "vx_mps")
      names += (names.empty() ? "" : " ") + name;
  return names.empty() ? "positions alone" : names;
}

/// Whether each flight is logged as most are, by what `of` says of it; `differs`: of two such.
template <typename Of, typename Differs>
void keep_alike(std::vector<char>& kept, const std::vector<const log::FlightLog*>& logs, const Of& of,
                const Differs& differs) {
  std::size_t most = 0, best = 0;
  for (std::size_t f = 0; f < logs.size(); ++f) {
    const auto same = static_cast<std::size_t>(
        std::ranges::count_if(logs, [&](auto* other) { return !differs(of(*logs[f]), of(*other)); }));
    if (same > most) std::tie(most, best) = std::pair(same, f);
  }
  for (std::size_t f = 0; f < logs.size(); ++f)
    if (differs(of(*logs[best]), of(*logs[f]))) kept[f] = 0;
}

/// Flights that are logged as most are: what is measured of the loop and of the air follows from the columns, from how
/// often set-points change, and from the rate, above half of which everything folds back.
std::vector<char> logged_alike(const std::vector<const log::FlightLog*>& logs) {
  std::vector<char> kept(logs.size(), 1);
  const auto apart = [](double a, double b) {
    return std::max(a, b) > (1 + kBeforeAfterRules.alike) * std::min(a, b);  // steps alone, NaN, differ from nothing
  };
  keep_alike(kept, logs, fed_by, [](const auto& a, const auto& b) { return a != b; });
  keep_alike(kept, logs, rate_of, apart);
  keep_alike(kept, logs, period_of_set_points, apart);
  return kept;
}

/// Of each distance that some flight has windows at. Three axes' mean, over the modelled variance of the place: what
/// the model says of two places in one cell is no change.
void add_variances(FlightMeasures& all, const Observations& seen) {
  int farthest = 0;
  for (const auto& w : seen.windows) farthest = std::max(farthest, cell_of(w).first);
  for (int band = 0; band <= farthest; ++band) {
    const double least = kBeforeAfterRules.nearest_cell * std::exp2(band);
    const std::string name =
        band == 0         ? formatted("variance of acceleration within %.3g m of a surface", least)
        : band < farthest ? formatted("variance of acceleration at %.3g to %.3g m from a surface", least / 2, least)
                          : formatted("variance of acceleration beyond %.3g m of a surface", least / 2);
    auto measure = by_window(seen, name, "of the model's", true, [&](std::size_t, std::size_t i) {
      const Cell cell = cell_of(seen.windows[i]);
      double y = cell.first == band ? 0 : NAN;
      for (const Channel c : {kVarX, kVarY, kVarZ}) y += seen.weight[c][i] > 0 ? seen.y[c][i] / 3 : NAN;
      return std::pair(cell, y);
    });
    if (!measure.values.empty()) all.tested.push_back(std::move(measure));
  }
}

void add_tracking(FlightMeasures& all, const Observations& seen, const std::vector<const log::FlightLog*>& logs) {
  auto measure = by_window(seen, "tracking error", "m", true, [&](std::size_t f, std::size_t i) {
    const auto& log = *logs[f];
    if (!log.has("cmd_x_m") || !seen.windows[i].led) return std::pair(Cell(), static_cast<double>(NAN));
    const double y = ln_mean(seen.windows[i], log, [&](std::size_t k) {
      double square = 0;
      for (const char* axis : {"x_m", "y_m", "z_m"})
        square += std::pow(log.column(axis)[k] - log.column(std::string("cmd_") + axis)[k], 2);
      return square;
    });
    return std::pair(cell_of(seen.windows[i]), y / 2);
  });
  add(all, std::move(measure), "no set-points that are followed");
}

/// A flight's Σ w g y/Σ w g² of a delay's channel, and the vehicle file's own delay.
void add_delays(FlightMeasures& all, const Observations& seen, const Vehicle& vehicle) {
  for (const auto& [name, channel, axis] : {std::tuple{"loop latency, level", kCommandDelayH, std::size_t{0}},
                                            {"loop latency, up", kCommandDelayZ, std::size_t{1}}}) {
    FlightMeasure measure{name, "s", false, {}};
    for (std::size_t f = 0; f < seen.flights; ++f) {
      double top = 0, bottom = 0, windows = 0;
      for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i) {
        const double g = seen.windows[i].command_gain[axis], weight = seen.weight[channel][i];
        if (!(weight > 0) || g == 0) continue;
        top += weight * g * seen.y[channel][i];
        bottom += weight * g * g;
        windows += 1;
      }
      if (windows >= kBeforeAfterRules.fewest_windows)
        measure.values.push_back({f, {}, vehicle.controller.latency + top / bottom});
    }
    add(all, std::move(measure), "no set-points that move");
  }
}

/// Mean square of what a column holds of the band in a window, by its periodogram under a Hann taper; frequencies by
/// Goertzel's recurrence.
double power_within(const WindowRow& w, const log::FlightLog& log, const char* column, const Band& band) {
  const auto [from, until] = rows_of(w, log);
  const auto n = static_cast<double>(until - from);
  const std::span<const double> a(log.column(column).data() + from, until - from);
  const double mean = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double turn = 2 * std::numbers::pi / n;
  double power = 0;
  for (double k = std::ceil(band.low_hz * w.duration); k < band.high_hz * w.duration && k < n / 2; ++k) {
    const double twice_cosine = 2 * std::cos(turn * k);
    double last = 0, before = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double next = (a[i] - mean) * (1 - std::cos(turn * static_cast<double>(i))) + twice_cosine * last - before;
      before = std::exchange(last, next);
    }
    power += last * last + before * before - twice_cosine * last * before;
  }
  return 4 * power / (3 * n * n);  // |X|²/n² of a sine of amplitude A, mean square A²/2: 3/8 A² over its three lines
}

/// Vertical, level and forward together: no axis of the body need be known.
void add_vibration(FlightMeasures& all, const Observations& seen, const std::vector<const log::FlightLog*>& logs) {
  double slowest = HUGE_VAL;
  for (const auto* log : logs) slowest = std::min(slowest, rate_of(*log));
  const double highest = kWindowRules.rate_share * slowest;
  if (highest <= kBeforeAfterRules.lowest_vibration)
    return void(all.not_tested.emplace_back("vibration", formatted("logged at %.4g Hz: log faster", slowest)));
  for (double low = kBeforeAfterRules.lowest_vibration; low < highest; low *= 2) {
    const Band band{low, std::min(2 * low, highest)};
    const auto name = formatted("vibration, %.3g to %.3g Hz", band.low_hz, band.high_hz);
    add(all,
        by_window(seen, name, "m/s²", true,
                  [&](std::size_t f, std::size_t i) {
                    double power = log::has_xyz(*logs[f], "a", "_mps2") ? 0 : NAN;
                    for (const char* axis : {"ax_mps2", "ay_mps2", "az_mps2"})
                      power += std::isnan(power) ? 0 : power_within(seen.windows[i], *logs[f], axis, band);
                    return std::pair(cell_of(seen.windows[i]),
                                     power > 0 ? std::log(power) / 2 : static_cast<double>(NAN));
                  }),
        "no acceleration, or no window that is long enough");
  }
}

void add_energy(FlightMeasures& all, const Observations& seen, const std::vector<const log::FlightLog*>& logs) {
  auto thrust = by_window(seen, "thrust command", "of full", true, [&](std::size_t f, std::size_t i) {
    const auto& log = *logs[f];
    if (!log.has("thrust")) return std::pair(Cell(), static_cast<double>(NAN));
    return std::pair(cell_of(seen.windows[i]),
                     ln_mean(seen.windows[i], log, [&](std::size_t k) { return log.column("thrust")[k]; }));
  });
  add(all, std::move(thrust), "no thrust column");
  FlightMeasure battery{"battery's fall", "V/min", false, {}};
  for (std::size_t f = 0; f < seen.flights; ++f) {
    double n = 0, t = 0, u = 0, tt = 0, tu = 0;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1] && logs[f]->has("battery_v"); ++i) {
      const auto& w = seen.windows[i];
      n += 1;
      t += w.t;
      u += w.voltage;
      tt += w.t * w.t;
      tu += w.t * w.voltage;
    }
    const double slope = (n * tu - t * u) / (n * tt - t * t);
    if (n >= kBeforeAfterRules.fewest_windows && std::isfinite(slope)) battery.values.push_back({f, {}, -60 * slope});
  }
  add(all, std::move(battery), "no battery_v column");
}

/// Speed, commanded acceleration and distance to the nearest surface, each flight in one cell.
void add_flown(FlightMeasures& all, const Observations& seen) {
  const auto flown = [&](const char* name, const char* unit, const auto& of) {
    all.flown.push_back(by_window(seen, name, unit, true, [&](std::size_t, std::size_t i) {
      return std::pair(Cell(), std::log(of(seen.windows[i])));
    }));
  };
  flown("speed", "m/s", [](const WindowRow& w) { return std::max(w.speed, kWindowRules.still_command.value); });
  flown("commanded acceleration", "m/s²", [](const WindowRow& w) {
    return w.led
               ? std::sqrt(w.led->asked2.sum() + w.led->asked_W.squaredNorm() + std::pow(kWindowRules.still_command, 2))
               : static_cast<double>(NAN);
  });
  flown("distance to the nearest surface", "m",
        [](const WindowRow& w) { return std::min(nearest_surface(w), kBeforeAfterRules.farthest_cell.value); });
}

}  // namespace

FlightMeasures measures_of(const Observations& seen, const std::vector<const log::FlightLog*>& logs,
                           const Vehicle& vehicle) {
  FlightMeasures all;
  add_variances(all, seen);
  add_tracking(all, seen, logs);
  add_delays(all, seen, vehicle);
  add_vibration(all, seen, logs);
  const auto kept = logged_alike(logs);
  for (auto& measure : all.tested) std::erase_if(measure.values, [&](const auto& v) { return !kept[v.flight]; });
  if (const auto out = std::ranges::count(kept, 0); out > 0)
    all.not_tested.emplace_back(
        formatted("all but thrust command and battery of %zd of %zu flights", out, logs.size()),
        "they log other columns than most, at another rate, or set-points at other times: log all alike");
  add_energy(all, seen, logs);
  add_flown(all, seen);
  return all;
}

}  // namespace backwash::study
