// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/config/config.hpp"
#include "core/config/daemon_config.hpp"
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

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kKp = "kp = { horizontal = 10.0, vertical = 12.0 }   # 1/s²\n";
constexpr const char* kKd = "kd = { horizontal = 5.5, vertical = 6.0 }     # 1/s\n";

TEST(LoadVehicle, MultipliesPx4CascadedGains) {
  // docs/model.md section 4: k_p = P_pos·P_vel, k_d = P_vel; PX4's defaults 0.95, 1.8, 1.0, 4.0 where a key is absent.
  std::string text = replaced(shipped("quad-5in.vehicle.toml"), kKp, "px4 = { MPC_XY_P = 1.5, MPC_Z_VEL_P_ACC = 5 }\n");
  const TemporaryFile file(replaced(text, kKd, ""));
  const auto v = load_vehicle(file.path);
  ASSERT_TRUE(v) << v.error().message;
  EXPECT_DOUBLE_EQ(v->controller.kp.horizontal, 1.5 * 1.8);
  EXPECT_DOUBLE_EQ(v->controller.kd.horizontal, 1.8);
  EXPECT_DOUBLE_EQ(v->controller.kp.vertical, 1.0 * 5);
  EXPECT_DOUBLE_EQ(v->controller.kd.vertical, 5);
}

TEST(LoadVehicle, WantsEitherGainsOrPx4) {
  const std::string text = shipped("quad-5in.vehicle.toml");
  const std::string right = "needs either both kp and kd, or px4 and neither of them";
  EXPECT_THAT(message(true, replaced(text, kKp, "px4 = {}\n")), HasSubstr(right));
  EXPECT_THAT(message(true, replaced(text, kKd, "")), HasSubstr("key 'controller.kd' = (missing): " + right));
  EXPECT_THAT(message(true, replaced(replaced(text, kKd, ""), kKp, "")), HasSubstr(right));
  EXPECT_THAT(message(true, replaced(text, kKp, std::string(kKp) + "px4 = {}\n")), HasSubstr(right));
}

TEST(LoadVehicle, RefusesAnUnstableLoop) {
  // Without delay s²(lag s + 1) + kd s + kp is stable iff kd > kp·lag (Routh): for kp 12, kd 6 the limit is lag 0.5 s,
  // for the horizontal 10, 5.5 it is 0.55 s.
  const std::string text = shipped("quad-5in.vehicle.toml"), lag = "attitude_lag = 0.05";
  EXPECT_EQ(message(true, replaced(text, lag, "attitude_lag = 0.499")), "");
  EXPECT_THAT(message(true, replaced(text, lag, "attitude_lag = 0.501")), HasSubstr("unstable"));
  // Double integrator with delay d: |L| = 1 at ω² = (kd² + √(kd⁴ + 4kp²))/2, limit d = atan(kd ω/kp)/ω = 0.2007 s for
  // (12, 6) and 0.2194 s for (10, 5.5).
  const std::string no_lag = replaced(text, lag, "attitude_lag = 0.0"), delay = "feedback_delay = 0.0 ";
  EXPECT_EQ(message(true, replaced(no_lag, delay, "feedback_delay = 0.200 ")), "");
  EXPECT_THAT(message(true, replaced(no_lag, delay, "feedback_delay = 0.201 ")), HasSubstr("unstable"));
}

TEST(LoadVehicle, ReadsTheVelocitysIntegratorAndHasNoneWithoutTheKey) {
  const std::string text = shipped("quad-5in.vehicle.toml"),
                    with = "velocity_integrator = { horizontal = 0.4, vertical = 2 }\n";
  const auto integrator = [](const std::string& content) {
    const TemporaryFile file(content);
    const auto v = load_vehicle(file.path);
    EXPECT_TRUE(v) << v.error().message;
    return v ? v->controller.velocity_integrator : Vehicle::HorizontalVertical{-1, -1};
  };
  EXPECT_EQ(integrator(text).horizontal, 0);
  EXPECT_EQ(integrator(text).vertical, 0);
  EXPECT_EQ(integrator(replaced(text, kKp, with + kKp)).horizontal, 0.4);
  EXPECT_EQ(integrator(replaced(text, kKp, with + kKp)).vertical, 2);
  const auto px4 = [&](const char* gains) { return replaced(replaced(text, kKd, ""), kKp, gains); };
  EXPECT_EQ(integrator(px4("px4 = {}\n")).horizontal, 0);
  EXPECT_EQ(integrator(px4("px4 = { MPC_XY_VEL_I_ACC = 0.4, MPC_Z_VEL_I_ACC = 2 }\n")).vertical, 2);
  EXPECT_THAT(message(true, px4(("px4 = {}\n" + with).c_str())), HasSubstr("px4 has MPC_XY_VEL_I_ACC"));
  EXPECT_THAT(message(true, px4("px4 = { MPC_XY_VEL_I_ACC = 0.4 }\n")),
              HasSubstr("needs both horizontal and vertical"));
  EXPECT_THAT(message(true, replaced(text, kKp, std::string(kKp) + "velocity_integrator = { horizontal = 0.4 }\n")),
              HasSubstr("velocity_integrator.vertical"));
}

TEST(LoadVehicle, RefusesAnIntegratorThatMakesTheLoopUnstable) {
  // Without lag and delay s³ + kd s² + (kp + ki) s + ki kp/kd is stable iff kd² (kp + ki) > ki kp (Routh). With kp 20
  // and kd 2 that is ki < 5.
  const auto file = [&](const char* ki) {
    std::string text = replaced(shipped("quad-5in.vehicle.toml"), "attitude_lag = 0.05", "attitude_lag = 0.0");
    text = replaced(text, kKp,
                    std::string("velocity_integrator = { horizontal = ") + ki +
                        ", vertical = 1 }\nkp = { horizontal = 20.0, vertical = 12.0 }\n");
    return replaced(text, kKd, "kd = { horizontal = 2.0, vertical = 6.0 }\n");
  };
  EXPECT_EQ(message(true, file("4.99")), "");
  EXPECT_THAT(message(true, file("5.01")), HasSubstr("unstable"));
}

TEST(LoadVehicle, RefusesThrustBelowWeight) {
  EXPECT_THAT(message(true, replaced(shipped("quad-5in.vehicle.toml"), "max_thrust = 18.0", "max_thrust = 8.8")),
              HasSubstr("key 'propulsion.max_thrust' = 8.8: needs more than the vehicle's weight"));
}

TEST(LoadVehicle, RefusesAMissingOrEmptyName) {
  const std::string text = shipped("quad-5in.vehicle.toml");
  EXPECT_THAT(message(true, replaced(text, "name = \"quad-5in\"", "")), HasSubstr("key 'name' = (missing)"));
  EXPECT_THAT(message(true, replaced(text, "\"quad-5in\"", "\"\"")), HasSubstr("key 'name' = "));
  EXPECT_THAT(message(true, replaced(text, "\"quad-5in\"", "5")), HasSubstr("key 'name' = 5: needs a string"));
}

TEST(LoadVehicle, TellsWhatCannotBeFound) {
  for (const char* path : {"builtin:quad-6in", "/nonexistent/v.toml", "/tmp"}) {
    const auto v = load_vehicle(path);
    ASSERT_FALSE(v);
    EXPECT_EQ(v.error().kind, ConfigError::Kind::not_found);
    EXPECT_THAT(v.error().message, StartsWith(std::string(path) + ": "));
  }
  EXPECT_THAT(load_vehicle("builtin:quad-6in").error().message, HasSubstr("builtin:quad-5in builtin:quad-7in"));
}

// Where the ranges of single keys end, from both sides.

std::string shipped(const std::string& name) {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR "/core/config/files/") + name);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Loads the shipped file with the number behind `key = ` replaced; the error, "" if it is taken.
template <typename Load>
std::string error_with(const Load& load, const std::string& file, const std::string& key, const std::string& value) {
  std::string text = shipped(file);
  const std::size_t at = text.find("\n" + key + " = ");
  EXPECT_NE(at, std::string::npos) << key;
  const std::size_t from = at + key.size() + 4;
  const std::size_t to = std::min(text.find('#', from), text.find('\n', from));
  text.replace(from, to - from, value + " ");
  const std::string path = testing::TempDir() + "backwash_limits_test_" + std::to_string(getpid()) + ".toml";
  std::ofstream(path) << text;
  const auto read = load(path);
  std::filesystem::remove(path);
  return read ? std::string() : read.error().message;
}

struct Limit {
  const char *key, *taken, *refused;
};

TEST(Limits, OfTheDaemonsFileEndWhereTheyAreSaidTo) {
  for (const Limit& l : {Limit{"system", "1", "0"},
                         {"system", "250", "251"},
                         {"priority", "0", "-1"},
                         {"priority", "98", "99"},
                         {"cpu", "-1", "-2"},
                         {"cpu", "1023", "1024"},
                         {"domain", "0", "-1"},
                         {"domain", "230", "231"},
                         {"battery_land", "0", "-0.01"},
                         {"battery_land", "1", "1.01"},
                         {"max_mib", "1", "0.9"},
                         {"max_mib", "65536", "65537"},
                         {"closing_speed", "0", "-0.1"},
                         {"closing_speed", "5", "5.1"},
                         {"sensor_range", "0.5", "0.4"},
                         {"sensor_range", "100", "101"},
                         {"baud", "9600", "9599"}}) {
    EXPECT_EQ(error_with(load_daemon, "backwashd.daemon.toml", l.key, l.taken), "") << l.key;
    EXPECT_NE(error_with(load_daemon, "backwashd.daemon.toml", l.key, l.refused).find("needs a number in"),
              std::string::npos)
        << l.key << " = " << l.refused;
  }
}

TEST(Limits, OfTheVehiclesFileEndWhereTheyAreSaidTo) {
  for (const Limit& l : {Limit{"v_max", "20", "20.1"},
                         {"a_max", "30", "30.1"},
                         {"radius", "5", "5.1"},
                         {"diagonal_radius", "5", "5.1"},
                         {"latency", "0.3", "0.31"},
                         {"thr_mdl_fac", "1", "1.01"},
                         {"velocity", "5", "5.1"},
                         // Lengths, masses and limits are above zero; delays and errors may be zero.
                         {"radius", "0.001", "0"},
                         {"mass", "0.001", "0"},
                         {"v_max", "0.001", "0"},
                         {"a_max", "0.001", "0"},
                         {"latency", "0", "-0.001"},
                         {"velocity", "0", "-0.001"}}) {
    EXPECT_EQ(error_with(load_vehicle, "quad-5in.vehicle.toml", l.key, l.taken), "") << l.key;
    EXPECT_NE(error_with(load_vehicle, "quad-5in.vehicle.toml", l.key, l.refused).find("needs a number in"),
              std::string::npos)
        << l.key << " = " << l.refused;
  }
}

// Each axis has a loop of its own: kd > kp·lag without delay (Routh), with a lag of 0.05 s.
TEST(Limits, OfStabilityHoldForEachAxis) {
  const auto error = [](const char* kd) { return error_with(load_vehicle, "quad-5in.vehicle.toml", "kd", kd); };
  EXPECT_EQ(error("{ horizontal = 0.501, vertical = 0.601 }"), "");
  EXPECT_NE(error("{ horizontal = 0.499, vertical = 6.0 }").find("unstable"), std::string::npos);
  EXPECT_NE(error("{ horizontal = 5.5, vertical = 0.599 }").find("unstable"), std::string::npos);
}

TEST(Limits, OfAnEffectEndWhereTheyAreSaidTo) {
  const auto error = [](const std::string& effect) {
    const std::string path = testing::TempDir() + "backwash_limits_test_" + std::to_string(getpid()) + ".toml";
    std::ofstream(path) << shipped("quad-5in.model.toml")
                        << "\n[[extension.term]]\ncause = 'wall'\neffect = [{ kind = " << effect << " }]\n";
    const auto read = load_model(path);
    std::filesystem::remove(path);
    return read ? std::string() : read.error().message;
  };
  EXPECT_EQ(error("'push_to_walls', value = [-10], error = [10], scale = 10"), "");
  EXPECT_EQ(error("'push_to_walls', value = [10], error = [0], scale = 0.01"), "");
  for (const char* wrong : {"'push_to_walls', value = [10.1], error = [0], scale = 1",
                            "'push_to_walls', value = [-10.1], error = [0], scale = 1",
                            "'push_to_walls', value = [1], error = [10.1], scale = 1",
                            "'push_to_walls', value = [1, 1], error = [0], scale = 1",
                            "'push_to_walls', value = [1], error = [0, 0], scale = 1",
                            "'push_to_walls', value = [1], error = [0], scale = 10.1",
                            "'push_to_walls', value = [1], error = [0], scale = 0.009"})
    EXPECT_NE(error(wrong).find("needs a"), std::string::npos) << wrong;
}

TEST(DaemonFile, BelievesADeclaredMapper) {
  for (const bool live : {true, false}) {
    std::string text = shipped("backwashd.daemon.toml");
    text.replace(text.find("live = false"), 12, live ? "live = true" : "live = false");
    const std::string path = testing::TempDir() + "backwash_limits_test_" + std::to_string(getpid()) + ".toml";
    std::ofstream(path) << text;
    const auto read = load_daemon(path);
    std::filesystem::remove(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->map.live, live);
  }
}

}  // namespace
}  // namespace backwash::config
