// SPDX-License-Identifier: BSD-3-Clause
// The next flight: what it tells of rivals, how many of it are needed, and that it fits in the map.
#include "core/study/design/design.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/search/ends.hpp"
#include "core/study/design/imagined.hpp"
#include "core/study/design/ways.hpp"
#include "core/study/effects/table.hpp"
#include "tests/study_worlds/observe.hpp"

namespace backwash::study {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

/// The cause's column a and the rival's b on windows of unit noise.
MatrixXd gram(const VectorXd& a, const VectorXd& b) {
  MatrixXd x(a.size(), 2);
  x << a, b;
  return x.transpose() * x;
}

TEST(Divergence, OfTwoLinearRivalsIsTheClosedForm) {
  const VectorXd a = VectorXd::LinSpaced(30, 0, 1), b = a.array().square();
  const VectorXd a_new = VectorXd::LinSpaced(10, 1, 3), b_new = a_new.array().square();
  const double theta = 0.7;
  const Imitation imitation{gram(a, b), gram(a_new, b_new), VectorXd::Constant(1, theta)};
  const double copied = theta * a.dot(b) / b.squaredNorm();  // the rival refitted to the cause's prediction
  const double expected = 0.5 * (theta * a_new - copied * b_new).squaredNorm();
  EXPECT_NEAR(imitation.divergence(), expected, 1e-4 * expected);
  for (const double n : {0.0, 1.0, 7.0}) {
    const double aa = a.squaredNorm() + n * a_new.squaredNorm(), ab = a.dot(b) + n * a_new.dot(b_new),
                 bb = b.squaredNorm() + n * b_new.squaredNorm();
    EXPECT_NEAR(imitation.left(n), 0.5 * theta * theta * (aa - ab * ab / bb), 1e-9) << n << " flights";
  }
  EXPECT_LT(imitation.left(1) - imitation.left(0), expected) << "the rival gives way on the new flight too";
  EXPECT_NEAR((imitation.left(1e-6) - imitation.left(0)) / 1e-6, expected, 1e-3 * expected) << "but not at first";
}

TEST(Divergence, OfTheSamePredictionIsNone) {
  const VectorXd a = VectorXd::LinSpaced(30, 0, 1), b = 2 * a;
  const VectorXd a_new = VectorXd::LinSpaced(10, 1, 3), b_new = 2 * a_new;
  const Imitation same{gram(a, b), gram(a_new, b_new), VectorXd::Constant(1, 0.7)};
  EXPECT_NEAR(same.divergence(), 0, 1e-9);
  EXPECT_NEAR(same.left(20), 0, 1e-9);
  const Imitation other{gram(a, b), gram(a_new, -b_new), VectorXd::Constant(1, 0.7)};
  EXPECT_GT(other.divergence(), 10) << "alike on what was flown, and opposite on what comes";
}

TEST(Divergence, WhatNoFlownWindowTellsIsFittedToTheNewFlight) {
  const VectorXd a = VectorXd::LinSpaced(30, 0, 1), never = VectorXd::Zero(30);
  const VectorXd a_new = VectorXd::LinSpaced(10, 1, 3);
  const Imitation copies{gram(a, never), gram(a_new, a_new), VectorXd::Constant(1, 0.7)};
  EXPECT_NEAR(copies.divergence(), 0, 1e-3) << "a rival of free size there copies all of it";
}

/// Share of `draws` campaigns of n flights in which the sum of Gaussian log-likelihood ratios passes the lead needed;
/// each flight's ratio is of one number of unit variance, whose means the two rivals place `apart`.
double simulated(double lead, double needed, double apart, int n, int draws) {
  std::mt19937_64 rng(4711);
  std::normal_distribution<double> noise;
  int passed = 0;
  for (int d = 0; d < draws; ++d) {
    double sum = lead;
    for (int f = 0; f < n; ++f) {
      const double y = apart + noise(rng);  // the truth is `apart`, the rival says 0
      sum += 0.5 * y * y - 0.5 * (y - apart) * (y - apart);
    }
    passed += sum > needed;
  }
  return static_cast<double>(passed) / draws;
}

TEST(Lead, PassesAsOftenAsSimulatedLikelihoodRatiosDo) {
  constexpr int kDraws = 40000;
  for (const auto& [lead, needed, apart, n] :
       {std::tuple{0.0, 3.0, 1.0, 5}, {0.0, 3.0, 1.0, 15}, {-2.0, 8.0, 1.5, 9}, {4.0, 8.0, 0.5, 12}}) {
    const double p = passes(lead, n * 0.5 * apart * apart, needed);
    const double error = std::sqrt(p * (1 - p) / kDraws);
    EXPECT_NEAR(p, simulated(lead, needed, apart, n, kDraws), 4 * error) << n << " flights";
  }
  EXPECT_EQ(passes(4, 0, 3), 1) << "a flight that tells nothing leaves the lead as it is";
  EXPECT_EQ(passes(2, 0, 3), 0);
}

TEST(Lead, IsNeededByTheRuleOfRivals) {
  EXPECT_EQ(needed_lead(0, 0), kRules.rival_nats.value);
  EXPECT_EQ(needed_lead(4, 0), 8) << "two standard errors";
  EXPECT_EQ(needed_lead(40, 0), kRules.rival_most_nats.value) << "never more";
  EXPECT_EQ(needed_lead(0, 100), 30) << "a share of the gain";
}

/// A world whose flights never turn, and what was found in it.
struct NeverTurned {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("study-design-" + std::to_string(::getpid()));
  study_worlds::HiddenWorld made = study_worlds::draw_world({1796100001, {"trim"}, 1, 12, "yaw"});
  Observations seen = study_worlds::observe(made, folder);
  Vehicle vehicle = config::load_vehicle((folder / "vehicle.toml").string()).value();
  Model model = config::load_model("builtin:" + made.craft.model).value();
  map::OccupancyGrid grid = map::load_map((folder / "map.bt").string()).value();
  StudyResult result;
  NeverTurned() {
    std::filesystem::remove_all(folder);
    model.ground.r0 = vehicle.body.diagonal_radius;
    StudyOptions options;
    options.minimum_detectable = options.dependence = false;
    result = study(seen, options);
  }
};

const NeverTurned& never_turned() {
  static const NeverTurned made;
  return made;
}

/// 60 s at one place; the heading turns as fast as this, rad/s.
std::vector<Setpoint> hover(const Vec3& at, double rate) {
  std::vector<Setpoint> commands(3000);
  for (std::size_t k = 0; k < commands.size(); ++k) {
    commands[k].p_W = at;
    commands[k].yaw = std::remainder(rate * kControlPeriod * static_cast<double>(k), 2 * M_PI);
  }
  return commands;
}

TEST(Contest, OfTrimAndDraftIsDecidedByTurnsOfTheHeadingAndByNothingElse) {
  const auto& w = never_turned();
  ASSERT_EQ(w.result.verdict, StudyVerdict::cannot_distinguish) << study_worlds::told(w.result);
  std::vector<Accepted> accepted{w.result.causes.front().found};
  Evidence evidence(w.seen);
  evidence.whiten(columns_of(accepted, w.seen));
  const Contest contest(evidence, accepted, 0, w.result.threshold);
  ASSERT_EQ(contest.explanations().size(), 2u);
  EXPECT_NEAR(contest.explanations()[0].probability + contest.explanations()[1].probability, 1, 1e-12);
  MapView surroundings(&w.grid, w.model);
  const Imagination imagination(w.seen, w.vehicle, surroundings);
  const Vec3 at = 0.5 * w.made.room.inside.high;
  const auto still = imagination.windows(hover(at, 0), false), turning = imagination.windows(hover(at, 0.5), false);
  ASSERT_GT(still.windows.size(), 25u) << "no imagined window is gated out";
  const Outlook of_still = contest.after(evidence.next(still)), of_turns = contest.after(evidence.next(turning));
  EXPECT_LT(of_still.divergence, 1e-6) << "a push fixed to the body is one fixed to the world while nothing turns";
  EXPECT_EQ(of_still.flights(), std::nullopt);
  EXPECT_GT(of_turns.divergence, 1);
  ASSERT_TRUE(of_turns.flights());
  EXPECT_GE(*of_turns.flights(), 1);
  EXPECT_LE(*of_turns.flights(), 4);
  EXPECT_TRUE(std::ranges::is_sorted(of_turns.separated));
}

TEST(Design, TurnsTheHeadingWhereTheRoomHasPlaceForItAndStartsWhereItIsTold) {
  const auto& w = never_turned();
  const auto world = plan::build_world(w.grid, w.model, w.vehicle);
  const Vec3 start(0.5 * w.made.room.inside.high.x(), 0.5 * w.made.room.inside.high.y(), 1.2);
  const Design next = design(w.seen, w.result, *world, w.model, start);
  ASSERT_NE(next.chosen(), nullptr) << next.message;
  EXPECT_NE(next.chosen()->name.find("turn the heading"), std::string::npos) << next.message;
  EXPECT_NEAR((next.chosen()->commands.front().p_W - start).norm(), 0, 0.02);
  EXPECT_GE(next.chosen()->separated, 0.9);
  for (const NextFlight& flight : next.flights) {
    const bool faces = std::ranges::any_of(flight.points, [](const Waypoint& p) { return p.yaw.has_value(); });
    EXPECT_LE(flight.points.size(), faces ? 32u : 64u) << flight.name << ": no more than follow takes";
    EXPECT_EQ(faces, flight.name.find("on the spot") != std::string::npos) << flight.name;
    for (const Waypoint& p : flight.points) EXPECT_FALSE(plan::why_no_rest(*world, p.p_W, 0)) << flight.name;
    if (flight.name.starts_with("stand still")) {
      EXPECT_EQ(flight.flights, std::nullopt) << flight.name;
    }
  }
  for (const auto& [name, why] : next.left_out) EXPECT_FALSE(why.empty()) << name;
}

TEST(Design, LeavesOutWhatDoesNotFit) {
  const auto& w = never_turned();
  const auto world = plan::build_world(w.grid, w.model, w.vehicle);
  const Vec3 start(0.5 * w.made.room.inside.high.x(), 0.5 * w.made.room.inside.high.y(), 1.2);
  const FlownWay through = flown_way(*world, start, {"through the wall", {{start}, {Vec3(-1, 1, 1)}}}, 90);
  EXPECT_TRUE(through.points.empty());
  EXPECT_FALSE(through.why_not.empty());
  const FlownWay there = flown_way(*world, start, {"there and back", {{start + Vec3(0.3, 0, 0)}, {start}}}, 90);
  EXPECT_EQ(there.why_not, "");
  EXPECT_GT(there.points.size(), 10u);
}

/// How many runs of commands stand still at a heading for longer than a second, and the largest rate between, rad/s.
std::pair<std::vector<double>, double> headings(const std::vector<Setpoint>& commands) {
  std::vector<double> rested;
  double fastest = 0;
  int still = 0;
  for (std::size_t k = 1; k < commands.size(); ++k) {
    const double rate = std::remainder(commands[k].yaw - commands[k - 1].yaw, 2 * M_PI) / kControlPeriod;
    fastest = std::max(fastest, std::abs(rate));
    still = rate == 0 ? still + 1 : 0;
    if (still == 60) rested.push_back(commands[k].yaw);
  }
  return {rested, fastest};
}

TEST(Design, AWaypointsHeadingIsTurnedToOnTheSpotAndRestedAt) {
  const auto& w = never_turned();
  const auto world = plan::build_world(w.grid, w.model, w.vehicle);
  const Vec3 start(0.5 * w.made.room.inside.high.x(), 0.5 * w.made.room.inside.high.y(), 1.2);
  const FlownWay flown =
      flown_way(*world, start, {"turns", {{start, 1.0}, {start, -2.5}, {start + Vec3(0, 0, 0.2)}, {start, 3.0}}}, 25);
  ASSERT_EQ(flown.why_not, "");
  const auto [rested, fastest] = headings(flown.commands);
  ASSERT_GE(rested.size(), 4u);
  const double expected[] = {1.0, -2.5, 3.0, 1.0};  // the one without a heading keeps what was: its path leads nowhere
  for (std::size_t k = 0, seen = 0; k < 4; ++k, ++seen) {
    while (seen + 1 < rested.size() && std::abs(std::remainder(rested[seen] - expected[k], 2 * M_PI)) > 1e-3) ++seen;
    EXPECT_NEAR(std::remainder(rested[seen] - expected[k], 2 * M_PI), 0, 1e-3) << "heading " << k;
  }
  EXPECT_LE(fastest, 1.0 + 1e-9) << "rad/s, as the daemon turns";
  EXPECT_GT(fastest, 0.5);
  for (const Setpoint& c : flown.commands) EXPECT_LT((c.p_W - start).head<2>().norm(), 1e-6) << "on the spot";
  EXPECT_EQ(flown.points[1].yaw, -2.5);
  EXPECT_EQ(flown.points[2].yaw, std::nullopt);
}

TEST(Design, IsNothingWhereNothingHasARival) {
  auto result = never_turned().result;
  result.causes.front().found.rivals.clear();
  const auto& w = never_turned();
  const auto world = plan::build_world(w.grid, w.model, w.vehicle);
  const Design next = design(w.seen, result, *world, w.model, Vec3(1.5, 1.5, 1.2));
  EXPECT_TRUE(next.sets.empty() && next.flights.empty());
  EXPECT_EQ(next.chosen(), nullptr);
}

TEST(Design, OfRotorsThatMotorsAloneTellIsNone) {
  auto result = never_turned().result;
  const auto& w = never_turned();
  const auto alone = [](const char* cause) {
    return *std::ranges::find_if(
        catalogue(), [&](auto* f) { return f->cause() == cause && f->needs == std::vector{Source::motors}; });
  };
  Accepted& found = result.causes.front().found;
  found.form = alone("propeller_damage");
  found.scale = {0};
  found.columns = found.form->columns(w.seen.windows, found.scale);
  found.rivals = {{"payload", alone("payload"), {0}, 40}};  // motors alone: however much it is behind
  const auto world = plan::build_world(w.grid, w.model, w.vehicle);
  const Vec3 start(0.5 * w.made.room.inside.high.x(), 0.5 * w.made.room.inside.high.y(), 1.2);
  const Design next = design(w.seen, result, *world, w.model, start);
  EXPECT_EQ(next.message, "no flight of this list separates them");
  EXPECT_EQ(next.chosen(), nullptr);
}

TEST(Design, WritesThePointsThatOtherProgramsRead) {
  EXPECT_EQ(points_csv({{{1, 2, 3}}, {{-0.5, 0.25, 1.2}}}),
            "x_m,y_m,z_m\n1.0000,2.0000,3.0000\n-0.5000,0.2500,1.2000\n");
  EXPECT_EQ(points_csv({{{1, 2, 3}, -1.5}, {{-0.5, 0.25, 1.2}}}),
            "x_m,y_m,z_m,yaw_rad\n1.0000,2.0000,3.0000,-1.5000\n-0.5000,0.2500,1.2000,\n");
}

}  // namespace
}  // namespace backwash::study
