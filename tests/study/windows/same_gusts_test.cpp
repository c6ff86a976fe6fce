// SPDX-License-Identifier: BSD-3-Clause
// Flights that come twice.
#include "core/study/windows/signals/same_gusts.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <random>

#include "tests/study_worlds/observe.hpp"

namespace {

using namespace backwash::study;

// Alike flown, in the same room: only the copy has the same gusts.
TEST(SameGusts, AFlightUnderOtherStampsAndWithALittleNoiseIsFoundAndNoOther) {
  study_worlds::Request request;
  request.seed = 7, request.flights = 8, request.causes = {"recirculation"}, request.size = 3;
  const auto world = study_worlds::draw_world(request);
  auto flights = study_worlds::fly_all(world);
  for (unsigned replica = 1; replica <= 2; ++replica) flights.push_back(study_worlds::fly_again(world, 2, replica));
  flights.push_back(flights[5]);
  std::mt19937_64 rng(8);
  std::normal_distribution draw;
  auto& copy = flights.back();
  for (std::size_t c = 0; c < copy.names.size(); ++c)
    for (auto& row : copy.rows) {
      if (copy.names[c] == "t_s") row[c] += 500;
      if (copy.names[c] == "x_m" || copy.names[c] == "y_m" || copy.names[c] == "z_m") row[c] += 5e-4 * draw(rng);
      if (copy.names[c].starts_with("a")) row[c] += 0.02 * draw(rng);
    }
  const auto folder = std::filesystem::temp_directory_path() / ("same-gusts-" + std::to_string(getpid()));
  const auto same = same_gusts(study_worlds::observe(world, flights, folder));
  std::filesystem::remove_all(folder);
  ASSERT_EQ(same.size(), 11u);
  for (std::size_t f = 0; f < 10; ++f) EXPECT_EQ(same[f], f) << "flown again along the same way: 8 and 9";
  EXPECT_EQ(same[10], 5u);
}

}  // namespace
