// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "core/study/effects/table.hpp"
#include "core/study/findings/self_test.hpp"
#include "tests/study_worlds/world.hpp"

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
  for (const auto& file : std::filesystem::directory_iterator(BACKWASH_SOURCE_DIR "/core/study/effects")) {
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
    EXPECT_EQ(f->possible.size(), f->parameters.size()) << f->formula << ": not each parameter says what is possible";
    EXPECT_TRUE(f->columns) << f->formula;
    EXPECT_GT(f->floor + f->least, 0) << f->formula << ": neither floor nor least";
    EXPECT_EQ(f->scale_name.empty(), f->scales.size() == 1) << f->formula;
    EXPECT_EQ(f->effect->name, f->cause());
    for (const Form& shape : f->shapes) EXPECT_EQ(shape.parameters, f->parameters) << shape.formula;
  }
}

}  // namespace
}  // namespace backwash::study
