// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/effects.hpp"

#include <cmath>

namespace study_worlds {
namespace {

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

/// Causes that no name of the catalogue covers.
Vec3 outside_the_catalogue(const World& world, const Instant& now) {
  const double s = world.effects.of("unknown");
  switch (static_cast<int>(world.effects.shape_of("unknown"))) {
    case 0:  // a standing wave of pressure along the room
      return {0, 0, s * std::sqrt(2.0) * std::sin(2 * M_PI * now.p.y() / 1.9)};
    case 1:  // the vehicle's heading disturbs its height
      return {0, 0, s * std::sqrt(2.0) * std::cos(2 * now.yaw)};
    case 2:  // a jet at one height
      return Vec3(s, s, 0) * 1.5 * std::exp(-std::pow((now.p.z() - 1.1) / 0.18, 2));
    default:  // warmth in the middle of the range
      return {0, 0, 2 * s * std::exp(-std::pow((now.temperature - 31) / 2.0, 2))};
  }
}

}  // namespace

Vec3 hidden_push(const World& world, const Instant& now) {
  const Effects& e = world.effects;
  const Vec3 down(0, 0, -1), up(0, 0, 1);
  Vec3 push = Vec3::Zero();
  if (const double s = e.of("ground_thrust"); s != 0)
    push += s * up * image_doublet(e.shape_of("ground_thrust"), world.room.height_above_solid(now.p), 0.4);
  if (const double s = e.of("ceiling"); s != 0 && std::isfinite(world.room.gap_to_ceiling(now.p)))
    push += s * up * image_doublet(e.shape_of("ceiling"), world.room.gap_to_ceiling(now.p), 0.3);
  if (const double s = e.of("wall_attraction"); s != 0)
    push += s * wall_pull(world.room, now.p, e.shape_of("wall_attraction"));
  if (const double s = e.of("battery_sag"); s != 0)  // thrust goes with a power of the loaded voltage
    push += now.thrust_acc * up * (std::pow(1 - now.voltage_drop, s) - 1);
  if (const double s = e.of("payload"); s != 0) push += now.thrust_acc * up * (1 / (1 + s) - 1);
  if (const double s = e.of("trim"); s != 0) {
    const double direction = e.shape_of("trim") + now.yaw;
    push += s * Vec3(std::cos(direction), std::sin(direction), 0);
  }
  if (const double s = e.of("draft"); s != 0) {
    const double direction = e.shape_of("draft");
    push += s * (1 + 0.3 * std::sin(2 * M_PI * now.t / 23)) * Vec3(std::cos(direction), std::sin(direction), 0);
  }
  if (const double s = e.of("rotor_drag"); s != 0)
    push -= s * Vec3(now.v.x(), now.v.y(), 0) * (1 + 0.15 * now.v.head<2>().norm());
  if (e.of("unknown") != 0) push += outside_the_catalogue(world, now);
  return push;
}

double hidden_ln_variance(const World& world, const Instant& now) {
  const Effects& e = world.effects;
  double ln = 0;
  if (const double s = e.of("recirculation"); s != 0) ln += s * std::tanh(now.t / e.shape_of("recirculation"));
  if (const double s = e.of("forward_speed"); s != 0) ln += s * std::log1p(std::pow(now.v.norm(), 1.5)) / std::log(2.0);
  return ln;
}

}  // namespace study_worlds
