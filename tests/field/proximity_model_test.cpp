// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "core/field/proximity_model.hpp"

namespace backwash::field {
namespace {

// Numbers in this file are worked out by hand from docs/model.md section 2 with the default model and a = 0.1.
constexpr double kEdge = 0.1;

Element up_at(const Vec3& c) { return {Element::Kind::up, c, Vec3::UnitZ(), 0.01, std::nullopt}; }
Element lateral_at(const Vec3& c, const Vec3& m, std::optional<Vec3> corner = std::nullopt) {
  return {Element::Kind::lateral, c, m, 0.01, corner};
}
double size(const Variance& v) { return std::abs(v.xx) + std::abs(v.yy) + std::abs(v.zz); }

TEST(GroundTerm, HasItsClosedFormStraightAbove) {
  const ProximityModel terms(Model{}, kEdge);
  const Variance s = terms.ground(up_at({3, -2, 0.5}), {3, -2, 1.5});
  EXPECT_NEAR(s.xx, 0.01 * (0.010 + 0.05 * 0.049787068), 1e-12);  // exp(−3) = 0.049787068
  EXPECT_NEAR(s.zz, 0.01 * (0.020 + 0.12 * 0.049787068), 1e-12);
  EXPECT_EQ(s.xx, s.yy);
  EXPECT_EQ(s.xy, 0);
  EXPECT_EQ(s.xz, 0);
  EXPECT_EQ(s.yz, 0);
}

TEST(GroundTerm, StopsGrowingAtHalfAVoxel) {
  const ProximityModel terms(Model{}, kEdge);
  const Variance s = terms.ground(up_at({0, 0, 0}), {0, 0, 0});
  EXPECT_NEAR(s.zz, 0.01 * (0.020 * 400 + 0.12 * 0.992528055), 1e-9);  // l = 0.05, exp(−0.0075)
  EXPECT_EQ(terms.ground(up_at({0, 0, 0}), {0, 0, 0.04}).zz, s.zz);
}

TEST(GroundTerm, GatesAreWhereTheModelPutsThem) {
  const ProximityModel terms(Model{}, kEdge);
  const Element e = up_at({0, 0, 0});
  EXPECT_GT(size(terms.ground(e, {0.870, 0, 0.5})), 0);  // tan θ̄_g = tan 1.05 = 1.7433
  EXPECT_EQ(size(terms.ground(e, {0.873, 0, 0.5})), 0);
  EXPECT_GT(size(terms.ground(e, {0.5, 0, 1.936})), 0);  // l̄_g = 2: √(4 − 0.25) = 1.93649
  EXPECT_EQ(size(terms.ground(e, {0.5, 0, 1.937})), 0);
  EXPECT_GT(size(terms.ground(e, {0.1799, 0, 3})), 0);  // the footprint, r0 = 0.18, reaches to l̄_u = 4
  EXPECT_EQ(size(terms.ground(e, {0.1801, 0, 3})), 0);
  EXPECT_GT(size(terms.ground(e, {0, 0, 3.999})), 0);
  EXPECT_EQ(size(terms.ground(e, {0, 0, 4.001})), 0);
  EXPECT_GT(size(terms.ground(e, {0.17, 0, 0.01})), 0);   // outside the cone, in the footprint
  EXPECT_EQ(size(terms.ground(e, {0.17, 0, -0.01})), 0);  // θ > π/2
}

TEST(WallTerm, HasItsClosedFormBesideAWallThatFacesAnyWay) {
  const ProximityModel terms(Model{}, kEdge);
  const Vec3 m(0.6, 0.8, 0), t(-0.8, 0.6, 0);
  const Variance s = terms.wall(lateral_at({0, 0, 1}, m), m + Vec3(0, 0, 1));
  constexpr double kDecay = 0.082084999;  // exp(−2.5)
  EXPECT_NEAR(s.along(m), 0.01 * 0.25 * kDecay, 1e-12);
  EXPECT_NEAR(s.along(t), 0.01 * 0.10 * kDecay, 1e-12);
  EXPECT_NEAR(s.along(Vec3::UnitZ()), 0.01 * 0.12 * kDecay, 1e-12);
  EXPECT_NEAR(s.xy, 0.01 * 0.15 * 0.48 * kDecay, 1e-12);  // (s_n − s_t) m_x m_y
}

TEST(WallTerm, GatesAreWhereTheModelPutsThemAndLevelCounts) {
  const ProximityModel terms(Model{}, kEdge);
  const Element e = lateral_at({0, 0, 0}, Vec3::UnitX());
  EXPECT_GT(size(terms.wall(e, {1, 0, 0})), 0);
  EXPECT_GT(size(terms.wall(lateral_at({0.1 * 3, 0, 0.1 * 3}, Vec3::UnitX()), {1, 0, 0.3})), 0);  // 0.1·3 > 0.3
  EXPECT_EQ(size(terms.wall(e, {1, 0, -0.001})), 0);
  EXPECT_GT(size(terms.wall(e, {0.5, 0, 0.396})), 0);  // θ_w = 0.9: 0.5/tan 0.9 = 0.39678
  EXPECT_EQ(size(terms.wall(e, {0.5, 0, 0.397})), 0);
  EXPECT_GT(size(terms.wall(e, {1.5, 0, 0})), 0);
  EXPECT_EQ(size(terms.wall(e, {1.5001, 0, 0})), 0);
}

TEST(CornerTerm, HasItsClosedForm) {
  const ProximityModel terms(Model{}, kEdge);
  const Vec3 m(0, -1, 0);
  // d_c = 0.4, h_c = 0.5: φ = atan 0.8 = 0.674740942, d_c² + h_c⁶ = 0.16 + 0.015625
  const Variance s = terms.corner(lateral_at({0, 0, 0.9}, m, Vec3(0, 0, 0)), {0.24, -0.32, 0.5});
  const double common = 0.01 * (1.2 - 0.674740942) / 0.175625;
  EXPECT_NEAR(s.yy, 0.02 * common, 1e-10);
  EXPECT_NEAR(s.xx, 0.012 * common, 1e-10);
  EXPECT_NEAR(s.zz, 0.02 * common, 1e-10);
}

TEST(CornerTerm, GatesAreWhereTheModelPutsThem) {
  const ProximityModel terms(Model{}, kEdge);
  const auto at = [&](double c_z, double d, double h) {
    return size(terms.corner(lateral_at({0, 0, c_z}, Vec3::UnitX(), Vec3(0, 0, 0)), {d, 0, h}));
  };
  EXPECT_GT(at(0.5, 0.51, 0.2), 0);  // tan φ̄_c = tan 1.2 = 2.5722
  EXPECT_EQ(at(0.5, 0.52, 0.2), 0);
  EXPECT_EQ(at(0.5, 0.2 * std::tan(1.2) * 1.00002, 0.2), 0);  // a hair outside the cone, where φ̄_c − φ is negative
  EXPECT_EQ(at(0.5, 0.3, 0), 0);                              // level with the corner: φ = π/2
  EXPECT_EQ(at(0.5, 0.3, -0.2), 0);
  EXPECT_GT(at(0.5, 0.9, 1.199), 0);  // l̄_c = 1.5
  EXPECT_EQ(at(0.5, 0.9, 1.201), 0);
  EXPECT_GT(at(1.699, 0.9, 0.5), 0);  // |r| ≤ l̄_w = 1.5 for the element itself
  EXPECT_EQ(at(1.701, 0.9, 0.5), 0);
  EXPECT_EQ(size(terms.corner(lateral_at({0, 0, 0.5}, Vec3::UnitX()), {0.3, 0, 0.5})), 0);
}

TEST(Terms, AreFiniteEverywhereIncludingTheElementsThemselves) {
  const ProximityModel terms(Model{}, kEdge);
  const Element up = up_at({1, 1, 1}), lateral = lateral_at({1, 1, 1}, Vec3::UnitX(), Vec3(1, 1, 1));
  for (const Vec3& p : {Vec3(1, 1, 1), Vec3(1, 1, 1 + 1e-300), Vec3(1 + 1e-12, 1, 1), Vec3(1, 1, 1.001)})
    for (const Variance& s : {terms.ground(up, p), terms.corner(lateral, p), terms.wall(lateral, p)})
      for (const double x : {s.xx, s.xy, s.xz, s.yy, s.yz, s.zz}) EXPECT_TRUE(std::isfinite(x)) << p.transpose();
}

TEST(Terms, AreZeroForTheOtherKindOfElement) {
  const ProximityModel terms(Model{}, kEdge);
  EXPECT_EQ(size(terms.wall(up_at({0, 0, 0}), {0.5, 0, 0.1})), 0);
  EXPECT_EQ(size(terms.corner(up_at({0, 0, 0}), {0.5, 0, 0.5})), 0);
  EXPECT_EQ(size(terms.ground(lateral_at({0, 0, 0}, Vec3::UnitX(), Vec3(0, 0, -0.5)), {0.1, 0, 0.5})), 0);
}

}  // namespace
}  // namespace backwash::field
