// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <map>
#include <memory>

#include "core/config/config.hpp"
#include "core/field/disturbance_field.hpp"
#include "tests/study_worlds/effects.hpp"
#include "tests/study_worlds/plan.hpp"
#include "tests/study_worlds/world.hpp"

namespace study_worlds {
namespace {

constexpr double kG = 9.80665;

double thrust_of(const Craft& c, double u, double slope) {
  const double f = c.thr_mdl_fac, u0 = [&] {
    const double share = c.mass * kG / c.max_thrust;
    return (std::sqrt((1 - f) * (1 - f) + 4 * f * share) - (1 - f)) / (2 * f);
  }();
  const double nominal = c.max_thrust * (f * u * u + (1 - f) * u);
  const double steeper = c.max_thrust * (2 * f * u0 + 1 - f) * (u - u0);
  return nominal + slope * steeper;
}

double command_of(const Craft& c, double thrust) {
  const double f = c.thr_mdl_fac, share = std::clamp(thrust / c.max_thrust, 0.02, 1.0);
  return (std::sqrt((1 - f) * (1 - f) + 4 * f * share) - (1 - f)) / (2 * f);
}

/// The modelled variances at the middle of each 0.1 m cube that a world's flights pass, computed once.
class Gusts {
 public:
  Gusts(backwash::map::OccupancyGrid grid, const backwash::Model& model)
      : grid_(std::move(grid)), field_(grid_, model) {}
  const Vec3& deviations(const Vec3& p) {
    const std::array<int, 3> cube = {static_cast<int>(std::floor(10 * p.x())), static_cast<int>(std::floor(10 * p.y())),
                                     static_cast<int>(std::floor(10 * p.z()))};
    const auto [at, fresh] = known_.try_emplace(cube);
    if (fresh) {
      const auto s = field_.at(0.1 * (Vec3(cube[0], cube[1], cube[2]) + Vec3::Constant(0.5))).sigma();
      at->second = {std::sqrt(s.xx), std::sqrt(s.yy), std::sqrt(s.zz)};
    }
    return at->second;
  }

 private:
  backwash::map::OccupancyGrid grid_;
  backwash::field::ProximityField field_;
  std::map<std::array<int, 3>, Vec3> known_;
};

/// One craft in one flight, integrated with the midpoint rule at 5 ms.
class Flight {
 public:
  Flight(const HiddenWorld& world, Gusts& gusts, int number)
      : world_(world),
        hidden_(world.effects),
        since_(acts_since(world.request, number)),
        gusts_(gusts),
        rng_(world.request.seed * 1000003 + static_cast<std::uint64_t>(number) * 7717 + 5) {
    const auto u = [&](double low, double high) { return std::uniform_real_distribution(low, high)(rng_); };
    scatter();
    charge_ = world.request.confound == "battery" ? 1.0 : u(0.55, 1.0);
    ambient_ = u(18, 28);
    accelerometer_noise_ = u(0.03, 0.08);
    tail_nu_ = world.effects.of("heavy_tails") != 0 ? 1 : 0;
    for (int i = 0; i < 8; ++i) {
      Rng own(world.request.seed * 31 + static_cast<std::uint64_t>(i));
      offset_[i] = std::normal_distribution()(own);
    }
  }

  /// `replica`: 0, or which of the flights with other gusts along the same plan.
  Table fly(unsigned replica = 0) { return fly(draw_plan(world_, rng_), replica); }

  /// A battery charged so far, 0 … 1.
  void begin_with(double charge) { charge_ = charge; }

  Table fly(const std::vector<Command>& plan, unsigned replica = 0) {
    p_ = plan.front().p;
    thrust_ = produced_ = kG * Vec3::UnitZ();
    Table table;
    table.names = {"t_s",        "x_m",        "y_m",         "z_m",           "vx_mps",      "vy_mps",
                   "vz_mps",     "ax_mps2",    "ay_mps2",     "az_mps2",       "qw",          "qx",
                   "qy",         "qz",         "cmd_x_m",     "cmd_y_m",       "cmd_z_m",     "cmd_vx_mps",
                   "cmd_vy_mps", "cmd_vz_mps", "cmd_ax_mps2", "cmd_ay_mps2",   "cmd_az_mps2", "thrust",
                   "battery_v",  "rpm1",       "rpm2",        "rpm3",          "rpm4",        "motor1",
                   "motor2",     "motor3",     "motor4",      "temperature_c", "segment"};
    double next_row = 0;
    double frozen_from = std::uniform_real_distribution(0.0, 4.0)(rng_) * 60;  // often after the end
    double dropout_at = std::uniform_real_distribution(0.0, 3.0)(rng_) * 60;
    if (replica > 0) {
      frozen_from = dropout_at = 1e9;
      rng_.seed(rng_() + replica);
      normal_.reset();
      scatter();
    }
    for (std::size_t k = 0; k < plan.size(); ++k) {
      const double t = static_cast<double>(k) * kStep;
      world_.effects = t >= since_ ? hidden_ : HiddenEffects();
      step(plan, k, t);
      if (t < next_row) continue;
      next_row += (1 + world_.jitter * std::uniform_real_distribution(-0.5, 0.5)(rng_)) / world_.rate_hz;
      if (next_row < t) next_row = t;
      if (t > dropout_at && t < dropout_at + 0.7) continue;
      const Instant now = instant(t + kStep);  // what a row holds is the state after the step
      auto row = record(plan[std::min(k + 1, plan.size() - 1)], now.t);
      table.hidden.push_back({hidden_push(world_, now) + drift(now.t), hidden_ln_variance(world_, now), burst_});
      if (t > frozen_from && t < frozen_from + 1.5 && !table.rows.empty()) {
        row = table.rows.back();
        row[0] = now.t;
      }
      table.rows.push_back(std::move(row));
    }
    return table;
  }

 private:
  double normal() { return normal_(rng_); }
  /// What differs between flights for no reason that a log tells.
  void scatter() {
    const auto n = [&] { return normal_(rng_); };
    ln_var_ = world_.ln_var_vehicle + 0.36 * n();
    accelerometer_bias_ = 0.02 * Vec3(n(), n(), n());
    thrust_scale_ = 1 + 0.003 * n();
    tilt_ = 0.002 * Vec3(n(), n(), 0);
  }
  Instant instant(double t) const {
    return {t, p_, v_, yaw_, produced_.norm(), (16.8 - voltage_) / 16.8, temperature_};
  }

  void step(const std::vector<Command>& plan, std::size_t k, double t) {
    const Craft& c = world_.craft;
    const double late = c.latency + world_.effects.of("command_latency");
    const std::size_t back = static_cast<std::size_t>(late / kStep + 0.5);
    const Command& cmd = plan[k > back ? k - back : 0];
    const Vec3 kp(c.kp_h, c.kp_h, c.kp_z), kd(c.kd_h, c.kd_h, c.kd_z);
    const double slow = world_.effects.of("actuator_lag"), tau = world_.request.confound == "attitude" ? 0 : slow;
    const Vec3 believed_p = p_ + vio_, believed_v = v_;
    const Vec3 wanted =
        cmd.a + kp.cwiseProduct(cmd.p - believed_p) + kd.cwiseProduct(cmd.v - believed_v) + kG * Vec3::UnitZ();
    thrust_ += (wanted - thrust_) * (1 - std::exp(-kStep / (c.attitude_lag + slow - tau)));  // attitude, thrust follow
    yaw_ = plan[k].yaw;
    u_ = command_of(c, c.mass * thrust_.norm());
    const double believed = thrust_of(c, u_, 0) / c.mass;
    double real = thrust_of(c, u_, world_.effects.of("thrust_slope")) / c.mass;
    if (tau > 0) {
      lagged_ += (real - lagged_) * (1 - std::exp(-kStep / tau));
      real = lagged_;
    } else {
      lagged_ = real;
    }
    produced_ = believed * thrust_.normalized();
    battery(believed);
    const Instant now = instant(t);
    const Vec3 force = real * thrust_scale_ * thrust_.normalized() - kG * Vec3::UnitZ() + heading() * tilt_ * kG;
    const auto acceleration = [&](const Instant& at) -> Vec3 { return force + wind_ + hidden_push(world_, at); };
    airflow(now);
    Instant half = now;
    const Vec3 a0 = acceleration(now);
    half.p += 0.5 * kStep * v_;
    half.v += 0.5 * kStep * a0;
    a_ = acceleration(half);
    p_ += kStep * half.v;
    v_ += kStep * a_;
    vio_ += -vio_ * kStep / 4 + 0.004 * std::sqrt(kStep) * Vec3(normal(), normal(), normal());
    spin(t);
  }

  Eigen::Matrix3d heading() const { return Eigen::AngleAxisd(yaw_, Vec3::UnitZ()).toRotationMatrix(); }

  void battery(double believed) {
    const double current = 14 * std::pow(believed / kG, 1.5);
    charge_ -= current * kStep / 3600 / 1.6;
    voltage_ = 14.2 + 2.6 * charge_ - 0.3 * std::exp(-charge_ * 9) - 0.022 * current;
    warmth_ += (8 - warmth_) * kStep / 90;
    temperature_ = ambient_ + warmth_;
  }

  /// Gusts: Ornstein–Uhlenbeck of the modelled variance, whose logarithm wanders by the measured scatter.
  void airflow(const Instant& now) {
    const double tau = 0.17, decay = std::exp(-kStep / tau), kick = std::sqrt(1 - decay * decay);
    ln_wander_ += -ln_wander_ * kStep / 1.5 + 0.4 * std::sqrt(2 * kStep / 1.5) * normal();
    double ln = ln_var_ + ln_wander_ - 0.08 + hidden_ln_variance(world_, now);
    const Vec3& sd = gusts_.deviations(now.p);
    for (int i = 0; i < 3; ++i) gust_[i] = decay * gust_[i] + kick * normal();
    wind_ = std::exp(0.5 * ln) * sd.cwiseProduct(gust_);
    if (tail_nu_ > 0) {  // short bursts: kurtosis 3 exp(size), the same variance
      burst_left_ -= kStep;
      if (burst_left_ < -0.7 * std::exponential_distribution(1.0)(rng_) - 0.4) burst_left_ = 0.08;
      const double k = std::exp(world_.effects.of("heavy_tails")) - 1;
      const double inside = std::sqrt(1 + k * 4), outside = std::sqrt(std::max(0.1, 1 - k * 0.25));
      burst_ = burst_left_ > 0 ? inside : outside;
      wind_ *= burst_;
    }
  }

  void spin(double) {
    const double damage = world_.effects.of("propeller_damage");
    const int damaged = static_cast<int>(world_.effects.shape_of("propeller_damage"));
    for (int i = 0; i < 4; ++i) {
      const bool hurt = damage != 0 && i == damaged;
      const double need = produced_.norm() / kG / (hurt ? 1 - damage : 1.0);
      spin_[i] = world_.rotor_rpm * std::sqrt(need) * (1 + world_.craft.rotor_spread / 2 * offset_[i]);
      motor_[i] =
          command_of(world_.craft, world_.craft.mass * kG * need) * (1 + world_.craft.rotor_spread * offset_[i + 4]);
      phase_[i] += 2 * M_PI * spin_[i] / 60 * kStep;
    }
  }
  Vec3 drift(double t) const {
    const double size = world_.effects.of("imu_drift"), direction = world_.effects.shape_of("imu_drift");
    return size * (1.6 * (1 - std::exp(-t / 100))) * (heading() * Vec3(std::cos(direction), std::sin(direction), 0.3));
  }

  Vec3 measured_acceleration(double t) {
    Vec3 a = a_ + accelerometer_bias_ + accelerometer_noise_ * Vec3(normal(), normal(), normal()) + drift(t);
    const double line = world_.effects.of("vibration") / 2, hurt = world_.effects.of("propeller_damage") * 3;
    for (int i = 0; i < 4; ++i) {
      const bool damaged = hurt > 0 && i == static_cast<int>(world_.effects.shape_of("propeller_damage"));
      const double amplitude = line + (damaged ? hurt : 0);
      if (amplitude > 0)
        a += amplitude * Vec3(0.6 * std::cos(phase_[i]), 0.6 * std::sin(phase_[i]), std::sin(phase_[i] + i));
    }
    return a;
  }

  double rpm_reading(int i) {
    const double fault = world_.effects.of("rotor_sensor_fault");
    if (fault != 0 && i == static_cast<int>(world_.effects.shape_of("rotor_sensor_fault"))) {
      if (fault > 0) return spin_[i] * (1 + fault) * (1 + 0.004 * normal());
      if (std::uniform_real_distribution(0.0, 1.0)(rng_) < -fault) return 0;
    }
    return spin_[i] * (1 + 0.004 * normal());
  }

  std::vector<double> record(const Command& cmd, double t) {
    const Vec3 z = thrust_.normalized();
    const Vec3 x = Vec3(-std::sin(yaw_), std::cos(yaw_), 0).cross(z).normalized();
    Eigen::Matrix3d R;
    R << x, z.cross(x), z;
    const Eigen::Quaterniond q(R);
    const Vec3 p = p_ + vio_, a = measured_acceleration(t);
    std::vector<double> row = {t,         p.x(),     p.y(),     p.z(),     v_.x(),
                               v_.y(),    v_.z(),    a.x(),     a.y(),     a.z(),
                               q.w(),     q.x(),     q.y(),     q.z(),     cmd.p.x(),
                               cmd.p.y(), cmd.p.z(), cmd.v.x(), cmd.v.y(), cmd.v.z(),
                               cmd.a.x(), cmd.a.y(), cmd.a.z(), u_,        voltage_ + 0.02 * normal()};
    for (int i = 0; i < 4; ++i) row.push_back(rpm_reading(i));
    for (int i = 0; i < 4; ++i) row.push_back(motor_[i] * (1 + 0.004 * normal()));
    row.push_back(temperature_ + 0.1 * normal());
    row.push_back(cmd.segment);
    return row;
  }

  HiddenWorld world_;
  HiddenEffects hidden_;
  double since_;
  Gusts& gusts_;
  Rng rng_;
  std::normal_distribution<double> normal_;
  Vec3 p_, v_ = Vec3::Zero(), a_ = Vec3::Zero(), thrust_, produced_, wind_ = Vec3::Zero(), gust_ = Vec3::Zero(),
           vio_ = Vec3::Zero(), accelerometer_bias_, tilt_;
  double yaw_ = 0, u_ = 0, lagged_ = kG, charge_, voltage_ = 16, temperature_ = 25, ambient_, warmth_ = 0, ln_var_,
         ln_wander_ = 0, thrust_scale_, accelerometer_noise_, burst_left_ = 0, burst_ = 1;
  int tail_nu_;
  double offset_[8];  // the craft's own small asymmetry, the same in each of its flights
  double spin_[4] = {}, motor_[4] = {}, phase_[4] = {0.3, 1.9, 4.0, 5.5};
};

/// The modelled gusts in a world's room, evaluated once for the worlds of one seed, which are pairs in one room.
Gusts& gusts_of(const HiddenWorld& world) {
  thread_local std::unique_ptr<Gusts> gusts;
  thread_local std::pair<std::uint64_t, std::string> room;
  if (const std::pair now(world.request.seed, world.request.confound); !gusts || room != now) {
    auto model = *backwash::config::load_model("builtin:" + world.craft.model);
    model.ground.r0 = world.craft.diagonal_radius;
    gusts = std::make_unique<Gusts>(true_grid(world.room), model);
    room = now;
  }
  return *gusts;
}

}  // namespace

std::vector<Table> fly_all(const HiddenWorld& world) {
  std::vector<Table> flights;
  for (int i = 0; i < world.request.flights; ++i) flights.push_back(Flight(world, gusts_of(world), i).fly());
  return flights;
}

Table fly_along(const HiddenWorld& world, int number, const std::vector<Command>& plan, double charge) {
  Flight flight(world, gusts_of(world), number);
  if (charge > 0) flight.begin_with(charge);
  return flight.fly(plan);
}

Table fly_again(const HiddenWorld& world, int number, unsigned replica) {
  return Flight(world, gusts_of(world), number).fly(replica);
}

}  // namespace study_worlds
