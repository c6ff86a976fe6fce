// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/strict_table.hpp"

namespace backwash::config {
namespace {

constexpr Range kVariance{0, 100};       // (m/s²)², amplitudes too
constexpr Range kLength{0, 20, true};    // m
constexpr Range kAngle{0, 1.571, true};  // rad, up to π/2 as people round it
constexpr Range kDecay{0, 1000, true};   // 1/m²

std::vector<NumberKey> model_keys(Model& m) {
  using enum NumberKey::Presence;
  return {
      {"base.horizontal", &m.base.horizontal, kVariance},
      {"base.vertical", &m.base.vertical, kVariance},
      {"ground.theta_max", &m.ground.theta_max, kAngle},
      {"ground.l_max", &m.ground.l_max, kLength},
      {"ground.l_footprint_max", &m.ground.l_footprint_max, kLength, optional},
      {"ground.r0", &m.ground.r0, {0, 5, true}, optional},
      {"ground.lambda.horizontal", &m.ground.lambda.horizontal, kVariance},
      {"ground.lambda.vertical", &m.ground.lambda.vertical, kVariance},
      {"ground.k1.horizontal", &m.ground.k1.horizontal, kVariance},
      {"ground.k1.vertical", &m.ground.k1.vertical, kVariance},
      {"ground.k2", &m.ground.k2, kDecay},
      {"corner.phi_max", &m.corner.phi_max, kAngle},
      {"corner.l_max", &m.corner.l_max, kLength},
      {"corner.lambda.normal", &m.corner.lambda.normal, kVariance},
      {"corner.lambda.tangential", &m.corner.lambda.tangential, kVariance},
      {"corner.lambda.vertical", &m.corner.lambda.vertical, kVariance},
      {"wall.theta_min", &m.wall.theta_min, kAngle},
      {"wall.l_max", &m.wall.l_max, kLength},
      {"wall.k1.normal", &m.wall.k1.normal, kVariance},
      {"wall.k1.tangential", &m.wall.k1.tangential, kVariance},
      {"wall.k1.vertical", &m.wall.k1.vertical, kVariance},
      {"wall.k2", &m.wall.k2, kDecay},
      {"bound.kappa", &m.bound.kappa, {0, 10}, optional},
      {"bound.mean.horizontal", &m.bound.mean_horizontal, {0, 10}, with_parent},
      {"bound.mean.vertical", &m.bound.mean_vertical, {0, 10}, with_parent},
      {"bound.tau_w", &m.bound.tau_w, {0, 10, true}, optional},
  };
}

}  // namespace

tl::expected<Model, ConfigError> load_model(const std::string& path) {
  constexpr std::string_view kNotRead[] = {"confidence", "provenance", "extension"};
  const auto file = StrictTable::open(path, ".model.toml");
  if (!file) return tl::unexpected(file.error());
  Model model;
  if (auto read = file->read(model_keys(model), kNotRead); !read) return tl::unexpected(read.error());
  return model;
}

}  // namespace backwash::config
