// SPDX-License-Identifier: BSD-3-Clause
// Flight logs whose numbers are finite and otherwise anything: a study ends with a verdict and finite figures.
#include <gtest/gtest.h>

#include <cmath>

#include "core/study/findings/study.hpp"
#include "core/study/findings/study_page.hpp"
#include "core/study/windows/observer.hpp"
#include "tests/fuzz/mutator.hpp"

namespace backwash::fuzz {
namespace {

using namespace study;

constexpr std::size_t kFlights = 11, kRows = 250;

/// Hovers at three places of a room with lines between them, every column there is.
log::FlightLog flown(Mutator& mutator) {
  log::FlightLog log;
  const auto noise = [&](double size) { return size * (static_cast<double>(mutator.below(2001)) / 1000 - 1); };
  for (std::size_t k = 0; k < kRows; ++k) {
    const double t = 0.04 * static_cast<double>(k);
    log.t_s.push_back(t);
    const auto add = [&](const std::string& name, double value) { log.columns[name].push_back(value); };
    const Vec3 cmd(0.8 * std::sin(0.7 * t), 0.8 * std::cos(0.5 * t), 1 + 0.5 * std::sin(0.9 * t));
    const Vec3 v(0.56 * std::cos(0.7 * t), -0.4 * std::sin(0.5 * t), 0.45 * std::cos(0.9 * t));
    for (int i = 0; i < 3; ++i) {
      const std::string axis(1, static_cast<char>('x' + i));
      add(axis + "_m", cmd[i] + noise(0.02));
      add("v" + axis + "_mps", v[i] + noise(0.05));
      add("a" + axis + "_mps2", noise(0.3));
      add("cmd_" + axis + "_m", cmd[i]);
      add("cmd_v" + axis + "_mps", v[i]);
      add("cmd_a" + axis + "_mps2", 0);
    }
    add("qw", 1);
    add("qx", noise(0.01));
    add("qy", noise(0.01));
    add("qz", 0);
    add("thrust", 0.45 + noise(0.02));
    add("battery_v", 16 - 0.01 * t);
    add("temperature_c", 25 + 0.1 * t);
    for (const char* rotor : {"1", "2", "3", "4"}) {
      add(std::string("rpm") + rotor, 12000 + noise(100));
      add(std::string("motor") + rotor, 0.5 + noise(0.01));
    }
    add("segment", static_cast<double>(k / 60));
  }
  return log;
}

/// A value, a stretch, a column, the clock or the end of one flight.
void damage(log::FlightLog& log, Mutator& mutator) {
  constexpr double kExtreme[] = {0, -1, 1e-300, 1e6, -1e12, 1e150, -1.7e308, 0.1};
  const double value = kExtreme[mutator.below(std::size(kExtreme))];
  auto column = std::next(log.columns.begin(), static_cast<std::ptrdiff_t>(mutator.below(log.columns.size())));
  const std::size_t at = mutator.below(log.t_s.size());
  switch (mutator.below(7)) {
    case 0:
      column->second[at] = value;
      break;
    case 1:
      std::fill(column->second.begin() + static_cast<std::ptrdiff_t>(at), column->second.end(), value);
      break;
    case 2:
      for (double& x : column->second) x *= value;
      break;
    case 3:
      if (column->first.size() > 3) log.columns.erase(column);  // x_m, y_m and z_m are asked for by the program
      break;
    case 4:
      for (std::size_t i = at; i < log.t_s.size(); ++i) log.t_s[i] += std::abs(value);
      break;
    case 5:
      log.t_s.resize(at + 1);
      for (auto& [name, x] : log.columns) x.resize(at + 1);
      break;
    default:
      std::swap(column->second, log.columns.begin()->second);
  }
}

TEST(Fuzz, AStudyOfAnyFiniteNumbersEndsWithAVerdict) {
  Mutator mutator("study", 1);
  const map::OccupancyGrid room({-1.5, -1.5, 0}, 0.1, {30, 30, 22}, map::Cell::free);
  MapView surroundings(&room, Model{});
  const auto whole = flown(mutator);
  int verdicts = 0, named = 0;
  for (bool more = true; more; more = mutator.spend(10'000)) {
    Observer observer(Vehicle{}, surroundings);
    for (std::size_t f = 0; f < kFlights; ++f) {
      auto log = whole;
      for (std::size_t n = mutator.below(4); n > 0 && !log.columns.empty(); --n) damage(log, mutator);
      observer.add(log);
    }
    const auto seen = observer.finish();
    StudyOptions options;
    options.minimum_detectable = false;
    options.search.flips = 40;
    const auto result = study::study(seen, options);
    for (const auto& cause : result.causes)
      for (const auto& p : cause.found.parameters)
        EXPECT_TRUE(std::isfinite(p.value) && std::isfinite(p.low) && std::isfinite(p.high))
            << cause.found.form->cause() << ' ' << p.name;
    ++verdicts;
    named += result.verdict == StudyVerdict::insufficient ? 0 : 1;
  }
  std::printf("%d verdicts, %d with flights enough\n", verdicts, named);
  EXPECT_GT(named, verdicts / 4);
}

}  // namespace
}  // namespace backwash::fuzz
