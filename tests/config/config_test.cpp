// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/config/file_texts.hpp"

namespace backwash::config {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// One number in a TOML text of the shipped files' style: `key = 1` or `a = { b = 1, c = 2 }` below `[section]`.
struct Place {
  std::string path;
  int line, section_line, parent_line;
  std::size_t value_begin, value_end;  // of the number
  std::size_t entry_begin, entry_end;  // of `key = value` with the comma or line that goes with it
};

/// Finds them by text alone, independently of the TOML library.
std::vector<Place> numbers(const std::string& text) {
  std::vector<Place> places;
  std::string section;
  int line = 0, section_line = 1;
  for (std::size_t begin = 0; begin < text.size(); begin = text.find('\n', begin) + 1) {
    ++line;
    const std::size_t end = std::min(text.find('\n', begin), text.find('#', begin));
    const std::string code = text.substr(begin, end - begin);
    if (code.starts_with("[")) {
      section = code.substr(1, code.find(']') - 1);
      section_line = line;
    }
    const std::size_t equals = code.find(" = ");
    if (code.starts_with("[") || equals == std::string::npos || code.find('"') != std::string::npos) continue;
    const std::string key = section + "." + code.substr(0, equals);
    const auto value_end = [&](std::size_t from) { return code.find_first_not_of("0123456789.", from); };
    const std::size_t brace = code.find('{');
    if (brace == std::string::npos) {
      const std::size_t v = equals + 3, e = std::min(value_end(v), code.size());
      places.push_back(
          {key, line, section_line, section_line, begin + v, begin + e, begin, text.find('\n', begin) + 1});
      continue;
    }
    for (std::size_t at = brace + 2; at < code.size();) {
      const std::size_t eq = code.find(" = ", at), v = eq + 3, e = value_end(v);
      const bool last = code[e] != ',';
      // The last entry goes with the comma before it, the others with the comma after them.
      const std::size_t from = last ? code.rfind(',', at) : at, to = last ? e : e + 2;
      places.push_back({key + "." + code.substr(at, eq - at), line, section_line, line, begin + v, begin + e,
                        begin + from, begin + to});
      if (last) break;
      at = e + 2;
    }
  }
  return places;
}

std::string head(int line, const std::string& key, const std::string& value) {
  return temporary_path() + ":" + std::to_string(line) + ": key '" + key + "' = " + value + ": ";
}

class ShippedFile : public testing::TestWithParam<const char*> {
 protected:
  std::string text = shipped(GetParam());
  bool vehicle = std::string(GetParam()).find("vehicle") != std::string::npos;
  std::string name = std::string("builtin:") + std::string(GetParam()).substr(0, 8);

  void expect_error(const std::string& changed, int line, const std::string& key, const std::string& value,
                    const std::string& right) {
    const std::string got = message(vehicle, changed);
    EXPECT_THAT(got, StartsWith(head(line, key, value)));
    EXPECT_THAT(got, HasSubstr(right));
    EXPECT_EQ(got.find('\n'), std::string::npos);
  }
};

TEST_P(ShippedFile, LoadsFromTheProgramWithoutTheSourceTree) {
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path("/");
  if (vehicle) {
    const auto v = load_vehicle(name);
    ASSERT_TRUE(v) << v.error().message;
    EXPECT_EQ("builtin:" + v->name, name);
  } else {
    const auto m = load_model(name);
    ASSERT_TRUE(m) << m.error().message;
  }
  std::filesystem::current_path(here);
  EXPECT_EQ(message(vehicle, text), "");
}

TEST_P(ShippedFile, RefusesAValueOutOfRangeNamingLineKeyValueAndRange) {
  ASSERT_GE(numbers(text).size(), 17u);
  for (const Place& p : numbers(text))
    for (const char* value : {"-1.5", "1e9", "nan", "inf"})
      expect_error(std::string(text).replace(p.value_begin, p.value_end - p.value_begin, value), p.line, p.path,
                   std::string(value) == "1e9" ? "1000000000" : value, "needs a number in ");
}

TEST_P(ShippedFile, RefusesAWrongType) {
  for (const Place& p : numbers(text))
    for (const char* value : {"true", "[ 1.0 ]", "1979-05-27"})
      expect_error(std::string(text).replace(p.value_begin, p.value_end - p.value_begin, value), p.line, p.path, value,
                   "needs a number in ");
}

TEST_P(ShippedFile, RefusesAMissingKeyUnlessItIsOptional) {
  const std::vector<std::string> optional = {
      "controller.latency", "controller.feedback_delay", "controller.attitude_lag",
      "ground.r0",          "ground.l_footprint_max",    "bound.kappa",
      "bound.tau_w"};
  for (const Place& p : numbers(text)) {
    const std::string changed = std::string(text).erase(p.entry_begin, p.entry_end - p.entry_begin);
    if (std::find(optional.begin(), optional.end(), p.path) != optional.end())
      EXPECT_EQ(message(vehicle, changed), "");
    else
      expect_error(changed, p.parent_line, p.path, "(missing)", "needs a number in ");
  }
}

TEST_P(ShippedFile, RefusesAnUnknownKeyEverywhere) {
  for (const Place& p : numbers(text)) {
    const std::size_t dot = p.path.rfind('.');
    const std::string name_of_key = p.path.substr(dot + 1);
    const std::size_t key_at = text.rfind(name_of_key + " = ", p.value_begin);
    const std::string value = text.substr(p.value_begin, p.value_end - p.value_begin);
    std::string got = message(vehicle, std::string(text).insert(key_at, 1, 'z'));
    EXPECT_THAT(got, StartsWith(temporary_path() + ":" + std::to_string(p.line) + ": key '" +
                                p.path.substr(0, dot + 1) + "z" + name_of_key + "' = "));
    EXPECT_THAT(got, HasSubstr("unknown; known here: "));
    EXPECT_THAT(got, HasSubstr(name_of_key));  // the right spelling is among them
  }
  expect_error("colour = 3\n" + text, 1, "colour", "3", "unknown");
  expect_error(text + "[wheels]\n", static_cast<int>(std::count(text.begin(), text.end(), '\n')) + 1, "wheels", "{…}",
               "unknown");
}

TEST_P(ShippedFile, RefusesBrokenTomlWithItsLine) {
  const std::string got = message(vehicle, replaced(text, "\n[", "\nx = = 3\n["));
  const auto line = std::count(text.begin(), text.begin() + static_cast<long>(text.find("\n[")), '\n') + 2;
  EXPECT_THAT(got, StartsWith(temporary_path() + ":" + std::to_string(line) + ": not valid TOML"));
  EXPECT_THAT(message(vehicle, text + text), HasSubstr("not valid TOML"));  // every key twice
}

INSTANTIATE_TEST_SUITE_P(Config, ShippedFile,
                         testing::Values("quad-5in.vehicle.toml", "quad-5in.model.toml", "quad-7in.vehicle.toml",
                                         "quad-7in.model.toml"));

TEST(LoadModel, ShippedFiveInchIsTheDocumentedDefault) {
  // The struct's initialisers are the documented defaults (docs/interfaces.md); only the steady push differs.
  const Model m = load_model("builtin:quad-5in").value(), d;
  EXPECT_EQ(m.base.horizontal, d.base.horizontal);
  EXPECT_EQ(m.base.vertical, d.base.vertical);
  EXPECT_EQ(m.ground.theta_max, d.ground.theta_max);
  EXPECT_EQ(m.ground.l_max, d.ground.l_max);
  EXPECT_EQ(m.ground.l_footprint_max, d.ground.l_footprint_max);
  EXPECT_EQ(m.ground.lambda.horizontal, d.ground.lambda.horizontal);
  EXPECT_EQ(m.ground.lambda.vertical, d.ground.lambda.vertical);
  EXPECT_EQ(m.ground.k1.horizontal, d.ground.k1.horizontal);
  EXPECT_EQ(m.ground.k1.vertical, d.ground.k1.vertical);
  EXPECT_EQ(m.ground.k2, d.ground.k2);
  EXPECT_EQ(m.corner.phi_max, d.corner.phi_max);
  EXPECT_EQ(m.corner.l_max, d.corner.l_max);
  EXPECT_EQ(m.corner.lambda.normal, d.corner.lambda.normal);
  EXPECT_EQ(m.corner.lambda.tangential, d.corner.lambda.tangential);
  EXPECT_EQ(m.corner.lambda.vertical, d.corner.lambda.vertical);
  EXPECT_EQ(m.wall.theta_min, d.wall.theta_min);
  EXPECT_EQ(m.wall.l_max, d.wall.l_max);
  EXPECT_EQ(m.wall.k1.normal, d.wall.k1.normal);
  EXPECT_EQ(m.wall.k1.tangential, d.wall.k1.tangential);
  EXPECT_EQ(m.wall.k1.vertical, d.wall.k1.vertical);
  EXPECT_EQ(m.wall.k2, d.wall.k2);
  EXPECT_EQ(m.bound.kappa, d.bound.kappa);
  EXPECT_EQ(m.bound.tau_w, d.bound.tau_w);
  EXPECT_EQ(m.bound.mean_horizontal, 0.05);
  EXPECT_EQ(m.bound.mean_vertical, 0.05);
}

TEST(LoadModel, AcceptsConfidenceAndProvenanceAndMissingMeans) {
  std::string text = shipped("quad-5in.model.toml");
  text = replaced(text, "mean = {", "# mean = {");
  text += "[confidence]\nwall.k2 = [2.1, 2.9]\n[provenance]\nlogs = [\"a.csv\", \"b.csv\"]\n";
  const TemporaryFile file(text);
  const auto model = load_model(file.path);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->bound.mean_horizontal, 0);
  EXPECT_EQ(model->bound.mean_vertical, 0);
}

TEST(LoadModel, ReadsTheEffectsOfAnExtensionAndRefusesWhatIsNone) {
  const auto with = [](const std::string& effect) {
    return shipped("quad-5in.model.toml") + "\n[[extension.term]]\ncause = 'ceiling'\neffect = [" + effect + "]\n";
  };
  const TemporaryFile file(
      with("{ kind = 'push_under_surface', value = [0.31], error = [0.05], scale = 0.22 }, "
           "{ kind = 'push', value = [0.1, 0, -0.2], error = [0, 0, 0.01] }"));
  const auto model = load_model(file.path);
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_EQ(model->extension.size(), 2u);
  EXPECT_EQ(model->extension[0].kind, Law::push_under_surface);
  EXPECT_EQ(model->extension[0].value.x(), 0.31);
  EXPECT_EQ(model->extension[0].error.x(), 0.05);
  EXPECT_EQ(model->extension[0].scale, 0.22);
  EXPECT_EQ(model->extension[1].value, Vec3(0.1, 0, -0.2));
  EXPECT_THAT(message(false, with("{ kind = 'pull', value = [1], error = [0] }")), HasSubstr("kind needs one of push"));
  EXPECT_THAT(message(false, with("{ kind = 'push', value = [1], error = [0] }")), HasSubstr("a list of 3"));
  EXPECT_THAT(message(false, with("{ kind = 'push_to_walls', value = [1], error = [-1], scale = 1 }")),
              HasSubstr("error needs a list of 1 in [0, 10]"));
  EXPECT_THAT(message(false, with("{ kind = 'push_to_walls', value = [1], error = [0] }")), HasSubstr("scale needs"));
  EXPECT_THAT(message(false, with("{ kind = 'push', value = [0, 0, 0], error = [0, 0, 0], size = 1 }")),
              HasSubstr("unknown key 'size'"));
  EXPECT_THAT(message(false, with("7")), HasSubstr("needs tables"));
}

TEST(LoadModel, TakesWholeNumbersToo) {
  const TemporaryFile file(replaced(shipped("quad-5in.model.toml"), "kappa = 3.0", "kappa = 3"));
  EXPECT_EQ(load_model(file.path).value().bound.kappa, 3);
}

TEST(LoadModel, RefusesAQuotedKeyThatLooksLikeAPath) {
  EXPECT_THAT(message(false, std::string("\"wall.k2\" = 1.0\n") + shipped("quad-5in.model.toml")),
              HasSubstr("unknown"));
}

}  // namespace
}  // namespace backwash::config
