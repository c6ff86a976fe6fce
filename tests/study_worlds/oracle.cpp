// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/oracle.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/study/effects/columns.hpp"
#include "tests/study_worlds/plan.hpp"

namespace study_worlds {

namespace study = backwash::study;

namespace {

/// The generator's own value of the study's parameter, by name of cause and parameter; `s` the size, `angle` the shape.
std::optional<double> truth_of(const std::string& cause, const std::string& parameter, double s, double angle) {
  const std::string key = cause + "." + parameter;
  // Sizes that are defined at the same reference on both sides.
  for (const char* same : {"ground_thrust.A_mps2", "ceiling.A_mps2", "wall_attraction.A_mps2", "forward_speed.B_ln",
                           "recirculation.B_ln", "battery_sag.s", "thrust_slope.s", "command_latency.latency_s"})
    if (key == same) return s;
  // Integrated in steps at whose beginning the lag hears the command already: b − r = h/(e^(h/τ) − 1) ṙ.
  if (key == "actuator_lag.tau_s") return kStep / std::expm1(kStep / s);
  if (key == "payload.m") return 1 - 1 / (1 + s);
  if (key == "trim.body_x_mps2" || key == "draft.x_mps2") return s * std::cos(angle);
  if (key == "trim.body_y_mps2" || key == "draft.y_mps2") return s * std::sin(angle);
  // Drag per speed at 1 m/s, where the study's linear drag is defined; s is the slope at rest.
  if (key == "rotor_drag.k_per_s") return s * (1 + 0.15);
  // All surfaces are at whole decimetres and so are the map's voxels: it shows the offset to the nearest of them.
  const auto shown = [](double offset) { return 0.1 * std::round(offset / 0.1); };
  if (key == "map_offset.x_m") return shown(s * std::cos(angle));
  if (key == "map_offset.y_m") return shown(s * std::sin(angle));
  const double after_100_s = 1.6 * (1 - std::exp(-1.0)) * s;
  if (key == "imu_drift.x_mps2_per_100s") return after_100_s * std::cos(angle);
  if (key == "imu_drift.y_mps2_per_100s") return after_100_s * std::sin(angle);
  if (key == "imu_drift.z_mps2_per_100s") return after_100_s * 0.3;
  if (key == "propeller_damage.d") return -std::log(1 - s);
  if (key == "rotor_sensor_fault.e" && s > 0) return 2 * std::log(1 + s);
  if (key == "rotor_sensor_fault.share" && s < 0) return -s;
  return std::nullopt;
}

/// Mean over each window, and `beyond` seconds on both sides, of what is hidden at its flight's rows.
std::vector<double> window_means(const study::Observations& seen, const std::vector<Table>& flights,
                                 const std::function<double(const Hidden&)>& value, double beyond) {
  std::vector<double> means;
  for (const auto& w : seen.windows) {
    const Table& flight = flights[w.flight];
    double sum = 0, n = 0;
    for (std::size_t i = 0; i < flight.rows.size(); ++i) {
      const double t = flight.rows[i][0] - flight.rows[0][0];
      if (std::abs(t - w.t) <= 0.5 * w.duration + beyond + 1e-9) sum += value(flight.hidden[i]), n += 1;
    }
    means.push_back(n > 0 ? sum / n : 0);
  }
  return means;
}

/// ln of what the bursts did to the kurtosis of the gusts: E m⁴/(E m²)² of the factor m that was flown. The table's
/// size sets the bursts' height, and would be this only if they filled another share of the time.
double flown_tail(const std::vector<Table>& flights) {
  double square = 0, fourth = 0, n = 0;
  for (const auto& flight : flights)
    for (const Hidden& h : flight.hidden) square += std::pow(h.burst, 2), fourth += std::pow(h.burst, 4), n += 1;
  return std::log(n * fourth / (square * square));
}

}  // namespace

std::vector<Compared> compare(const World& world, const std::vector<Table>& flights, const study::Accepted& found) {
  const std::string& cause = found.form->cause();
  std::vector<Compared> all;
  for (const auto& p : found.parameters)
    if (const auto truth = truth_of(cause, p.name, world.effects.of(cause), world.effects.shape_of(cause)))
      all.push_back({p.name, p.value, p.low, p.high, *truth, {}});
  if (cause == "heavy_tails")
    for (const auto& p : found.parameters) all.push_back({p.name, p.value, p.low, p.high, flown_tail(flights), {}});
  return all;
}

std::optional<double> parameter_error(const std::vector<Compared>& compared) {
  double off = 0, size = 0;
  for (const auto& c : compared) off += std::pow(c.value - c.truth, 2), size += c.truth * c.truth;
  if (compared.empty()) return std::nullopt;
  return std::sqrt(off / size);
}

namespace {

/// What a sagging battery takes goes with the thrust and the current, and both answer the gusts that the residual
/// holds: the part of its hidden push that varies within seconds fits the residual with 14 to 19 times its size. So its
/// column is a mean over 18 s.
constexpr double kBeyondOfBattery = 8;  // s

study::Column oracle_column(const study::Observations& seen, const std::vector<Table>& flights, double beyond) {
  study::Column column;
  const auto add = [&](study::Channel channel, const std::function<double(const Hidden&)>& value) {
    auto x = window_means(seen, flights, value, beyond);
    if (std::any_of(x.begin(), x.end(), [](double v) { return std::abs(v) > 1e-9; }))
      column.parts.push_back({channel, std::move(x)});
  };
  for (int i = 0; i < 3; ++i)
    add(static_cast<study::Channel>(study::kMeanX + i), [i](const Hidden& h) { return h.push[i]; });
  for (const auto c : {study::kVarX, study::kVarY, study::kVarZ}) add(c, [](const Hidden& h) { return h.ln_variance; });
  return column;
}

/// The columns in those channels alone that the oracle moves.
std::vector<study::Column> seen_by(const study::Column& oracle, std::vector<study::Column> columns) {
  for (auto& column : columns)
    std::erase_if(column.parts, [&](const auto& part) {
      return std::none_of(oracle.parts.begin(), oracle.parts.end(), [&](auto& o) { return o.channel == part.channel; });
    });
  return columns;
}

}  // namespace

void compare_with_oracle(Outcome& outcome, const study::Accepted& found, const study::Observations& seen,
                         const std::vector<Table>& flights) {
  const double beyond = found.form->cause() == "battery_sag" ? kBeyondOfBattery : 0;
  const study::Column column = oracle_column(seen, flights, beyond);
  if (column.parts.empty()) return;
  study::Evidence evidence(seen);
  evidence.whiten({column});
  std::vector<study::Column> both = found.columns, free;
  both.push_back(column);
  if (!found.form->constant) free = study::offsets(both, seen);
  const auto gain = [&](const std::vector<study::Column>& columns) {
    const auto normal = evidence.normal(columns, free);
    return normal.solvable ? normal.gain() : 0.0;
  };
  const double oracle = gain({column});
  if (oracle > 0) outcome.gain_share = gain(found.columns) / oracle;

  // An interval that is averaged over several shapes is about the size and not about one form's nearest value.
  if (!found.form->shapes.empty()) return;
  auto comparable = seen_by(column, found.columns);
  comparable.push_back(column);
  const auto A = evidence.normal(comparable, free).total;
  const auto p = A.rows() - 1;
  const Eigen::VectorXd best = A.topLeftCorner(p, p).ldlt().solve(A.topRightCorner(p, 1));
  for (auto& c : outcome.compared)
    for (Eigen::Index k = 0; k < p; ++k)
      if (found.form->parameters[static_cast<std::size_t>(k)] == c.name) c.best = best[k];
}

}  // namespace study_worlds
