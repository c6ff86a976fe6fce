// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/model_air.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace backwash::sim {
namespace {

/// L of Σ = L Lᵀ, lower triangular.
Mat3 root(const Variance& s) {
  Mat3 sigma;
  sigma << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  sigma.diagonal().array() += 1e-12;  // a model may hold no variance at all
  return sigma.llt().matrixL();
}

}  // namespace

ModelAir::ModelAir(ModelField& field, std::uint64_t seed) : field_(&field), rng_(seed) {
  for (int i = 0; i < 3; ++i) gust_[i] = normal_(rng_);
}

Vec3 ModelAir::step(const Vec3& p_W, double dt, double gust) {
  const double decay = std::exp(-dt / field_->tau_w()), kick = std::sqrt(1 - decay * decay);
  for (int i = 0; i < 3; ++i) gust_[i] = decay * gust_[i] + kick * normal_(rng_);
  if (!last_at_ || (p_W - last_at_->first).norm() > kRecast) last_at_.emplace(p_W, root(field_->sigma(p_W)));
  return gust * (last_at_->second * gust_);
}

}  // namespace backwash::sim
