// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "core/config/config.hpp"
#include "core/config/daemon_config.hpp"
#include "core/config/model_table.hpp"
#include "core/config/simulation_terms.hpp"

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

tl::expected<std::vector<SimulationTerm>, ConfigError> terms_in(const std::string& text) {
  const auto path = testing::TempDir() + "backwash_simulation_" + std::to_string(getpid()) + ".toml";
  std::ofstream(path) << text;
  auto terms = load_simulation(path);
  std::filesystem::remove(path);
  return terms;
}

std::string with(const toml::table& entry) {
  toml::table term, extension;
  term.insert("simulation", toml::array(entry));
  extension.insert("term", toml::array(term));
  toml::table whole = model_table(Model{});
  whole.insert("extension", extension);
  return text_of(whole, {"base", "ground", "corner", "wall", "bound", "extension"});
}

TEST(SimulationTerms, EveryKindIsReadBackAsItWasWritten) {
  std::vector<std::variant<Law, SimulationTerm::Kind>> kinds;
  for (const LawEntry& law : kLaws) kinds.emplace_back(law.law);
  for (const SimulationKind& own : kSimulationKinds) kinds.emplace_back(own.kind);
  for (const auto& kind : kinds) {
    std::vector<double> value{0.25};
    while (why_unwritable({kind, value}) && value.size() < 9) value.push_back(0.25);
    const auto table = simulation_table({kind, value});
    const auto found = terms_in(with(table));
    ASSERT_TRUE(found) << table["kind"] << ": " << found.error().message;
    ASSERT_EQ(found->size(), 1u) << table["kind"];
    EXPECT_EQ(found->front().kind, kind);
    EXPECT_EQ(simulation_table(found->front()), table) << table["kind"];
  }
}

// A fitted number is not written as another one, and none is not written as 0.
TEST(SimulationTerms, ANumberBeyondTheReadersRangeOrNoneIsRefusedByItsName) {
  for (const auto& [x, said] : {std::pair{7.0, "thrust_lag: number 1 of value is 7, wanted in [0, 1]"},
                                {-1e-9, "thrust_lag: number 1 of value is -1e-09, wanted in [0, 1]"},
                                {NAN, "thrust_lag: number 1 of value is nan, wanted in [0, 1]"}}) {
    const SimulationTerm term{SimulationTerm::Kind::thrust_lag, {x}};
    EXPECT_EQ(why_unwritable(term), said);
    EXPECT_THROW(simulation_table(term), std::invalid_argument);
  }
  EXPECT_EQ(why_unwritable({SimulationTerm::Kind::thrust_lag, {}}), "thrust_lag: value needs a list of 1");
}

TEST(SimulationTerms, ThereAreNoneInAPlainModel) { EXPECT_TRUE(load_simulation("builtin:quad-5in")->empty()); }

TEST(SimulationTerms, AWrongEntryIsRefusedByFileLineAndWhatWouldBeRight) {
  for (const auto& [entry, said] :
       {std::pair{toml::table{{"kind", "wind"}, {"value", toml::array{1.0}}}, "push_of_heading"},
        {toml::table{{"kind", "push"}, {"value", toml::array{1.0}}}, "a list of 3"},
        {toml::table{{"kind", "thrust_lag"}, {"value", toml::array{7.0}}}, "[0, 1]"},
        {toml::table{{"kind", "thrust_lag"}, {"value", toml::array{0.1}}, {"scale", 1.0}}, "unknown key 'scale'"}}) {
    const auto found = terms_in(with(entry));
    ASSERT_FALSE(found) << said;
    EXPECT_NE(found.error().message.find(said), std::string::npos) << found.error().message;
    EXPECT_NE(found.error().message.find(".toml:"), std::string::npos) << found.error().message;
  }
}

// What the daemon's file says of the clearance that is kept.

TEST(ReachTable, TheWorstCaseIsKeptUnlessARiskIsStatedWithItsMethod) {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR) + "/core/config/files/backwashd.daemon.toml");
  const std::string text{std::istreambuf_iterator<char>(in), {}}, line = "method = \"tight\"";
  const auto at = text.find(line);
  ASSERT_NE(at, text.npos);
  const auto with = [&](const std::string& lines) {
    const std::string path = testing::TempDir() + "reach_table." + std::to_string(::getpid()) + ".toml";
    std::string changed = text;
    std::ofstream(path) << changed.replace(at, line.size(), lines);
    auto read = load_daemon(path);
    std::filesystem::remove(path);
    return read;
  };
  EXPECT_FALSE(load_daemon("builtin:backwashd").value().risk);
  EXPECT_FALSE(with("").value().risk);
  EXPECT_EQ(with("method = \"risk\"\nrisk = 0.002").value().risk, 0.002);
  for (const auto& [lines, named] : {std::pair{"method = \"risk\"", "reach.risk too"},
                                     {"risk = 0.01", "reach.method = \"risk\""},
                                     {"method = \"tight\"\nrisk = 0.01", "reach.method = \"risk\""},
                                     {"method = \"paper\"", "'reach.method'"},
                                     {"method = 1", "'reach.method'"},
                                     {"method = \"risk\"\nrisk = 0.6", "'reach.risk'"},
                                     {"method = \"risk\"\nrisk = 0", "'reach.risk'"},
                                     {"method = \"risk\"\nrisk = nan", "'reach.risk'"},
                                     {"metod = \"risk\"", "'reach.metod'"}}) {
    const auto read = with(lines);
    ASSERT_FALSE(read) << lines;
    EXPECT_THAT(read.error().message, testing::HasSubstr(named)) << lines;
  }
}

// What the daemon's file says of the air in flight, and what a model file says of its correlation time.

using testing::HasSubstr;

std::string shipped_text(const std::string& file) {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR) + "/core/config/files/" + file);
  return {std::istreambuf_iterator<char>(in), {}};
}
template <typename Load>
auto read_as_file(const std::string& text, const Load& load) {
  const std::string path = testing::TempDir() + "adaptation." + std::to_string(::getpid()) + ".toml";
  std::ofstream(path) << text;
  auto read = load(path);
  std::filesystem::remove(path);
  return read;
}

TEST(AdaptationTable, NothingIsLearntOfTheAirUnlessItIsAskedFor) {
  const auto plain = load_daemon("builtin:backwashd").value();
  EXPECT_FALSE(plain.adaptation.enabled);
  EXPECT_EQ(plain.adaptation.alpha, 0.01);
  EXPECT_TRUE(plain.adaptation.file.empty());
  std::string text = shipped_text("backwashd.daemon.toml");
  const auto at = text.find("enabled = false");
  ASSERT_NE(at, text.npos);
  const auto with = [&](const std::string& lines) {
    std::string changed = text;
    return read_as_file(changed.replace(at, std::string("enabled = false").size(), lines), load_daemon);
  };
  const auto on = with("enabled = true\nalpha = 0.05\nfile = \"/tmp/air\"");
  ASSERT_TRUE(on) << on.error().message;
  EXPECT_TRUE(on->adaptation.enabled);
  EXPECT_EQ(on->adaptation.alpha, 0.05);
  EXPECT_EQ(on->adaptation.file, "/tmp/air");
  EXPECT_EQ(plain.adaptation.calmest, 1) << "no set shrinks";
  EXPECT_EQ(with("enabled = true\ncalmest = 0.4")->adaptation.calmest, 0.4);
  for (const auto& [lines, named] : {std::pair{"enabled = 1", "adaptation.enabled"},
                                     {"calmest = 0.05", "adaptation.calmest"},
                                     {"calmest = 1.5", "adaptation.calmest"},
                                     {"calmest = nan", "adaptation.calmest"},
                                     {"alpha = 0.2", "adaptation.alpha"},
                                     {"alpha = 0", "adaptation.alpha"},
                                     {"alpha = nan", "adaptation.alpha"},
                                     {"file = \"\"", "adaptation.file"},
                                     {"calmer = true", "adaptation.calmer"}}) {
    const auto read = with(lines);
    ASSERT_FALSE(read) << lines;
    EXPECT_THAT(read.error().message, HasSubstr(named));
  }
}

TEST(TauInterval, IsWhatCalibrationWroteElseTheModelsOwnTime) {
  const auto of = [](const std::string& lines) {
    return read_as_file(shipped_text("quad-5in.model.toml") + lines, load_tau_interval);
  };
  EXPECT_EQ(load_tau_interval("builtin:quad-5in").value(), (std::array{0.15, 0.15}));
  EXPECT_EQ(of("").value(), (std::array{0.15, 0.15}));
  EXPECT_EQ(of("\n[confidence]\n\"bound.tau_w\" = [0.14, 0.2]\n").value(), (std::array{0.14, 0.2}));
  EXPECT_EQ(of("\n[confidence]\n\"bound.kappa\" = [1, 2]\n").value(), (std::array{0.15, 0.15}));
  for (const char* bad : {"[0.2, 0.14]", "[0, 0.1]", "[0.1]", "[0.1, nan]", "[0.1, inf]", "[0.1, \"x\"]", "[]"}) {
    const auto read = of("\n[confidence]\n\"bound.tau_w\" = " + std::string(bad) + "\n");
    ASSERT_FALSE(read) << bad;
    EXPECT_THAT(read.error().message, testing::AllOf(HasSubstr("adaptation."), HasSubstr("bound.tau_w")));
  }
  EXPECT_FALSE(load_tau_interval("/nowhere"));
}

}  // namespace
}  // namespace backwash::config
