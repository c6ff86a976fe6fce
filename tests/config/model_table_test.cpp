// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/model_table.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "core/config/config.hpp"

namespace backwash::config {
namespace {

/// Reads a model file of this text.
tl::expected<Model, ConfigError> read(const std::string& text) {
  const auto path = testing::TempDir() + "backwash_model_table_" + std::to_string(getpid()) + ".toml";
  std::ofstream(path) << text;
  auto model = load_model(path);
  std::filesystem::remove(path);
  return model;
}

std::string written(const Model& model, const std::string& name = "none", toml::table beside = toml::table()) {
  toml::table whole = model_table(model);
  whole.insert(name, std::move(beside));
  return text_of(whole, {"base", "ground", "corner", "wall", "bound", "provenance", "extension"});
}

/// The model that a file with this effect holds.
tl::expected<Model, ConfigError> extended(const ModelEffect& e) {
  toml::table term, extension;
  term.insert("effect", toml::array(effect_table(e)));
  extension.insert("term", toml::array(term));
  return read(written({}, "extension", extension));
}

TEST(ModelTable, EveryConstantIsReadBackAsItWasWritten) {
  Model m;
  m.base = {0.011, 0.012};
  m.ground.theta_max = 1.013;
  m.ground.l_max = 1.014;
  m.ground.l_footprint_max = 1.015;
  m.ground.r0 = 0.016;
  m.ground.lambda = {0.017, 0.018};
  m.ground.k1 = {0.019, 0.020};
  m.ground.k2 = 1.021;
  m.corner.phi_max = 1.022;
  m.corner.l_max = 1.023;
  m.corner.lambda = {0.024, 0.025, 0.026};
  m.wall.theta_min = 1.027;
  m.wall.l_max = 1.028;
  m.wall.k1 = {0.029, 0.030, 0.031};
  m.wall.k2 = 1.032;
  m.bound.kappa = 1.033;
  m.bound.mean_horizontal = 0.034;
  m.bound.mean_vertical = 0.035;
  m.bound.tau_w = 0.036;
  const auto found = read(written(m));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->base.horizontal, 0.011);
  EXPECT_EQ(found->ground.r0, 0.016);
  EXPECT_EQ(found->ground.k1.vertical, 0.020);
  EXPECT_EQ(found->corner.lambda.tangential, 0.025);
  EXPECT_EQ(found->wall.k2, 1.032);
  EXPECT_EQ(found->bound.mean_vertical, 0.035);
  EXPECT_EQ(model_table(*found), model_table(m));
}

TEST(ModelTable, NumbersAreAsShortAsTheyMayBeAndTextStaysAsItIs) {
  Model m;
  m.base = {0.05, 1};
  m.ground.k2 = 1e-7;
  const std::string said = "0.050000000000000003 of 'log 1.10.csv' and \"2.50\"";
  const std::string text = written(m, "provenance", toml::table{{"said", said}, {"count", 12}});
  EXPECT_NE(text.find("horizontal = 0.05"), std::string::npos) << text;
  EXPECT_NE(text.find("vertical = 1.0"), std::string::npos) << text;
  EXPECT_NE(text.find("k2 = 1e-07"), std::string::npos) << text;
  EXPECT_NE(text.find("count = 12"), std::string::npos) << text;
  EXPECT_EQ(toml::parse(text)["provenance"]["said"].value<std::string>(), said);
  EXPECT_EQ(toml::parse(text)["ground"]["k2"].value<double>(), 1e-7);
}

TEST(ModelTable, EveryKindOfEffectIsReadBackAsItWasWritten) {
  for (const LawEntry& law : kLaws) {
    const ModelEffect e{law.law, Vec3(-0.125, 0.25, 0.5), Vec3(0.5, 0.25, 0.125), 0.75};
    const auto found = extended(e);
    ASSERT_TRUE(found) << law.name << ": " << found.error().message;
    ASSERT_EQ(found->extension.size(), 1u) << law.name;
    EXPECT_EQ(found->extension[0].kind, e.kind);
    EXPECT_EQ(found->extension[0].value.x(), -0.125) << law.name;
    EXPECT_EQ(found->extension[0].error.x(), 0.5) << law.name;
    EXPECT_EQ(effect_table(found->extension[0]), effect_table(e)) << law.name;
  }
}

// What a study found may lie beyond what a file may hold: it is not written as another number.
TEST(ModelTable, ANumberOfAnEffectBeyondTheReadersRangeOrNoneIsRefusedByItsName) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const ModelEffect sound{Law::push_to_walls, Vec3(1, 0, 0), Vec3(1, 0, 0), 0.1};
  ASSERT_EQ(why_unwritable(sound), std::nullopt);
  for (const auto& [x, error, scale, said] :
       {std::tuple{-80.0, 1.0, 0.1, "push_to_walls: number 1 of value is -80, wanted in [-10, 10]"},
        {NAN, 1.0, 0.1, "push_to_walls: number 1 of value is nan, wanted in [-10, 10]"},
        {1.0, kInfinite, 0.1, "push_to_walls: number 1 of error is inf, wanted in [0, 10]"},
        {1.0, 1.0, 1e-4, "push_to_walls: scale is 0.0001, wanted in [0.01, 10]"}}) {
    const ModelEffect effect{Law::push_to_walls, Vec3(x, 0, 0), Vec3(error, 0, 0), scale};
    EXPECT_EQ(why_unwritable(effect), said);
    EXPECT_THROW(effect_table(effect), std::invalid_argument);
  }
}

TEST(ModelTable, AnyTextIsReadable) {
  for (const char* name : {"it's.csv", "a \"b\".csv", "back\\slash", "new\nline", "''' \"\"\"", "\x01"}) {
    toml::table provenance;
    provenance.insert("logs", toml::array(name));
    EXPECT_TRUE(read(written({}, "provenance", provenance))) << name;
  }
}

}  // namespace
}  // namespace backwash::config
