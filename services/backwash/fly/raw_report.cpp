// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/fly/raw_report.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "core/log/autopilot/airframe.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/report/page/chart.hpp"
#include "core/report/page/page.hpp"
#include "core/types/formatted.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/plan/logged_vehicle.hpp"
#include "services/backwash/plan/shown_gains.hpp"

namespace backwash::services {
namespace {

struct Flown {
  double seconds = 0, length_m = 0, most_mps = 0, low_m = 0, high_m = 0;
};

Flown flown_of(const log::FlightLog& log) {
  Flown flown{log.t_s.back() - log.t_s.front(), 0, 0, 0, 0};
  const auto heights = std::ranges::minmax(log.column("z_m"));
  flown.low_m = heights.min;
  flown.high_m = heights.max;
  for (std::size_t k = 0; k < log.t_s.size(); ++k) {
    if (log.has("vz_mps")) flown.most_mps = std::max(flown.most_mps, log::xyz(log, "v", "_mps", k).norm());
    if (k > 0) flown.length_m += (log::xyz(log, "", "_m", k) - log::xyz(log, "", "_m", k - 1)).norm();
  }
  return flown;
}

/// An octave of the acceleration: rms along each axis of the body, m/s².
struct Band {
  double low_hz, high_hz;
  std::array<double, 3> rms;
};
struct Vibration {
  std::string topic;
  double rate_hz = 0, peak_hz = 0;  ///< how often it was logged; where most of it is, from 5 Hz on
  std::vector<Band> bands;
  std::array<report::Run, 3> density;  ///< common logarithms of Hz and (m/s²)²/Hz, along each axis of the body
};

/// Welch's spectrum (Hann, halves overlapping) of the accelerometer that was logged most often, in octaves below half
/// its rate: what is faster folds back.
std::optional<Vibration> vibration_of(const log::TopicLog& topics) {
  constexpr std::size_t kRows = 256;
  const log::TopicLog::Topic* best = nullptr;
  std::string field;
  for (const auto& [name, of] : {std::pair{"sensor_combined", "accelerometer_m_s2"}, {"vehicle_acceleration", "xyz"}})
    if (const auto* topic = topics.find(name);
        topic && topic->columns.contains(std::string(of) + "[2]") && (!best || topic->t_s.size() > best->t_s.size()))
      std::tie(best, field) = std::pair{topic, std::string(of)};
  if (!best || best->t_s.size() < 2 * kRows) return std::nullopt;
  std::vector<double> steps;
  for (std::size_t k = 1; k < best->t_s.size(); ++k) steps.push_back(best->t_s[k] - best->t_s[k - 1]);
  std::ranges::nth_element(steps, steps.begin() + std::ssize(steps) / 2);
  const double step = steps[steps.size() / 2];
  if (!(step > 0)) return std::nullopt;
  Vibration vibration{best->name, 1 / step, 0, {}, {}};
  std::array<std::vector<double>, 3> power;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& rows = best->columns.at(field + "[" + std::to_string(axis) + "]");
    power[axis].assign(kRows / 2, 0);
    double parts = 0;
    for (std::size_t first = 0; first + kRows <= rows.size(); first += kRows / 2) {
      if (best->t_s[first + kRows - 1] - best->t_s[first] > 1.5 * step * kRows) continue;  // a gap
      double mean = 0;
      for (std::size_t k = 0; k < kRows; ++k) mean += rows[first + k] / kRows;
      parts += 1;
      for (std::size_t f = 1; f < kRows / 2; ++f) {
        std::complex<double> sum = 0;
        for (std::size_t k = 0; k < kRows; ++k) {
          const double angle = 2 * std::numbers::pi * static_cast<double>(k) / kRows;
          sum += (rows[first + k] - mean) * (1 - std::cos(angle)) * std::polar(1.0, -angle * static_cast<double>(f));
        }
        power[axis][f] += 2 * std::norm(sum) / (1.5 * kRows * kRows);  // (1 − cos) has the mean square 3/2
      }
    }
    if (parts == 0) return std::nullopt;
    for (double& p : power[axis]) p /= parts;
  }
  const double width = 1 / (step * kRows);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t f = 1; f < kRows / 2; ++f)
      if (power[axis][f] > 0)
        vibration.density[axis].emplace_back(std::log10(width * static_cast<double>(f)),
                                             std::log10(power[axis][f] / width));
  double most = 0;
  for (double low = 1; low < 0.5 / step; low *= 2) {
    Band band{low, std::min(2 * low, 0.5 / step), {}};
    for (std::size_t f = 1; f < kRows / 2; ++f) {
      const double hz = width * static_cast<double>(f);
      double all = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        all += power[axis][f];
        if (hz >= low && hz < band.high_hz) band.rms[axis] += power[axis][f];
      }
      if (hz > 5 && all > most) std::tie(most, vibration.peak_hz) = std::pair{all, hz};
    }
    for (double& rms : band.rms) rms = std::sqrt(rms);
    vibration.bands.push_back(band);
  }
  return vibration;
}

/// What a log can be asked, and what another one would need.
struct Question {
  std::string asks, without;  ///< empty: this log answers it
};

std::vector<Question> questions_of(const LoggedVehicle& logged, const Flown& flown) {
  const auto& log = logged.flight;
  const bool px4 = logged.kind.find("PX4") != std::string::npos;
  const std::string often = px4 ? "set SDLOG_PROFILE to 17" : "set the IMU and fast attitude bits of LOG_BITMASK";
  const auto when = [](bool good, const std::string& without) { return good ? "" : without; };
  std::vector<Question> questions{
      {"variance of the air in hover", when(log.has("ax_mps2"), "no acceleration: " + often)},
      {"thrust, mass and battery's sag",
       when(log.has("thrust") && log.has("battery_v"), "no thrust or no battery: log both")},
      {"drag in forward flight",
       when(log.has("qw") && flown.most_mps > 2, "slower than 2 m/s: fly lines at 3 m/s and more")},
      {"gains, latency and lag of the loop",
       when(log.has("cmd_x_m") && log.has("qw"), "no set-points of the position: log them, fly by position")},
      {"a damaged or heavy rotor", when(log.has("motor4"), "no commands of four motors: log the outputs")},
      {"estimator's jumps and delays", when(log.has("vx_mps"), "no velocities")}};
  if (questions[0].without.empty() && logged.hover_windows < 10)
    questions[0].without =
        formatted("%zu windows of 2 s in hover: hover at ten places, 20 s each", logged.hover_windows);
  return questions;
}

/// What the parameters state beside what the flight shows: name, stated, shown, in words.
using Rows = std::vector<std::array<std::string, 3>>;

Rows loop_rows(const LoggedVehicle& logged) {
  const auto& p = logged.topics.parameters;
  Rows rows;
  const auto hover = stated_hover(p);
  std::string shown = "the log holds no hover";
  if (logged.hover)
    shown = formatted("%.3g (%.3g to %.3g)", logged.hover->value, logged.hover->low, logged.hover->high);
  if (logged.hover && hover) shown += formatted(", %+.0f %%", 100 * (logged.hover->value / hover->second - 1));
  rows.push_back({"hover thrust", hover ? formatted("%s %.4g", hover->first.c_str(), hover->second) : "", shown});
  if (logged.attitude_lag)
    rows.push_back({"attitude lag", "",
                    formatted("%.3g s (%.3g to %.3g)", logged.attitude_lag->value, logged.attitude_lag->low,
                              logged.attitude_lag->high)});
  const auto gains = shown_gains(logged.topics);
  const auto told = [&](const std::string& unit, const std::optional<Shown>* gain, double stated) -> std::string {
    if (!gain) return "";
    if (!*gain) return "cannot be told";
    return formatted("%.3g %s (%.3g to %.3g), %+.0f %%", (*gain)->value, unit.c_str(), (*gain)->low, (*gain)->high,
                     100 * ((*gain)->value / stated - 1));
  };
  const auto *p_xy = &gains.position[0], *p_z = &gains.position[1], *v_xy = &gains.velocity[0],
             *v_z = &gains.velocity[1];
  const struct {
    const std::optional<Shown>* shown;
    const char *name, *unit;
  } kStated[] = {
      {p_xy, "MPC_XY_P", "1/s"},         {v_xy, "MPC_XY_VEL_P_ACC", "1/s"}, {nullptr, "MPC_XY_VEL_I_ACC", "1/s²"},
      {p_z, "MPC_Z_P", "1/s"},           {v_z, "MPC_Z_VEL_P_ACC", "1/s"},   {nullptr, "THR_MDL_FAC", ""},
      {nullptr, "MPC_TILTMAX_AIR", "°"}, {nullptr, "EKF2_EV_DELAY", "ms"},  {p_xy, "PSC_POSXY_P", "1/s"},
      {v_xy, "PSC_VELXY_P", "1/s"},      {p_z, "PSC_POSZ_P", "1/s"},        {v_z, "PSC_VELZ_P", "1/s"},
      {p_xy, "PSC_NE_POS_P", "1/s"},     {v_xy, "PSC_NE_VEL_P", "1/s"},     {p_z, "PSC_D_POS_P", "1/s"},
      {v_z, "PSC_D_VEL_P", "1/s"},       {nullptr, "ANGLE_MAX", "0.01°"},   {nullptr, "MOT_THST_EXPO", ""},
      {nullptr, "VISO_DELAY_MS", "ms"},  {nullptr, "ATC_INPUT_TC", "s"}};
  for (const auto& [gain, name, unit] : kStated)
    if (const auto found = p.find(name); found != p.end())
      rows.push_back({name, formatted("%.4g %s", found->second, unit), told(unit, gain, found->second)});
  if (p.empty()) rows.push_back({"parameters", "none in this log", ""});
  return rows;
}

std::string page_of(const LoggedVehicle& logged, const std::vector<std::string>& first, const Rows& loop,
                    const std::optional<Vibration>& vibration, const std::vector<Question>& questions) {
  std::string body = "<h1>" + report::escaped(logged.path) + "</h1>\n";
  for (const auto& line : first) body += "<p class=\"context\">" + report::escaped(line) + "</p>\n";
  std::string rows = report::heads("", "the log states", "the flight shows");
  for (const auto& [name, stated, shown] : loop) rows += report::row(name, stated, shown);
  body += report::section("Loop", "", report::table(rows, true));
  rows = report::heads("Question", "this log");
  for (const auto& [asks, without] : questions)
    rows += report::row(asks, without.empty() ? std::string("answers it") : without);
  body += report::section("What can be asked", "", report::table(rows, true));
  if (vibration) {
    rows = report::heads("Hz", "x, m/s²", "y, m/s²", "z, m/s²");
    for (const auto& [low, high, rms] : vibration->bands)
      rows += report::row(formatted("%.0f to %.0f", low, high), formatted("%.3g", rms[0]), formatted("%.3g", rms[1]),
                          formatted("%.3g", rms[2]));
    report::Chart chart{{"frequency, Hz"}, {"(m/s²)²/Hz"}};
    chart.x.logarithmic = chart.y.logarithmic = true;
    for (const auto& [axis, kind] :
         {std::pair{0, report::Kind::flown}, {1, report::Kind::commanded}, {2, report::Kind::measured}})
      chart.layers.push_back({report::Shape::line, kind, std::string("along ") + "xyz" [axis], {
                                vibration->density[static_cast<std::size_t>(axis)]
                              }});
    body +=
        report::section("Vibration",
                        report::escaped(formatted("Root mean square by octave, of %s at %.0f Hz; most at %.0f Hz.",
                                                  vibration->topic.c_str(), vibration->rate_hz, vibration->peak_hz)),
                        report::to_svg(chart) + report::table(rows, true));
  }
  return report::html_page(logged.path, body);
}

}  // namespace

int report_of_autopilots_log(const std::string& path, const std::string& vehicle, const std::string& out, bool json,
                             bool force) {
  check_output(out, force);
  const auto logged = logged_vehicle(path);
  const auto flown = flown_of(logged.flight);
  const auto frame = log::airframe_of(logged.topics);
  std::vector<std::string> first{formatted(
      "%s, %d rotors: %.1f s of positions, %.0f s in the air, %.1f m of way, up to %.1f m/s, heights %.1f to %.1f m",
      logged.kind.c_str(), frame.rotors, flown.seconds, logged.airborne_s, flown.length_m, flown.most_mps, flown.low_m,
      flown.high_m)};
  first.insert(first.end(), logged.flight.notes.begin(), logged.flight.notes.end());
  if (!vehicle.empty())
    if (const auto other = another_vehicle(logged.flight, read_vehicle(vehicle)); !other.empty())
      first.push_back(other);
  const auto loop = loop_rows(logged);
  const auto vibration = vibration_of(logged.topics);
  const auto questions = questions_of(logged, flown);
  const auto open = std::ranges::find_if(questions, [](const auto& q) { return !q.without.empty(); });
  if (open != questions.end()) first.push_back("next flight, for " + open->asks + ": " + open->without);
  if (!out.empty()) write_file(out, page_of(logged, first, loop, vibration, questions), force);
  if (json) {
    Json all = {{"log", path},
                {"notes", first},
                {"rotors", frame.rotors},
                {"time_s", flown.seconds},
                {"length_m", flown.length_m},
                {"hover", nullptr},
                {"attitude_lag", nullptr},
                {"gains", nullptr},
                {"vibration", Json::array()},
                {"questions", Json::array()}};
    const auto shown = [](const Shown& s) { return Json{{"value", s.value}, {"low", s.low}, {"high", s.high}}; };
    if (logged.hover) all["hover"] = shown(*logged.hover);
    const auto both = [&](const std::array<std::optional<Shown>, 2>& gains) {
      Json told = Json::array();
      for (const auto& gain : gains) told.push_back(gain ? shown(*gain) : Json(nullptr));
      return told;
    };
    const auto gains = shown_gains(logged.topics);
    all["gains"] = {{"position", both(gains.position)}, {"velocity", both(gains.velocity)}};
    if (logged.attitude_lag) all["attitude_lag"] = shown(*logged.attitude_lag);
    if (vibration)
      for (const auto& [low, high, rms] : vibration->bands)
        all["vibration"].push_back({{"low_hz", low}, {"high_hz", high}, {"rms", rms}});
    for (const auto& [asks, without] : questions) all["questions"].push_back({{"asks", asks}, {"without", without}});
    print(all);
    return kOk;
  }
  for (const auto& line : first) std::printf("%s\n", line.c_str());
  for (const auto& [name, stated, shown] : loop)
    std::printf("%-22s %s%s%s\n", name.c_str(), stated.c_str(),
                stated.empty() || shown.empty() ? "" : "; the flight: ", shown.c_str());
  if (vibration) {
    std::printf("%-22s %s at %.0f Hz, most at %.0f Hz; m/s² rms along x, y, z:\n", "vibration",
                vibration->topic.c_str(), vibration->rate_hz, vibration->peak_hz);
    for (const auto& [low, high, rms] : vibration->bands)
      std::printf("%8.0f to %4.0f Hz       %.3g, %.3g, %.3g\n", low, high, rms[0], rms[1], rms[2]);
  }
  for (const auto& [asks, without] : questions)
    std::printf("%-38s %s\n", asks.c_str(), without.empty() ? "this log answers it" : without.c_str());
  return kOk;
}

}  // namespace backwash::services
