// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "core/study/before_after/before_after_rules.hpp"
#include "core/study/calibrate/calibration_rules.hpp"
#include "core/study/design/design_rules.hpp"
#include "core/study/effects/columns.hpp"
#include "core/study/effects/table.hpp"
#include "core/study/findings/self_test.hpp"
#include "core/study/inference/rules.hpp"
#include "tests/study_worlds/world.hpp"

namespace backwash::study {
namespace {

std::vector<Rule> all_rules() {
  auto all = rules();
  append_rules(all, calibrate::kCalibrationRules);
  append_rules(all, kDesignRules);
  append_rules(all, kBeforeAfterRules);
  return all;
}

TEST(Rules, EachHasANameOfItsOwnAUnitAndAReasonOfAKnownKind) {
  std::set<std::string_view> names;
  for (const Rule& r : all_rules()) {
    EXPECT_TRUE(names.insert(r.name).second) << r.name << " twice";
    EXPECT_FALSE(r.unit.empty()) << r.name;
    const std::string_view kind = r.reason.substr(0, r.reason.find(':'));
    EXPECT_TRUE(kind == "derived" || kind == "measured" || kind == "chosen") << r.name << ": " << r.reason;
    EXPECT_GT(r.reason.size(), kind.size() + 10) << r.name << " says no reason";
  }
  EXPECT_TRUE(names.contains("flips") && names.contains("most_odds")) << "first and last of the struct";
  EXPECT_TRUE(names.contains("design_flight_time") && names.contains("design_wall_distance")) << "and of the design";
  EXPECT_TRUE(names.contains("window_length") && names.contains("same_time")) << "and of the windows";
  EXPECT_TRUE(names.contains("strayed") && names.contains("most_tones")) << "and of the effects";
  EXPECT_TRUE(names.contains("quantile") && names.contains("height_ridge")) << "and of calibration";
}

/// All matches of a pattern's first group.
std::vector<std::string> found_in(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> all;
  for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at) all.push_back((*at)[1]);
  return all;
}

TEST(Rules, EachReasonNamesRulesEffectsAndFilesThatExist) {
  static const std::regex file("([\\w/]+\\.md)"), name("(?:^|[^\\w/.])([a-z]\\w*_\\w+)");
  std::set<std::string> known = {"k_p"};
  for (const Rule& r : all_rules()) known.insert(std::string(r.name));
  for (const Effect& e : effects()) known.insert(e.name);
  for (const Rule& r : all_rules()) {
    const std::string reason(r.reason);
    for (const auto& path : found_in(reason, file))
      EXPECT_TRUE(std::filesystem::exists(BACKWASH_SOURCE_DIR "/" + path)) << r.name << ": " << path;
    for (const auto& word : found_in(reason, name)) EXPECT_TRUE(known.contains(word)) << r.name << ": " << word;
  }
}

TEST(Rules, TheCodeCallsEachWhatThePrintCallsIt) {
  static const std::regex rule("Rule (\\w+)\\{\\s*\"(\\w+)\"");
  std::size_t rules = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(BACKWASH_SOURCE_DIR "/core/study")) {
    if (!entry.path().string().ends_with("_rules.hpp") && entry.path().filename() != "rules.hpp") continue;
    std::ifstream file(entry.path());
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    for (std::sregex_iterator at(text.begin(), text.end(), rule), end; at != end; ++at, ++rules)
      EXPECT_EQ((*at)[1].str(), (*at)[2].str()) << entry.path();
  }
  EXPECT_EQ(rules, all_rules().size());
}

/// Numbers of formulas: halves of ½ xᵀAx, roots of the turned axes, the contrasts of four rotors.
const std::set<std::string> kOfFormulas = {"0.0", "0.25", "0.5", "1.0", "2.0", "3.0", "6.0"};

/// A line of code without its strings and its comment.
std::string code(const std::string& line) {
  static const std::regex text("\"(\\\\.|[^\"\\\\])*\"");
  const std::string bare = std::regex_replace(line, text, "\"\"");
  return bare.substr(0, bare.find("//"));
}

/// What a line says by a bare number: a decimal, a named constant, or an integer above 2 that something is compared
/// with. Loops over the three axes, the four rotors and the six of both are none.
std::string bare_number(const std::string& line) {
  static const std::regex decimal("(^|[^A-Za-z_0-9.])([0-9]+\\.[0-9]+(e-?[0-9]+)?|[0-9]+e-?[0-9]+)");
  static const std::regex constant("constexpr (double|int|std::size_t|auto) k\\w+ = -?[0-9.]+;");
  static const std::regex loop("; \\w+ < [346]( &&|;)");
  static const std::regex threshold("(^|[^<>])([<>]=?|[=!]=) ?-?([3-9]|[1-9][0-9]+)([^0-9.]|$)");
  static const std::regex limit("\\b(min|max|clamp)(<[\\w:]+>)?\\(([^(),]*, )*([3-9]|[1-9][0-9]+)[,)]");
  for (std::sregex_iterator at(line.begin(), line.end(), decimal), end; at != end; ++at)
    if (!kOfFormulas.contains((*at)[2])) return (*at)[2];
  const std::string rest = std::regex_replace(line, loop, ";");
  for (const auto* wrong : {&constant, &threshold, &limit})
    if (std::smatch found; std::regex_search(rest, found, *wrong)) return found.str();
  return "";
}

TEST(BareNumber, IsSeenWhereOneStands) {
  for (const char* line : {"if (x > 0.3) return;", "constexpr int kMost = 4;", "if (windows < 8) continue;",
                           "std::min<std::size_t>(12, points.size())", "x = std::max(y, 40)", "1e-6 * x"})
    EXPECT_NE(bare_number(code(line)), "") << line;
  for (const char* line : {"for (int axis = 0; axis < 3; ++axis) {", "0.5 * x", "\"under 0.3 m\"", "x += 2;  // 0.3 m",
                           "rng() >> 33", "constexpr double kMost = kRules.most;", "out << 100 * share"})
    EXPECT_EQ(bare_number(code(line)), "") << line;
}

class NoConstant : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(OfARoom, NoConstant,
                         testing::Values("inference", "windows", "findings", "effects", "calibrate", "design",
                                         "before_after"));

/// What the tables of a room say by a name of their own: the numbers of a form (Form in effect.hpp), whose manoeuvres
/// end its file, or of a spectrum; bins that are told; counts of gates and of shifted set-points; heights of a way.
bool is_an_entry(const std::string& line) {
  static const std::regex entry(
      "\\.(least|floor|priors|scales) = |scales_of\\(|k(Wall|Height)Edges\\[\\] =|kHoverGates =|kShapes|kOwn "
      "=|double height : \\{|"
      "motors_\\.size\\(\\) < 4");
  return std::regex_search(line, entry);
}

TEST_P(NoConstant, StandsOutsideTheRoomsRules) {
  std::size_t files = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(BACKWASH_SOURCE_DIR "/core/study/" + std::string(GetParam()))) {
    const std::string name = entry.path().filename();
    if (!(name.ends_with(".cpp") || name.ends_with(".hpp")) || name.ends_with("rules.hpp")) continue;
    ++files;
    std::ifstream file(entry.path());
    for (std::string line; std::getline(file, line) && line.find(".manoeuvres = ") == line.npos;)
      EXPECT_TRUE(is_an_entry(line) || bare_number(code(line)).empty())
          << name << ": " << bare_number(code(line)) << " in " << line;
  }
  EXPECT_GE(files, 5u);
}

}  // namespace
}  // namespace backwash::study

/// What belongs to an effect beside its own file; each failure names the effect that was forgotten.
namespace backwash::study {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::set<std::string> names() {
  std::set<std::string> all;
  for (const Effect& e : effects()) all.insert(e.name);
  return all;
}

TEST(Effects, EveryFileWithAnEffectHasItsLineInTheTable) {
  const std::regex definition("\\nEffect (\\w+)\\(\\) \\{");
  std::size_t found = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(BACKWASH_SOURCE_DIR "/core/study/effects")) {
    if (file.path().extension() != ".cpp") continue;
    const std::string text = text_of(file.path());
    for (std::sregex_iterator at(text.begin(), text.end(), definition), end; at != end; ++at, ++found) {
      EXPECT_EQ((*at)[1].str() + ".cpp", file.path().filename()) << "an effect's file has its name";
      EXPECT_TRUE(names().contains((*at)[1])) << (*at)[1] << " is not in kEffects of core/study/effects/table.cpp";
    }
  }
  EXPECT_EQ(found, effects().size());
}

TEST(Effects, EveryEffectIsHiddenByTheGenerator) {
  for (const Effect& e : effects())
    EXPECT_EQ(std::ranges::count(study_worlds::cause_names(), e.name), 1)
        << e.name << " is not in tests/study_worlds/effects.cpp";
  EXPECT_EQ(study_worlds::cause_names().size(), effects().size());
}

TEST(Effects, EveryEffectHasItsSizeAndItsRowInTheConfusion) {
  const std::string text = text_of(BACKWASH_SOURCE_DIR "/docs/measurements/confusion.md");
  const std::string sizes = text.substr(0, text.find("\n## Confusion"));
  ASSERT_LT(sizes.size(), text.size());
  for (const Effect& e : effects()) {
    EXPECT_NE(sizes.find(e.name), std::string::npos) << e.name << " has no size in docs/measurements/confusion.md";
    EXPECT_NE(self_test().of(e.name), nullptr) << e.name << " has no row in docs/measurements/confusion.md";
  }
}

TEST(Effects, EveryFormSaysWhatItAddsAndFromWhichSizeOnItIsAnEffect) {
  std::set<std::string> formulas;
  for (const Form* f : catalogue()) {
    EXPECT_TRUE(formulas.insert(f->formula).second) << f->cause() << ": two forms with the same formula";
    EXPECT_FALSE(f->parameters.empty()) << f->formula;
    EXPECT_EQ(f->priors.size(), f->parameters.size()) << f->formula << ": not each parameter has a typical size";
    EXPECT_TRUE(f->columns) << f->formula;
    EXPECT_GT(f->floor + f->least, 0) << f->formula << ": neither floor nor least";
    EXPECT_EQ(f->scale_name.empty(), f->scales.size() == 1) << f->formula;
    EXPECT_EQ(f->effect->name, f->cause());
    for (const Form& shape : f->shapes) EXPECT_EQ(shape.parameters, f->parameters) << shape.formula;
  }
}

TEST(Effects, ThatNoFlightTellsAreRefusedByNameWhenTheCatalogueIsMade) {
  const auto form = [](bool constant, auto columns) {
    return Form{.formula = "made up", .parameters = {"B"}, .constant = constant, .columns = columns};
  };
  const auto factor = [](const Windows& ws, const Scale&) {
    return std::vector{in_variance(ws, [](auto&) { return 1.0; })};
  };
  const auto push = [](const Windows& ws, const Scale&) {
    return std::vector{level(ws, [](auto& w) -> Vec3 { return w.body_axis(1); })};
  };
  for (const bool constant : {false, true}) {
    const auto why = stays_free(form(constant, factor));
    ASSERT_TRUE(why) << "a constant factor on Σ is each craft's own level";
    EXPECT_EQ(why->find("cannot be told: 'made up'"), 0u) << *why;
  }
  EXPECT_TRUE(stays_free(form(false, push)));
  EXPECT_FALSE(stays_free(form(true, push))) << "trim claims the offset itself";
  for (const Form* f : catalogue()) EXPECT_FALSE(stays_free(*f)) << f->formula;
}

}  // namespace
}  // namespace backwash::study
