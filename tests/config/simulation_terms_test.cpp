// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/simulation_terms.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "core/config/model_table.hpp"

namespace backwash::config {
namespace {

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

}  // namespace
}  // namespace backwash::config
