// SPDX-License-Identifier: BSD-3-Clause
// Motor shares against sound flights of the same vehicle: made ones, and CrazyPAD's recordings. Each recorded condition
// is judged with thresholds from undamaged flights alone; no condition takes part in setting anything.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <random>

#include "core/study/discrepancy/rotor_reference.hpp"
#include "core/study/import_crazypad.hpp"

namespace {

using namespace backwash;
using namespace backwash::study;
using namespace backwash::study::discrepancy;
using Kind = RotorVerdict::Kind;

/// Contrasts of four ln commands, by their definition.
RotorContrasts contrasts(const std::array<double, 4>& s) {
  return {(s[0] - s[1] + s[2] - s[3]) / 4, (s[2] - s[0]) / 2, (s[3] - s[1]) / 2};
}

std::vector<RotorContrasts> flights(int count, std::array<double, 4> extra, std::mt19937& rng) {
  std::normal_distribution<double> scatter(0, 0.015);
  std::vector<RotorContrasts> all;
  for (int i = 0; i < count; ++i) {
    std::array<double, 4> s = {0.1, -0.15, 0.12, -0.07};  // as this vehicle is built
    for (std::size_t r = 0; r < 4; ++r) s[r] += extra[r] + scatter(rng);
    all.push_back(contrasts(s));
  }
  return all;
}

TEST(RotorsAgainstReference, NameADamagedPropellerButNoWeightAndNoSoundVehicle) {
  std::mt19937 rng(11);
  std::map<Kind, int> damaged, weighted, sound;
  int right_rotor = 0;
  constexpr int kTrials = 200;
  for (int k = 0; k < kTrials; ++k) {
    const auto reference = flights(8, {}, rng);
    const auto rotor = static_cast<std::size_t>(k % 4);
    std::array<double, 4> damage{};
    damage[rotor] = std::log(1.25);  // a propeller that gives a fifth less
    const auto found = judge_rotors(reference, flights(3, damage, rng));
    ++damaged[found->kind], right_rotor += found->rotor == rotor + 1;
    const double m = 0.12;  // a weight beside an arm: its side needs more, the far side less
    std::array<double, 4> weight{};
    weight[rotor] = m, weight[(rotor + 2) % 4] = -m;
    ++weighted[judge_rotors(reference, flights(3, weight, rng))->kind];
    ++sound[judge_rotors(reference, flights(3, {}, rng))->kind];
  }
  EXPECT_GE(damaged[Kind::propeller_damage], 0.9 * kTrials);
  EXPECT_GE(right_rotor, 0.98 * kTrials);
  EXPECT_LE(weighted[Kind::propeller_damage], 0.03 * kTrials);
  EXPECT_GE(weighted[Kind::payload] + weighted[Kind::cannot_tell], 0.9 * kTrials);
  EXPECT_GE(sound[Kind::as_sound], 0.9 * kTrials);
  EXPECT_LE(sound[Kind::propeller_damage], 0.03 * kTrials);
}

TEST(RotorsAgainstReference, NeedFourSoundFlights) {
  std::mt19937 rng(1);
  EXPECT_FALSE(judge_rotors(flights(3, {}, rng), flights(3, {}, rng)));
  EXPECT_FALSE(judge_rotors(flights(8, {}, rng), {}));
}

/// Contrasts of every recording, by condition (the part of the file's name before "__").
std::map<std::string, std::vector<RotorContrasts>> recorded(const std::string& folder) {
  std::map<std::string, std::vector<RotorContrasts>> all;
  Vehicle vehicle;  // Crazyflie: thrust about as the square of the command's PWM share
  vehicle.body.mass = 0.03;
  vehicle.propulsion = {0.6, 1};
  vehicle.controller.kp = vehicle.controller.kd = {1, 1};
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    if (file.path().extension() != ".csv") continue;
    const auto log = import_crazypad(file.path());
    Observer observer(vehicle, Model{}, nullptr);
    observer.add(*log);
    const std::string name = file.path().stem().string();
    for (const auto& c : rotor_contrasts(observer.finish())) all[name.substr(0, name.find("__"))].push_back(c);
  }
  return all;
}

TEST(CrazyPad, CutsOfARotorAreNamedWhereTheyPassSoundFlightsAndNoWeightIsCalledDamage) {
  const std::string folder = std::string(BACKWASH_SHARED_DATA) + "/crazypad";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no " << folder;
  const auto by_condition = recorded(folder);
  const auto& sound = by_condition.at("normal");
  ASSERT_GE(sound.size(), 7u);
  for (const auto& [name, group] : by_condition) {
    if (name == "normal") continue;
    const auto v = judge_rotors(sound, group);
    ASSERT_TRUE(v) << name;
    std::printf("%-26s %-16s rotor %zu d %.2f [%.2f, %.2f]  t yaw %.1f 1-3 %.1f 2-4 %.1f damage %.1f of %.1f\n",
                name.c_str(), to_string(v->kind), v->rotor, v->d, v->low, v->high, v->t_yaw, v->t_a, v->t_b, v->t_d,
                v->needed);
    const bool large =
        name == "cut_m3_2.0mm_both_blades" || name == "cut_m3_3.0mm" || name == "cut_m3_4.0mm_both_blades";
    if (large) {
      EXPECT_EQ(v->kind, Kind::propeller_damage) << name;
      EXPECT_EQ(v->rotor, 3u) << name;
    }
    if (name.starts_with("weight")) {
      EXPECT_NE(v->kind, Kind::propeller_damage) << name;
    }
  }
  // Each undamaged flight against the others.
  for (std::size_t i = 0; i < sound.size(); ++i) {
    auto others = sound;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_NE(judge_rotors(others, {sound[i]})->kind, Kind::propeller_damage) << "flight " << i;
  }
}

}  // namespace
