// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/table.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "core/study/effects/effect_rules.hpp"
#include "core/study/effects/regressors.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study {

// The table: an effect's file, and its line here in both lists.
Effect ground_thrust(), ceiling(), wall_attraction(), recirculation(), forward_speed(), battery_sag(), thrust_slope(),
    payload(), trim(), draft(), rotor_drag(), inflow(), actuator_lag(), command_latency(), imu_drift(), vibration(),
    map_offset(), heavy_tails(), propeller_damage(), rotor_sensor_fault();

namespace {

constexpr Effect (*kEffects[])() = {
    ground_thrust, ceiling,   wall_attraction, recirculation, forward_speed,    battery_sag,       thrust_slope,
    payload,       trim,      draft,           rotor_drag,    inflow,           actuator_lag,      command_latency,
    imu_drift,     vibration, map_offset,      heavy_tails,   propeller_damage, rotor_sensor_fault};

/// Windows in which everything that a column may be made of varies.
Observations drawn_windows() {
  Observations seen;
  std::minstd_rand rng;
  std::uniform_real_distribution<double> half_to_one(0.5, 1.0);
  const auto draw = [&] { return half_to_one(rng); };
  const auto vector = [&]() -> Vec3 { return {draw(), -draw(), draw()}; };
  for (int i = 0; i < kEffectRules.drawn_windows; ++i) {
    WindowRow w{};
    w.t = 10 * draw();
    w.duration = kWindowRules.window_length;
    w.p_W = vector();
    w.v_W = vector();
    w.speed = draw();
    for (auto* all : {&w.speeds, &w.shares, &w.climbs, &w.delay_at, &w.slope_at})
      for (double& x : *all) x = draw();
    for (auto* pair : {&w.delay_gain, &w.slope_gain, &w.mean_gain, &w.command_gain, &w.lag_gain})
      *pair = {draw(), -draw()};
    w.drag_gain = draw();
    w.tilt_gain = draw();
    w.R_WB = Eigen::AngleAxisd(4 * draw(), Vec3::UnitZ()).toRotationMatrix();
    w.thrust_acc = kGravity * draw();
    w.voltage = 10 * draw();
    w.temperature = 50 * draw();
    w.around.height = draw();
    w.around.ceiling_gap = draw();
    w.around.walls = w.around.whole_walls = {{draw(), w.body_axis(0)}};
    w.path.assign(kPoints, w.around);
    w.led = WindowRow::Led{vector().cwiseAbs(), vector(), vector(), vector().cwiseAbs(), vector()};
    w.varied2 = vector().cwiseAbs();
    w.sigma = vector().cwiseAbs();
    for (Vec3& ln : w.ln_sigma_moved) ln = vector();
    seen.windows.push_back(std::move(w));
  }
  return seen;
}

bool of_variances(const DesignColumn& column) {
  return std::ranges::all_of(column.parts, [](auto& p) { return p.channel >= kVarX && p.channel <= kVarZ; });
}

/// All channels of a column behind each other.
Eigen::VectorXd stacked(const DesignColumn& column, std::size_t windows) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kChannels * windows));
  for (const auto& part : column.parts)
    for (std::size_t i = 0; i < windows; ++i) x[static_cast<Eigen::Index>(part.channel * windows + i)] += part.x[i];
  return x;
}

}  // namespace

std::optional<std::string> stays_free(const Form& form) {
  const Observations seen = drawn_windows();
  const auto columns = form.columns(seen.windows, form.scales.front());
  auto free = offsets(columns, seen);
  if (form.constant) std::erase_if(free, [](auto& column) { return !of_variances(column); });
  Eigen::MatrixXd N(static_cast<Eigen::Index>(kChannels * seen.windows.size()), static_cast<Eigen::Index>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k)
    N.col(static_cast<Eigen::Index>(k)) = stacked(free[k], seen.windows.size());
  for (const auto& column : columns) {
    const Eigen::VectorXd x = stacked(column, seen.windows.size());
    const Eigen::VectorXd left =
        free.empty() ? x : Eigen::VectorXd(x - N * N.completeOrthogonalDecomposition().solve(x));
    if (!(left.squaredNorm() <= kEffectRules.left_of_free * x.squaredNorm())) continue;
    return "cannot be told: '" + form.formula + "' is spanned by what stays free: offsets" +
           (of_variances(column) ? ", and of Σ the level, which is each craft's own (calibrate measures it)" : "");
  }
  return std::nullopt;
}

const std::string& Form::cause() const { return effect->name; }

double Form::prior_nats(std::span<const double> sizes) const {
  double square = 0;
  for (std::size_t k = 0; k < priors.size(); ++k) square += std::pow(sizes[k] / priors[k].typical, 2);
  return 0.5 * static_cast<double>(priors.size() + 1) * std::log1p(square);
}

std::vector<Scale> scales_of(std::initializer_list<double> values) {
  std::vector<Scale> scales;
  for (const double v : values) scales.push_back({v});
  return scales;
}

const std::vector<Effect>& effects() {
  static const std::vector<Effect> all = [] {
    std::vector<Effect> made;
    for (const auto make : kEffects) made.push_back(make());
    for (Effect& e : made)
      for (Form& f : e.forms) {
        f.effect = &e;
        if (const auto why = stays_free(f)) throw std::logic_error(e.name + " " + *why);
        for (Form& shape : f.shapes) {
          shape.effect = &e;
          shape.parameters = f.parameters;
        }
      }
    return made;
  }();
  return all;
}

const std::vector<const Form*>& catalogue() {
  static const std::vector<const Form*> all = [] {
    std::vector<const Form*> forms;
    for (const Effect& e : effects())
      for (const Form& f : e.forms) forms.push_back(&f);
    return forms;
  }();
  return all;
}

std::optional<std::string> why_not_tested(const Form& form, const Observations& seen) {
  for (const Source needed : form.needs)
    if (!seen.has(needed)) return seen.missing.at(needed);
  if (form.not_flown)
    if (auto why = form.not_flown(seen)) return why;
  if (seen.windows.empty()) return "no good window";
  for (const auto& column : form.columns(seen.windows, form.scales.front()))
    if (std::any_of(column.parts.begin(), column.parts.end(), [&](auto& p) { return seen.measured(p.channel); }))
      return std::nullopt;
  if (!(seen.has(Source::thrust) && seen.has(Source::attitude)) && !seen.has(Source::setpoints))
    return "without thrust and attitude or set-points no push shows, and other effects in hover only";
  if (!seen.has(Source::acceleration))
    return seen.missing.at(Source::acceleration) + ": of differentiated motion the gusts are not told from its noise";
  return "no window measures it";
}

const char* to_string(RemedyIn in) noexcept {
  constexpr const char* kNames[] = {"vehicle", "model", "map", "craft", "place"};
  return kNames[static_cast<std::size_t>(in)];
}

Remedy by_extension(const FittedForm& fitted) {
  return {RemedyIn::model, {}, "Fly with the model that --out writes: it holds " + fitted.form.cause() + "."};
}

Remedy with_craft(std::string words) { return {RemedyIn::craft, {}, std::move(words)}; }

std::function<Remedy(const FittedForm&, const Vehicle&)> always(RemedyIn in, std::string words) {
  return [remedy = Remedy{in, {}, std::move(words)}](auto&, auto&) { return remedy; };
}

Remedy in_vehicle(std::vector<Remedy::Set> set, const std::string& lead) {
  std::string words;
  for (const auto& [key, from, to] : set)
    words += formatted("%s %s to %.3g", words.empty() ? "change" : " and", key.c_str(), to);
  return {RemedyIn::vehicle, std::move(set), lead + ": " + words + " in the vehicle file."};
}

std::string rotor_of(const FittedForm& fitted) {
  return "rotor " + std::to_string(std::lround(fitted.scale.value) + 1);
}

}  // namespace backwash::study
