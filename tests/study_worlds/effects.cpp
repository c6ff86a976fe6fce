// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/effects.hpp"

#include <cmath>

#include "tests/study_worlds/plan.hpp"

namespace study_worlds {
namespace {

auto between(double low, double high) {
  return [low, high](std::mt19937_64& rng) { return std::uniform_real_distribution(low, high)(rng); };
}
double one_of_four(std::mt19937_64& rng) { return std::floor(between(0, 4)(rng)); }

Vec3 level(double direction) { return {std::cos(direction), std::sin(direction), 0}; }
Vec3 up(double push) { return {0, 0, push}; }

/// Defined at the same reference on both sides.
std::optional<double> same(double s, double) { return s; }
std::optional<double> along_x(double s, double direction) { return s * std::cos(direction); }
std::optional<double> along_y(double s, double direction) { return s * std::sin(direction); }

/// 1/(1 − (R/4d)²) − 1, the source doublet's image, scaled to 1 at d_ref.
double image_doublet(double radius, double d, double d_ref) {
  const auto gain = [&](double x) {
    const double q = radius / (4 * std::max({x, 0.3 * radius, 0.22}));  // no closer: the hull touches
    return 1 / (1 - q * q) - 1;
  };
  return gain(d) / gain(d_ref);
}

/// −∇ of the potential −1/(1 + d/L) per wall, scaled to 1 at 0.4 m; towards the wall.
Vec3 wall_pull(const Room& room, const Vec3& p, double length) {
  const auto pull = [&](double d) {
    const double q = 1 + std::max(d, 0.0) / length, q_ref = 1 + 0.4 / length;
    return std::pow(q_ref / q, 2) * std::exp(-std::max(d, 0.0) / (4 * length)) / std::exp(-0.4 / (4 * length));
  };
  const Box& in = room.inside;
  return {pull(in.high.x() - p.x()) - pull(p.x() - in.low.x()), pull(in.high.y() - p.y()) - pull(p.y() - in.low.y()),
          0};
}

/// Inflow through the disk that a climb adds to that of a hover, doubled: as large as the climb where that is slow.
/// Momentum theory: (v_i + v_z) v_i = v_h².
double more_inflow(const Craft& craft, double climb) {
  constexpr double kAir = 1.2;  // kg/m³
  const double disks = 4 * M_PI * craft.rotor_radius * craft.rotor_radius;
  const double hover2 = craft.mass * 9.81 / (2 * kAir * disks);
  return climb + 2 * (std::sqrt(climb * climb / 4 + hover2) - std::sqrt(hover2));
}

/// Outside the catalogue: a push along a direction.
Vec3 unnamed_push(const Acting& a) {
  const HiddenStructure& what = a.world.effects.structure;
  if (what.where == HiddenStructure::Where::variance) return Vec3::Zero();
  return a.s * value_at(what, a.now) *
         (what.where == HiddenStructure::Where::up ? Vec3::UnitZ() : level(what.direction));
}

/// The same in ln variance, where 0.15 m/s² is 0.6.
double unnamed_ln_variance(const Acting& a) {
  const HiddenStructure& what = a.world.effects.structure;
  return what.where == HiddenStructure::Where::variance ? 4 * a.s * value_at(what, a.now) : 0;
}

Vec3 ceiling_push(const Acting& a) {
  const double gap = a.world.room.gap_to_ceiling(a.now.p);
  return std::isfinite(gap) ? up(a.s * image_doublet(a.shape, gap, 0.3)) : Vec3(Vec3::Zero());
}

/// Causes that push.
std::map<std::string, HiddenCause> pushes() {
  const auto after_100_s = [](double share) -> Truth {
    return [share](double s, double) { return 1.6 * (1 - std::exp(-1.0)) * s * share; };
  };
  return {
      {"ground_thrust",  // m/s² 0.4 m above the ground; effective radius, m
       {.size = 0.12,
        .shape = between(0.3, 0.7),
        .push = [](auto& a) { return up(a.s * image_doublet(a.shape, a.world.room.height_above_solid(a.now.p), 0.4)); },
        .truth = {{"A_mps2", same}}}},
      {"ceiling",  // m/s² 0.3 m below the ceiling; effective radius, m
       {.size = 0.12,
        .one_signed = true,
        .shape = between(0.3, 0.7),
        .push = ceiling_push,
        .truth = {{"A_mps2", same}}}},
      {"wall_attraction",  // m/s² 0.4 m from the wall; length of the potential, m
       {.size = 0.12,
        .shape = between(0.15, 0.4),
        .push = [](auto& a) -> Vec3 { return a.s * wall_pull(a.world.room, a.now.p, a.shape); },
        .truth = {{"A_mps2", same}}}},
      {"battery_sag",  // relative thrust per relative voltage: thrust goes with a power of the loaded voltage
       {.size = 0.4,
        .one_signed = true,
        .push = [](auto& a) { return up(a.now.thrust_acc * (std::pow(1 - a.now.voltage_drop, a.s) - 1)); },
        .truth = {{"s", same}}}},
      {"payload",  // relative mass
       {.size = 0.02,
        .push = [](auto& a) { return up(a.now.thrust_acc * (1 / (1 + a.s) - 1)); },
        .truth = {{"m", same}}}},
      {"trim",  // m/s² in the body's horizontal plane
       {.size = 0.12,
        .push = [](auto& a) -> Vec3 { return a.s * level(a.shape + a.now.yaw); },
        .truth = {{"body_x_mps2", along_x}, {"body_y_mps2", along_y}}}},
      {"draft",  // m/s² in the world's horizontal plane
       {.size = 0.12,
        .push = [](auto& a) -> Vec3 { return a.s * (1 + 0.3 * std::sin(2 * M_PI * a.now.t / 23)) * level(a.shape); },
        .truth = {{"x_mps2", along_x}, {"y_mps2", along_y}}}},
      {"rotor_drag",  // 1/s at rest; the study's linear drag is defined at 1 m/s
       {.size = 0.2,
        .one_signed = true,
        .push = [](auto& a) -> Vec3 {
          return -a.s * Vec3(a.now.v.x(), a.now.v.y(), 0) * (1 + 0.15 * a.now.v.template head<2>().norm());
        },
        .truth = {{"k_per_s", [](double s, double) { return s * (1 + 0.15); }}}}},
      {"inflow",  // 1/s at rest
       {.size = 0.2,
        .one_signed = true,
        .push = [](auto& a) { return up(-a.s * more_inflow(a.world.craft, a.now.v.z())); },
        .truth = {{"k_per_s", same}}}},
      {"imu_drift",  // m/s² per 100 s; a push that the accelerometer alone feels
       {.size = 0.2,
        .truth = {{"x_mps2_per_100s", [=](double s, double d) { return after_100_s(std::cos(d))(s, d); }},
                  {"y_mps2_per_100s", [=](double s, double d) { return after_100_s(std::sin(d))(s, d); }},
                  {"z_mps2_per_100s", after_100_s(0.3)}}}},
      {"unknown",  // m/s², or a quarter of ln variance, root mean square
       {.size = 0.15, .push = unnamed_push, .ln_variance = unnamed_ln_variance}}};
}

/// All others.
std::map<std::string, HiddenCause> others() {
  // All surfaces are at whole decimetres and so are the map's voxels: it shows the offset to the nearest of them.
  const auto shown = [](double offset) { return 0.1 * std::round(offset / 0.1); };
  return {
      {"recirculation",  // ln variance in the end; s
       {.size = 0.8,
        .shape = between(15, 50),
        .ln_variance = [](auto& a) { return a.s * std::tanh(a.now.t / a.shape); },
        .truth = {{"B_ln", same}}}},
      {"forward_speed",  // ln variance at 1 m/s
       {.size = 1.0,
        .ln_variance = [](auto& a) { return a.s * std::log1p(std::pow(a.now.v.norm(), 1.5)) / std::log(2.0); },
        .truth = {{"B_ln", same}}}},
      {"thrust_slope", {.size = 0.12, .truth = {{"s", same}}}},  // relative slope of the thrust curve at hover
      // s; integrated in steps at whose beginning the lag hears the command already: b − r = h/(e^(h/τ) − 1) ṙ.
      {"actuator_lag",
       {.size = 0.05,
        .one_signed = true,
        .truth = {{"tau_s", [](double s, double) { return kStep / std::expm1(kStep / s); }}, {"lag_s", same}}}},
      {"command_latency", {.size = 0.06, .one_signed = true, .truth = {{"latency_s", same}}}},  // s
      {"vibration", {.size = 0.25, .one_signed = true}},  // m/s², amplitude of the rotors' line
      {"map_offset",                                      // m
       {.size = 0.25,
        .one_signed = true,
        .truth = {{"x_m", [=](double s, double d) { return shown(s * std::cos(d)); }},
                  {"y_m", [=](double s, double d) { return shown(s * std::sin(d)); }}}}},
      {"heavy_tails", {.size = 1.0, .one_signed = true}},  // ln of the kurtosis over 3
      {"propeller_damage",                                 // relative thrust of one rotor; which
       {.size = 0.06,
        .one_signed = true,
        .shape = one_of_four,
        .truth = {{"d", [](double s, double) { return 1 / (1 - s) - 1; }}}}},
      {"rotor_sensor_fault",  // relative reading of one rotor, or share of dropouts; which
       {.size = 0.05,
        .shape = one_of_four,
        .truth = {{"e", [](double s, double) { return s > 0 ? std::optional((1 + s) * (1 + s) - 1) : std::nullopt; }},
                  {"share", [](double s, double) { return s < 0 ? std::optional(-s) : std::nullopt; }}}}}};
}

}  // namespace

const std::map<std::string, HiddenCause>& causes() {
  static const std::map<std::string, HiddenCause> all = [] {
    auto each = pushes();
    each.merge(others());
    return each;
  }();
  return all;
}

Vec3 hidden_push(const HiddenWorld& world, const Instant& now) {
  Vec3 push = Vec3::Zero();
  for (const auto& [name, s] : world.effects.size)
    if (const auto& cause = causes().at(name); cause.push && s != 0)
      push += cause.push({world, now, s, world.effects.shape_of(name)});
  return push;
}

double hidden_ln_variance(const HiddenWorld& world, const Instant& now) {
  const Vec3 wall = (now.p - world.room.inside.low).cwiseMin(world.room.inside.high - now.p);
  double ln = wall.head<2>().minCoeff() < 0.7 ? std::log(world.request.rough_walls) : 0;
  for (const auto& [name, s] : world.effects.size)
    if (const auto& cause = causes().at(name); cause.ln_variance && s != 0)
      ln += cause.ln_variance({world, now, s, world.effects.shape_of(name)});
  return ln;
}

}  // namespace study_worlds
