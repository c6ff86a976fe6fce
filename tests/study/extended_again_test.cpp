// SPDX-License-Identifier: BSD-3-Clause
// A study with a model that holds causes already: what may be the error of their forms is no cause of its own.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "core/study/effects/table.hpp"
#include "core/study/findings/extend.hpp"
#include "tests/study_worlds/observe.hpp"

namespace extended_again {
namespace {

using namespace backwash::study;

const Form& form_of(const std::string& cause) {
  return **std::find_if(catalogue().begin(), catalogue().end(), [&](auto* f) { return f->cause() == cause; });
}

Observations quiet() {
  const auto path = std::filesystem::temp_directory_path() / ("study-again-" + std::to_string(::getpid()));
  auto seen = study_worlds::observe(study_worlds::draw_world({4711, {"payload"}, 1e-4, 12, ""}), path);
  std::filesystem::remove_all(path);
  return seen;
}

StudyResult studied(const Observations& seen, std::vector<Known> known, bool dependence = false) {
  StudyOptions options;
  options.minimum_detectable = false;
  options.dependence = dependence;
  options.search.known = std::move(known);
  return backwash::study::study(seen, options);
}

TEST(ExtendedAgain, WhatMayBeTheErrorOfAKnownFormIsNoCause) {
  Observations seen = quiet();
  const auto push = form_of("ground_thrust").columns(seen.windows, {0.3});
  for (const auto& part : push.front().parts)
    for (std::size_t i = 0; i < part.x.size(); ++i) seen.y[part.channel][i] += 0.15 * part.x[i];
  const auto alone = studied(seen, {});
  ASSERT_EQ(study_worlds::told(alone), "ground_thrust");
  const double gain = alone.causes.front().found.gain, share = kRules.least_share;
  const auto beside = [&](const std::string& cause, double of) {
    const Form& form = form_of(cause);
    return study_worlds::told(studied(seen, {{form.columns(seen.windows, form.scales.front()), of}}));
  };
  EXPECT_EQ(beside("payload", 1.2 * gain / share), "nothing");
  EXPECT_EQ(beside("payload", 0.8 * gain / share), "ground_thrust");
  EXPECT_EQ(beside("heavy_tails", 1.2 * gain / share), "ground_thrust") << "tails disturb no push";
}

TEST(ExtendedAgain, AGainCountsForAsManyFlightsAsAreStudied) {
  const Observations before = quiet();
  const Form& payload = form_of("payload");
  ExtensionTerm term{"payload", payload.formula, payload.scales.front(), {0.02}};
  term.gain = 30;
  for (const auto& [flights, gain] :
       {std::pair{std::size_t{6}, 60.0}, {std::size_t{12}, 30.0}, {std::size_t{0}, 30.0}}) {
    Observations seen = before;
    term.flights = flights;
    const auto applied = apply({term}, seen);
    ASSERT_EQ(applied.known.size(), 1u);
    EXPECT_DOUBLE_EQ(applied.known.front().gain, gain) << flights;
    EXPECT_NE(seen.y[kMeanZ], before.y[kMeanZ]);
  }
}

}  // namespace
}  // namespace extended_again
