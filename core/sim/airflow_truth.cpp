// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/airflow_truth.hpp"

#include <algorithm>
#include <array>
#include <numbers>

#include "core/sim/vehicle/ray.hpp"
#include "core/types/angle.hpp"

namespace backwash::sim {
namespace {

// Chosen (core/sim/README.md says what they lead to). Variances in (m/s²)², lengths in m, pushes in m/s², times in s; a
// 5-inch vehicle.
struct HorizontalVertical {
  double horizontal, vertical;
};
constexpr HorizontalVertical kBase{0.0024, 0.0036};
constexpr HorizontalVertical kFloor{0.040, 0.076};
constexpr double kFloorLength = 1.05;
constexpr double kWallNormal = 0.19, kWallTangential = 0.01, kWallVertical = 0.038, kWallLength = 0.5;
constexpr double kCornerNormal = 0.16, kCornerTangential = 0.06, kCornerVertical = 0.18;
constexpr double kCornerLength = 0.5, kCornerHeight = 0.9;
constexpr double kCeiling = 0.004, kCeilingLength = 0.2;
constexpr double kWallPull = 0.12, kWallPullLength = 0.6, kLargestWallPull = 0.04;
constexpr double kFountainHeight = 0.5;
constexpr double kFloorLift = 0.035, kFloorLiftLength = 0.4, kCeilingPull = 0.010;

constexpr double kDownRange = 4, kUpRange = 1.5, kSideRange = 2;
constexpr int kSideRays = 24;
constexpr double kSlant = 35 * kDegree;  // of the four outer rays to the floor

constexpr double kGustTime = 0.075;  // critically damped: correlation (1 + t/T) e^(−t/T), integral time 2T
constexpr double kIntensitySigma = 0.25, kIntensityTime = 6;
constexpr double kBurstFactor = 3, kBurstOn = 0.5, kBurstOff = 2, kBurstEdge = 0.08;
// They make the standard deviation of the limited gust 1, given the constants above and kLargestGust.
constexpr double kScaleHorizontal = 0.7317, kScaleVertical = 0.6845;

double sech(double x) { return 1 / std::cosh(x); }
/// 1 near the surface, 1/2 at `length`, then a power law.
double falling(double distance, double length, int power) { return 1 / (1 + std::pow(distance / length, power)); }
/// Close to 1 below the largest gust, largest/radius far above.
double limited(double radius) { return std::pow(1 + std::pow(radius / AirflowTruth::kLargestGust, 4), -0.25); }

const std::array<Vec3, kSideRays>& side_rays() {
  static const std::array<Vec3, kSideRays> rays = [] {
    std::array<Vec3, kSideRays> r;
    for (std::size_t i = 0; i < kSideRays; ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / kSideRays;
      r[i] = {std::cos(angle), std::sin(angle), 0};
    }
    return r;
  }();
  return rays;
}

/// Mean over five rays (straight down and slanted to four sides) of a law of the height above what they meet.
struct FloorShares {
  double wash = 0, corner = 0, fountain = 0, lift = 0;
};
FloorShares floor_shares(const map::OccupancyGrid& grid, const Vec3& p_W) {
  const double s = std::sin(kSlant), c = std::cos(kSlant);
  const std::array<Vec3, 5> rays = {Vec3(0, 0, -1), Vec3(s, 0, -c), Vec3(-s, 0, -c), Vec3(0, s, -c), Vec3(0, -s, -c)};
  FloorShares shares;
  for (const Vec3& ray : rays) {
    const auto hit = cast_ray(grid, p_W, ray, kDownRange);
    if (!hit) continue;
    const double height = -*hit * ray.z();
    shares.wash += falling(height, kFloorLength, 5) / 5;
    shares.corner += falling(height, kCornerHeight, 6) / 5;
    shares.fountain += falling(height, kFountainHeight, 3) / 5;
    shares.lift += falling(height, kFloorLiftLength, 3) / 5;
  }
  return shares;
}

}  // namespace

AirflowTruth::AirflowTruth(const map::OccupancyGrid& grid, const Vehicle& vehicle, std::uint64_t seed, double strength)
    : grid_(&grid), strength_(strength * std::pow(vehicle.body.rotor_radius / 0.0635, 1.4)), rng_(seed) {
  for (int i = 0; i < 3; ++i) {
    gust_[i] = normal_(rng_);
    gust_rate_[i] = normal_(rng_) / kGustTime;
  }
  log_intensity_ = kIntensitySigma * normal_(rng_);
}

AirflowTruth::Flow AirflowTruth::flow(const Vec3& p_W) const {
  const FloorShares floor = floor_shares(*grid_, p_W);
  Flow flow{.xx = kBase.horizontal + kFloor.horizontal * floor.wash, .xy = 0, .yy = 0, .zz = 0, .mean = Vec3::Zero()};
  flow.yy = flow.xx;
  flow.zz = kBase.vertical + kFloor.vertical * floor.wash;
  Vec3 pull = Vec3::Zero();
  for (const Vec3& ray : side_rays()) {
    const auto hit = cast_ray(*grid_, p_W, ray, kSideRange);
    if (!hit) continue;
    const double wall = std::pow(sech(*hit / kWallLength), 2) / kSideRays;
    const double corner = sech(*hit / kCornerLength) * floor.corner / kSideRays;
    const double normal = kWallNormal * wall + kCornerNormal * corner;
    const double tangential = kWallTangential * wall + kCornerTangential * corner;
    flow.xx += normal * ray.x() * ray.x() + tangential * ray.y() * ray.y();
    flow.yy += normal * ray.y() * ray.y() + tangential * ray.x() * ray.x();
    flow.xy += (normal - tangential) * ray.x() * ray.y();
    flow.zz += kWallVertical * wall + kCornerVertical * corner;
    pull += kWallPull / kSideRays * falling(*hit, kWallPullLength, 2) * ray;
  }
  // Towards the wall, but near the floor the outwash that climbs it pushes away.
  flow.mean = (1 - 2 * floor.fountain) * pull / std::hypot(1, pull.norm() / kLargestWallPull);
  flow.mean.z() = kFloorLift * floor.lift;
  if (const auto up = cast_ray(*grid_, p_W, Vec3::UnitZ(), kUpRange)) {
    const double ceiling = falling(*up, kCeilingLength, 3);
    flow.xx += kCeiling * ceiling;
    flow.yy += kCeiling * ceiling;
    flow.zz += kCeiling * ceiling;
    flow.mean.z() += kCeilingPull * ceiling;
  }
  return flow;
}

void AirflowTruth::advance(double dt) {
  // Exact for any dt: (g, ġ) of a critically damped filter, transition E, stationary covariance diag(1, 1/T²), so the
  // noise has the covariance diag(1, 1/T²) − E diag(1, 1/T²) Eᵀ = L Lᵀ.
  const double T = kGustTime, decay = std::exp(-dt / T);
  const double gg = decay * (1 + dt / T), gr = decay * dt, rg = -decay * dt / (T * T), rr = decay * (1 - dt / T);
  const double n_gg = 1 - gg * gg - gr * gr / (T * T), n_gr = -gg * rg - gr * rr / (T * T);
  const double n_rr = 1 / (T * T) - rg * rg - rr * rr / (T * T);
  const double l_gg = std::sqrt(std::max(n_gg, 0.0)), l_rg = l_gg > 0 ? n_gr / l_gg : 0;
  const double l_rr = std::sqrt(std::max(n_rr - l_rg * l_rg, 0.0));
  for (int i = 0; i < 3; ++i) {
    const double a = normal_(rng_), b = normal_(rng_), g = gust_[i], r = gust_rate_[i];
    gust_[i] = gg * g + gr * r + l_gg * a;
    gust_rate_[i] = rg * g + rr * r + l_rg * a + l_rr * b;
  }
  const double slow = std::exp(-dt / kIntensityTime);
  log_intensity_ = slow * log_intensity_ + kIntensitySigma * std::sqrt(1 - slow * slow) * normal_(rng_);
  const double leave = 1 - std::exp(-dt / (bursting_ ? kBurstOn : kBurstOff));
  if (std::generate_canonical<double, 53>(rng_) < leave) bursting_ = !bursting_;
  const double edge = std::exp(-dt / kBurstEdge);
  burst_ = edge * burst_ + (1 - edge) * (bursting_ ? 1 : 0);
}

Vec3 AirflowTruth::step(const Vec3& p_W, double dt, double gust_factor) {
  advance(dt);
  if (!last_cast_ || (p_W - last_cast_->first).norm() > kRecast) last_cast_.emplace(p_W, flow(p_W));
  const Flow& f = last_cast_->second;
  const double intensity = std::exp(log_intensity_) * (1 + (kBurstFactor - 1) * burst_);
  const Eigen::Vector2d horizontal = kScaleHorizontal * intensity * gust_.head<2>();
  const double vertical = kScaleVertical * intensity * gust_.z();
  // Lower Cholesky factor of the covariance, which is never singular: the base is in it.
  const double l_xx = std::sqrt(f.xx), l_yx = f.xy / l_xx, l_yy = std::sqrt(f.yy - l_yx * l_yx);
  const Eigen::Vector2d xy = horizontal * limited(horizontal.norm());
  const Vec3 gust(l_xx * xy.x(), l_yx * xy.x() + l_yy * xy.y(),
                  std::sqrt(f.zz) * vertical * limited(std::abs(vertical)));
  return std::sqrt(strength_) * (f.mean + gust_factor * gust);
}

Vec3 AirflowTruth::variance(const Vec3& p_W) const {
  const Flow f = flow(p_W);
  return strength_ * Vec3(f.xx, f.yy, f.zz);
}

Vec3 AirflowTruth::mean(const Vec3& p_W) const { return std::sqrt(strength_) * flow(p_W).mean; }

}  // namespace backwash::sim
