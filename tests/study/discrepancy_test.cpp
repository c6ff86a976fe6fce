// SPDX-License-Identifier: BSD-3-Clause
// The study against worlds of the independent generator. Few worlds: they show that it works; the rates are the nightly
// matrix's (tests/nightly/study.sh). The seed is fixed by default and printed; BACKWASH_STUDY_SEED changes it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "core/config/config.hpp"
#include "core/log/columns/import_crazypad.hpp"
#include "core/map/load_map.hpp"
#include "core/study/findings/consequence.hpp"
#include "core/study/findings/extend.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/support/terms_of.hpp"

namespace {

using namespace backwash;
using namespace backwash::study;

std::uint64_t seed() {
  const char* set = std::getenv("BACKWASH_STUDY_SEED");
  const std::uint64_t value = set ? std::strtoull(set, nullptr, 10) : 4711;
  ::testing::Test::RecordProperty("seed", std::to_string(value));
  return value;
}

const std::filesystem::path& folder() {
  static const struct Folder {
    std::filesystem::path path = std::filesystem::temp_directory_path() / ("study-test-" + std::to_string(::getpid()));
    ~Folder() { std::filesystem::remove_all(path); }
  } made;
  return made.path;
}

Observations world_with(const std::vector<std::string>& causes, double size, int flights = 12, int number = 0) {
  const study_worlds::Request request{seed() + static_cast<std::uint64_t>(number), causes, size, flights, ""};
  return study_worlds::observe(study_worlds::draw_world(request), folder());
}

StudyResult studied(const Observations& seen, bool detectable = false) {
  StudyOptions options;
  options.minimum_detectable = detectable;
  return study::study(seen, options);
}

class NamesTheHiddenCause : public ::testing::TestWithParam<std::string> {};

TEST_P(NamesTheHiddenCause, AtOneAndAHalfTimesTheTablesSize) {
  const study_worlds::Request request{seed(), {GetParam()}, 1.5, 12, ""};
  const auto world = study_worlds::draw_world(request);
  auto options = study_worlds::with_reference(world, folder());
  options.minimum_detectable = false;
  const auto result = study::study(study_worlds::observe(world, folder()), options);
  ASSERT_FALSE(result.causes.empty()) << "seed " << seed() << ": " << study_worlds::told(result);
  const auto& found = result.causes.front().found;
  bool in_set = found.form->cause() == GetParam();
  for (const auto& rival : found.rivals) in_set = in_set || rival.name == GetParam();
  EXPECT_TRUE(in_set) << "seed " << seed() << ": " << study_worlds::told(result);
  EXPECT_LE(found.p, CauseSearchOptions{}.accept_p);
  EXPECT_GT(result.causes.front().gain.held_out_nats, 0);
}

INSTANTIATE_TEST_SUITE_P(OfTheCatalogue, NamesTheHiddenCause, ::testing::ValuesIn(study_worlds::cause_names()),
                         [](const auto& instance) { return instance.param; });

TEST(Study, FindsNothingInMostWorldsWithoutAnEffect) {
  int alarms = 0;
  std::string told;
  for (int k = 0; k < 4; ++k) {
    const auto result = studied(world_with({}, 1, 12, k));
    alarms += result.verdict == StudyVerdict::nothing_found ? 0 : 1;
    told += study_worlds::told(result) + "; ";
  }
  EXPECT_LE(alarms, 1) << "seed " << seed() << ": " << told;
}

TEST(Study, SaysUnknownStructureForACauseOutsideTheCatalogue) {
  const auto result = studied(world_with({"unknown"}, 1.5));
  EXPECT_EQ(result.verdict, StudyVerdict::unknown_structure) << "seed " << seed() << ": " << study_worlds::told(result);
}

TEST(Study, NamesNothingFromFewerThanTenFlights) {
  const auto result = studied(world_with({"ceiling"}, 3, 6));
  EXPECT_EQ(result.verdict, StudyVerdict::insufficient);
  EXPECT_TRUE(result.causes.empty());
}

TEST(Study, TellsAWeakCauseBesideAStrongOneOfOtherChannels) {
  for (const auto& strong : {"heavy_tails", "vibration"}) {
    const auto told = study_worlds::told(studied(world_with({strong, "draft"}, 1)));
    EXPECT_NE(told.find(strong), std::string::npos) << "seed " << seed() << ": " << told;
    EXPECT_NE(told.find("draft"), std::string::npos) << "seed " << seed() << ": " << told;
  }
}

TEST(Study, NamesAVibrationWhoseLinesFoldBelowSixHertz) {
  int named = 0;
  std::string all;
  for (std::uint64_t k = 0; k < 4; ++k) {
    const study_worlds::Request request{seed() + k, {"vibration"}, 4.2, 12, "fold"};  // 1.05 m/s²
    const auto told = study_worlds::told(studied(study_worlds::observe(study_worlds::draw_world(request), folder())));
    named += told.find("vibration") != std::string::npos ? 1 : 0;
    all += told + "; ";
  }
  EXPECT_GE(named, 3) << "seed " << seed() << ": " << all;
}

TEST(Study, SaysWhyAVibrationIsNotTestedWhereItsLinesCannotBeTold) {
  auto seen = world_with({}, 1);
  const auto why = [](const StudyResult& result) {
    for (const auto& [name, reason] : result.not_tested)
      if (name == "vibration") return reason;
    return std::string("tested");
  };
  EXPECT_EQ(why(studied(seen)), "tested");
  for (std::size_t rotor = 0; rotor < 4; ++rotor)
    std::fill_n(seen.weight[kLine1 + rotor].begin(), seen.windows.size(), 0.0);
  EXPECT_NE(why(studied(seen)).find("fold below 0.75 Hz"), std::string::npos) << why(studied(seen));
  seen.missing.emplace(Source::rpm, "no rpm1 column");
  EXPECT_EQ(why(studied(seen)), "no rpm1 column");
}

TEST(Study, NamesACeilingOfWhichTwoHeightsCannotTellTheLength) {
  int in_set = 0;
  std::string all;
  for (int k = 0; k < 4; ++k) {
    const study_worlds::Request request{seed() + static_cast<std::uint64_t>(k), {"ceiling"}, 1, 12, "height"};
    const auto told = study_worlds::told(studied(study_worlds::observe(study_worlds::draw_world(request), folder())));
    in_set += told.find("ceiling") != std::string::npos ? 1 : 0;
    all += told + "; ";
  }
  EXPECT_GE(in_set, 3) << "seed " << seed() << ": " << all;
}

TEST(Study, FindsTheInjectedMassWithinItsInterval) {
  const study_worlds::Request request{seed(), {"payload"}, 2, 12, ""};
  const auto world = study_worlds::draw_world(request);
  const auto result = studied(study_worlds::observe(world, folder()));
  ASSERT_EQ(result.causes.size(), 1u) << study_worlds::told(result);
  const double relative = world.effects.of("payload"), truth = 1 - 1 / (1 + relative);
  EXPECT_NEAR(result.causes[0].found.parameters[0].value, truth, 0.2 * std::abs(truth));
}

TEST(Study, FindsNoMoreOfACauseThatItsExtendedModelHolds) {
  auto seen = world_with({"ceiling"}, 2);
  const auto before = studied(seen);
  ASSERT_EQ(study_worlds::told(before).substr(0, 7), "ceiling");
  EXPECT_TRUE(study::apply(terms_of(before), seen).left.empty());
  for (const auto& cause : studied(seen).causes) EXPECT_NE(cause.found.form->cause(), "ceiling");
}

TEST(Study, ExtendedModelFilesAreAcceptedByTheReader) {
  const auto seen = world_with({"ceiling"}, 2);
  const auto path = (folder() / "extended.toml").string();
  const auto model = backwash::config::load_model("builtin:quad-5in").value();
  const auto result = studied(seen);
  {
    std::FILE* file = std::fopen(path.c_str(), "w");
    std::fputs(extended_model_text(model, result, seen, "it's \"my\" model.toml", "test").c_str(), file);
    std::fclose(file);
  }
  const auto read = backwash::config::load_model(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->bound.mean_vertical, model.bound.mean_vertical);
  ASSERT_FALSE(read->extension.empty());
  const auto& effect = read->extension.front();
  const auto& found = result.causes.front().found;
  EXPECT_EQ(effect.kind, backwash::Law::push_under_surface);
  EXPECT_NEAR(effect.value.x(), found.theta[0], 1e-6);
  EXPECT_NEAR(effect.scale, found.scale.value, 1e-6);
  EXPECT_GT(effect.error.x(), 0);
}

TEST(Study, AnExtendedModelMovesHoverSetsUnderTheCeilingAndKeepsMoreSamplesInside) {
  const study_worlds::Request request{seed(), {"ceiling"}, 3, 12, ""};
  const auto world = study_worlds::draw_world(request);
  const auto seen = study_worlds::observe(world, folder());
  const auto result = studied(seen);
  ASSERT_FALSE(result.causes.empty()) << study_worlds::told(result);
  const auto model = backwash::config::load_model("builtin:" + world.craft.model).value();
  const auto vehicle = backwash::config::load_vehicle((folder() / "vehicle.toml").string());
  ASSERT_TRUE(vehicle) << vehicle.error().message;
  const auto grid = backwash::map::load_map((folder() / "map.bt").string());
  ASSERT_TRUE(grid);
  const auto c = consequence(result, seen, model, *vehicle, std::vector(seen.flights, &*grid));
  ASSERT_TRUE(c.before.hover && c.after.hover);
  EXPECT_EQ(c.before.hover->shift_95, 0);
  EXPECT_GT(c.after.hover->shift_95, 0.01);
  EXPECT_LT(c.after.hover->shift_median,
            0.3 * c.after.hover->shift_95);  // by place: most were flown far below the ceiling
  EXPECT_GT(c.after.inside, c.before.inside);
  EXPECT_GE(c.after.hover->extent_95, c.before.hover->extent_95);
  EXPECT_EQ(c.before.plan, plan::PlanStatus::ok);
}

/// What would separate two causes of the catalogue, by the first form of each that is, or is not, about rotors.
std::vector<Separation> between(const Observations& seen, const std::string& ours, const std::string& theirs,
                                bool rotor_forms) {
  const auto form = [&](const std::string& name) {
    for (const Form* f : catalogue())
      if (f->cause() == name && f->integer_scale == rotor_forms) return f;
    throw std::logic_error(name);
  };
  const Form *own = form(ours), *rival = form(theirs);
  const auto columns = own->columns(seen.windows, own->scales.front());
  const SmallVector theta = SmallVector::Constant(static_cast<Eigen::Index>(columns.size()), 0.1);
  const Accepted accepted{own, own->scales.front(), columns, theta, 0, 0, {}, {}};
  return separations(Evidence(seen), accepted, {theirs, rival, rival->scales.front(), 0});
}

TEST(Separations, TurnOnTheSpotForTrimAndDraftAndNothingForDamageAndWeight) {
  const auto seen = world_with({}, 1);
  const auto turn = between(seen, "trim", "draft", false);
  EXPECT_NE(turn.front().manoeuvre.find("yaw turn"), std::string::npos) << turn.front().manoeuvre;
  EXPECT_GT(turn.front().expected_nats.value_or(0), 3);
  for (const auto& [ours, theirs] : {std::pair("propeller_damage", "payload"), {"payload", "propeller_damage"}}) {
    const auto none = between(seen, ours, theirs, true);
    ASSERT_EQ(none.size(), 1u);
    EXPECT_FALSE(none.front().expected_nats.has_value());
  }
}

std::string crazypad(const std::string& name) { return std::string(BACKWASH_RECORDINGS) + "/crazypad/" + name; }

TEST(ImportCrazyPad, ConvertsUnitsAndNamesWhatIsMissing) {
  const std::string path = crazypad("normal__e8_log00.csv");
  const auto log = log::import_crazypad(path);
  ASSERT_TRUE(log) << log.error().message;
  for (const double u : log->column("motor3")) EXPECT_LE(u, 1.0);
  for (const double v : log->column("battery_v")) EXPECT_LT(std::abs(v - 3.8), 1.0);
}

TEST(ImportCrazyPad, TakesRecordingsWhoseYawIsNanAndInventsNoAttitude) {
  int without_yaw = 0;
  for (const auto& file : std::filesystem::directory_iterator(crazypad(""))) {
    if (file.path().extension() != ".csv") continue;
    without_yaw += log::read_csv(file.path()) ? 0 : 1;
    const auto log = log::import_crazypad(file.path());
    ASSERT_TRUE(log) << log.error().message;
    for (const char* absent : {"qw", "yaw_deg", "roll_deg"}) EXPECT_FALSE(log->has(absent)) << absent;
  }
  EXPECT_GT(without_yaw, 0);
}

TEST(ImportCrazyPad, RefusesAColumnThatItNeedsAndThatIsNan) {
  std::filesystem::create_directories(folder());
  const std::string path = (folder() / "nan.csv").string();
  std::ofstream(path) << "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_g,ay_g,az_g,roll_deg,yaw_deg,motor1,motor2,motor3,"
                         "motor4,battery_mV\n0,0,0,nan,0,0,0,0,0,0,0,nan,1,1,1,1,3800\n";
  const auto log = log::import_crazypad(path);
  ASSERT_FALSE(log);
  EXPECT_NE(log.error().message.find(":2: column 'z_m'"), std::string::npos) << log.error().message;
}

}  // namespace
