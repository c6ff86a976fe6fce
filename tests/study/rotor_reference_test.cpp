// SPDX-License-Identifier: BSD-3-Clause
// Motor shares against sound flights of the same vehicle: made ones, and recordings. Each recorded condition is judged
// with thresholds from undamaged flights alone; no condition takes part in setting anything.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <random>

#include "core/log/columns/import_crazypad.hpp"
#include "core/study/inference/rotors/rotor_reference.hpp"
#include "core/study/inference/rotors/rotor_rules.hpp"
#include "core/study/inference/rotors/sound_rotors.hpp"
#include "core/study/windows/observer.hpp"

namespace {

using namespace backwash;
using namespace backwash::study;
using Kind = RotorVerdict::Kind;
using Shares = std::vector<Eigen::Array4d>;

const Eigen::Array4d kNone = Eigen::Array4d::Zero();

/// ln of thrust commands that carry a mass, a share of the craft's, under one arm: its rotor, the one that faces it
/// (two further) and the two beside it.
Eigen::Array4d carrying(double mass, std::size_t rotor) {
  Eigen::Array4d thrust;
  for (std::size_t r = 0; r < 4; ++r)
    thrust[static_cast<Eigen::Index>((rotor + r) % 4)] = 1 + mass * std::array<double, 4>{3, 1, -1, 1}[r];
  return thrust.log();
}

Eigen::Array4d damaged(double need, std::size_t rotor) {
  Eigen::Array4d ln = kNone;
  ln[static_cast<Eigen::Index>(rotor)] = std::log1p(need);
  return ln;
}

/// Flights of sessions that differ by `sessions` of each rotor's share, and within them by a fifth of that.
Shares flights(std::initializer_list<int> sessions, const Eigen::Array4d& extra, std::mt19937& rng,
               double scatter = 0.06) {
  std::normal_distribution<double> normal;
  const Eigen::Array4d built(0.1, -0.15, 0.12, -0.07);
  Shares all;
  for (const int count : sessions) {
    Eigen::Array4d session;
    for (double& x : session) x = scatter * normal(rng);
    for (int i = 0; i < count; ++i) {
      Eigen::Array4d ln = built + session + extra;
      for (double& x : ln) x += 0.2 * scatter * normal(rng);
      all.push_back(ln - ln.mean());
    }
  }
  return all;
}

RotorsTold told(const Shares& sound, const Shares& group) {
  return told_of({mean_of(group) - mean_of(sound)}, scatter_of(sound));
}
bool alone(const RotorsTold& told, RotorState state) { return told.set == std::vector{state}; }

TEST(RotorsAgainstReference, CallASoundCraftDamagedNoMoreOftenThanTheLevelSays) {
  std::mt19937 rng(11);
  for (const double scatter : {0.06, 0.02, 0.1}) {
    int damaged_alone = 0, sound = 0;
    constexpr int kTrials = 300;
    for (int k = 0; k < kTrials; ++k) {
      const auto v = told(flights({1, 1, 1, 1, 1, 1, 1}, kNone, rng, scatter), flights({3}, kNone, rng, scatter));
      damaged_alone += alone(v, RotorState::propeller_damage);
      sound += v.holds(RotorState::sound);
    }
    EXPECT_LE(damaged_alone, kRules.rotor_level * kTrials) << scatter;
    EXPECT_GE(sound, (1 - 3 * kRules.rotor_level) * kTrials) << scatter;
  }
}

/// The rotor, and a need that the references promise.
TEST(RotorsAgainstReference, NameTheSmallestDamageThatTheyPromiseAboutFourTimesInFive) {
  for (const std::size_t rotor : {std::size_t{0}, std::size_t{3}}) {
    std::mt19937 rng(3);
    constexpr int kTrials = 150;
    double promised = 0;  // on average: a single reference's scatter is an estimate
    for (int k = 0; k < kTrials; ++k)
      promised += least_damage(scatter_of(flights({1, 1, 1, 1, 1, 1, 1, 1}, kNone, rng))) / kTrials;
    std::normal_distribution<double> normal;
    int named = 0, third_named = 0;
    for (int k = 0; k < kTrials; ++k) {
      const auto sound = flights({1, 1, 1, 1, 1, 1, 1, 1}, kNone, rng);
      const auto with = [&](double need) {
        // Its torque per thrust has changed too: rotors 1 and 3 answer it against 2 and 4.
        const double twist = kRotorRules.torque_spread * std::log1p(need) / 4 * normal(rng);
        return told(sound, flights({1}, damaged(need, rotor) + twist * Eigen::Array4d(1, -1, 1, -1), rng));
      };
      const auto v = with(promised);
      named += alone(v, RotorState::propeller_damage) && v.rotor == rotor;
      third_named += alone(with(promised / 3), RotorState::propeller_damage);
    }
    EXPECT_GT(named, 0.65 * kTrials) << promised;
    EXPECT_LT(named, 0.95 * kTrials) << promised;
    EXPECT_LT(third_named, 0.5 * kTrials) << promised;
  }
}

/// Windows of flights with these shares.
Observations seen_with(const Shares& shares) {
  constexpr std::size_t kWindows = 20;
  Observations seen;
  seen.flights = shares.size();
  seen.windows.resize(kWindows * shares.size());
  seen.first = {0};
  for (std::size_t f = 0; f < shares.size(); ++f) seen.first.push_back(kWindows * (f + 1));
  for (std::size_t c = 0; c < kChannels; ++c) {
    seen.y[c].assign(seen.windows.size(), 0);
    seen.weight[c].assign(seen.windows.size(), c >= kMotor1 && c <= kMotor4 ? 1 : 0);
  }
  for (std::size_t i = 0; i < seen.windows.size(); ++i)
    for (std::size_t r = 0; r < 4; ++r) seen.y[kMotor1 + r][i] = shares[i / kWindows][static_cast<Eigen::Index>(r)];
  seen.units.first = seen.first;
  return seen;
}

/// Of 12 flights: what those of which `acts` shows.
RotorsTold told_where(Shares shares, const std::function<bool(std::size_t)>& acts, double need) {
  std::vector<double> amount;
  for (std::size_t f = 0; f < shares.size(); ++f) {
    if (acts(f)) shares[f] += damaged(need, 1) - damaged(need, 1).mean();
    amount.insert(amount.end(), 20, acts(f) ? 1.0 : 0.0);
  }
  return *rotors_of(seen_with(shares), amount);
}

/// Where flights scatter little about their level, a propeller that needs 15 % more in some of them is no sound one.
TEST(RotorsOfSomeFlights, AreHeldAgainstWhatTheFlightsThemselvesScatterBy) {
  std::mt19937 rng(17);
  const auto steady = [&] { return flights({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, kNone, rng, 0.002); };
  for (const double need : {0.15, 0.3, 0.6}) {
    for (const auto& acts : {std::function([](std::size_t f) { return f >= 6; }),
                             std::function([](std::size_t f) { return f >= 3 && f < 7; }),
                             std::function([](std::size_t f) { return f % 2 == 1; })}) {
      const auto v = told_where(steady(), acts, need);
      EXPECT_FALSE(v.holds(RotorState::sound)) << need;
      EXPECT_TRUE(v.holds(RotorState::propeller_damage)) << need;
      EXPECT_EQ(v.rotor, 1u) << need;
    }
  }
  int damaged_alone = 0, sound = 0;
  constexpr int kTrials = 200;
  for (int k = 0; k < kTrials; ++k) {  // sessions of two flights
    const auto v = told_where(
        flights({2, 2, 2, 2, 2, 2}, kNone, rng), [](std::size_t f) { return f >= 6; }, 0);
    damaged_alone += alone(v, RotorState::propeller_damage);
    sound += v.holds(RotorState::sound);
  }
  EXPECT_LE(damaged_alone, kRules.rotor_level * kTrials);
  EXPECT_GE(sound, (1 - 3 * kRules.rotor_level) * kTrials);
}

/// However heavy, wherever it hangs, however well the craft is known.
TEST(RotorsAgainstReference, NeverCallAWeightADamagedPropellerAlone) {
  std::mt19937 rng(5);
  for (const double scatter : {0.005, 0.03, 0.06})
    for (const double mass : {0.05, 0.12, 0.2, 0.3})
      for (std::size_t rotor = 0; rotor < 4; ++rotor) {
        int damage = 0, weight = 0, place = 0;
        constexpr int kTrials = 20;
        for (int k = 0; k < kTrials; ++k) {
          const auto v =
              told(flights({1, 1, 1, 1, 1, 1}, kNone, rng, scatter), flights({4}, carrying(mass, rotor), rng, scatter));
          damage += alone(v, RotorState::propeller_damage);
          weight += v.holds(RotorState::payload);
          place += v.heavy == rotor;
        }
        EXPECT_LE(damage, 3) << mass << " at rotor " << rotor << ", " << scatter;
        EXPECT_GE(weight, kTrials - 4) << mass << " at rotor " << rotor << ", " << scatter;
        if (mass > 2 * scatter) {
          EXPECT_GE(place, kTrials - 2) << mass << " at rotor " << rotor << ", " << scatter;
        }
      }
}

TEST(RotorsAgainstReference, TellADamageFromAWeightByTheTwist) {
  const SoundScatter known{{0.01, 0.02, 0.02}, 10};
  const auto damage = told_of({damaged(0.4, 2)}, known), weight = told_of({carrying(0.15, 2)}, known);
  EXPECT_EQ(damage.set, std::vector{RotorState::propeller_damage});
  EXPECT_EQ(damage.rotor, 2u);
  EXPECT_NEAR(damage.each[2].d, 0.4, 0.01);
  EXPECT_EQ(weight.set, std::vector{RotorState::payload});
  EXPECT_EQ(weight.heavy, 2u);
  EXPECT_NEAR(weight.weight, 0.3 / 1.15, 0.01);
  const SoundScatter twisted{{0.2, 0.02, 0.02}, 10};  // a twist that nobody knows
  for (const auto& shares : {damaged(0.4, 2), carrying(0.15, 2)}) {
    const auto told = told_of({shares}, twisted);
    EXPECT_TRUE(told.holds(RotorState::propeller_damage) && told.holds(RotorState::payload) &&
                !told.holds(RotorState::sound));
  }
}

/// Which rotors face each other may be unknown.
TEST(RotorsAgainstReference, HoldTheTruthWhicheverRotorsFaceEachOther) {
  const SoundScatter known{{0.01, 0.014, 0.014}, 10};
  for (const auto& pairing : kPairings) {
    const Contrasts weight(0, 0.3, -0.1);
    const auto told = told_of({shares_of(weight, pairing), kNone, kPairings}, known);
    EXPECT_TRUE(told.holds(RotorState::payload));
    EXPECT_FALSE(told.holds(RotorState::sound));
    EXPECT_NEAR((contrasts_of(shares_of(weight, pairing), pairing) - weight).abs().maxCoeff(), 0, 1e-12);
  }
  const auto damage = told_of({damaged(0.4, 1), kNone, kPairings}, known);
  EXPECT_TRUE(damage.holds(RotorState::propeller_damage));
  EXPECT_EQ(damage.rotor, 1u);
}

TEST(RotorsAgainstReference, OneShakingRotorIsNoSoundOneAndNoWeight) {
  const SoundScatter known{{0.03, 0.04, 0.04}, 6};
  const auto told = told_of({damaged(0.1, 3), Eigen::Array4d(1, 0, 1, 6)}, known);
  EXPECT_EQ(told.set, std::vector{RotorState::propeller_damage});
  EXPECT_EQ(told.rotor, 3u);
}

/// What the sound flights' few sessions cost; nominal is less than 0.05.
TEST(RotorsAgainstReference, CallASoundVehicleDamagedMoreOftenWhereTheReferenceIsOfThreeSessions) {
  std::mt19937 rng(5);
  int damage = 0, other = 0;
  constexpr int kTrials = 500;
  for (int k = 0; k < kTrials; ++k) {
    const auto v = told(flights({3, 2, 2}, kNone, rng), flights({3}, kNone, rng));
    damage += alone(v, RotorState::propeller_damage);
    other += !v.holds(RotorState::sound);
  }
  std::printf("seven flights of three sessions: called damaged %.3f, not as sound %.3f\n", damage / double{kTrials},
              other / double{kTrials});
  EXPECT_LT(damage, 0.1 * kTrials);
  EXPECT_LT(other, 0.35 * kTrials);
}

TEST(RotorsAgainstReference, NeedFourSoundFlights) {
  std::mt19937 rng(1);
  EXPECT_FALSE(judge_rotors(flights({1, 1, 1}, kNone, rng), flights({3}, kNone, rng)));
  EXPECT_FALSE(judge_rotors(flights({1, 1, 1, 1, 1, 1}, kNone, rng), {}));
}

/// A cost in thrust alone may be one rotor's where the shares are as such a one would leave them.
TEST(RotorsAgainstReference, AWeakRotorCostsAQuarterOfItsLossInAll) {
  const double need = 0.3, lost = 1 - 1 / (1 + need / 4);
  EXPECT_TRUE(may_need(damaged(need, 1) - std::log1p(need) / 4, std::log1p(need)));
  EXPECT_FALSE(may_need(kNone, std::log1p(need))) << "of a craft whose rotors are alike";
  RotorLevel level{{damaged(need, 1) - std::log1p(need) / 4}, built_rotors()};
  EXPECT_TRUE(may_be_one_rotor(level, lost));
  EXPECT_FALSE(may_be_one_rotor(level, -lost));
  EXPECT_FALSE(may_be_one_rotor(level, 5 * lost)) << "of another size";
  level.maybe_damaged = false;
  EXPECT_FALSE(may_be_one_rotor(level, lost)) << "reference flights exclude it";
}

/// Shares of every recording, by condition (the part of the file's name before "__").
std::map<std::string, Shares> recorded(const std::string& folder) {
  std::map<std::string, Shares> all;
  Vehicle vehicle;  // Crazyflie: thrust about as the square of the command's PWM share
  vehicle.body.mass = 0.03;
  vehicle.propulsion = {0.6, 1};
  vehicle.controller.kp = vehicle.controller.kd = {1, 1};
  std::vector<std::filesystem::path> files;
  for (const auto& file : std::filesystem::directory_iterator(folder))
    if (file.path().extension() == ".csv") files.push_back(file.path());
  std::ranges::sort(files);
  for (const auto& file : files) {
    const auto log = log::import_crazypad(file);
    Observer observer(vehicle, Model{}, nullptr);
    observer.add(*log);
    const std::string name = file.stem().string();
    for (const auto& c : rotor_shares(observer.finish())) all[name.substr(0, name.find("__"))].push_back(c);
  }
  return all;
}

TEST(CrazyPad, CutsOfARotorAreNamedWhereTheyPassSoundFlightsAndNoWeightIsCalledDamage) {
  const std::string folder = std::string(BACKWASH_RECORDINGS).append("/crazypad");
  const auto by_condition = recorded(folder);
  const auto& sound = by_condition.at("normal");
  ASSERT_EQ(sound.size(), 7u);
  for (const auto& [name, group] : by_condition) {
    if (name == "normal") continue;
    const auto v = judge_rotors(sound, group);
    ASSERT_TRUE(v) << name;
    const auto& need = v->told.each[v->told.rotor];
    std::printf("%-26s %-18s rotor %zu d %3.0f %% [%.0f, %.0f], named from %.0f %%  t yaw %.1f 1-3 %.1f 2-4 %.1f\n",
                name.c_str(), to_string(v->kind), v->told.rotor + 1, 100 * need.d, 100 * need.low, 100 * need.high,
                100 * v->minimum, v->t[0], v->t[1], v->t[2]);
    const bool large =
        name == "cut_m3_2.0mm_both_blades" || name == "cut_m3_3.0mm" || name == "cut_m3_4.0mm_both_blades";
    EXPECT_EQ(v->kind == Kind::propeller_damage, large) << name;
    if (large) {
      EXPECT_EQ(v->told.rotor, 2u) << name;
    } else {
      EXPECT_TRUE(v->told.holds(RotorState::propeller_damage) || v->told.holds(RotorState::payload))
          << name << ": what is not told is said";
    }
    if (name.starts_with("weight")) {
      EXPECT_TRUE(v->told.holds(RotorState::payload)) << name;
    }
  }
}

/// Every choice of four and more sound flights as the reference, and of the others as what is judged.
TEST(CrazyPad, NoChoiceOfSoundFlightsIsCalledDamaged) {
  const auto sound = recorded(std::string(BACKWASH_RECORDINGS).append("/crazypad")).at("normal");
  int asked = 0, damage = 0, other = 0;
  std::size_t all = 1;
  for (std::size_t k = 0; k < sound.size(); ++k) all *= 3;
  for (std::size_t code = 0; code < all; ++code) {
    Shares reference, judged;
    std::size_t left = code;
    for (const auto& flight : sound) {
      if (left % 3 == 1) reference.push_back(flight);
      if (left % 3 == 2) judged.push_back(flight);
      left /= 3;
    }
    if (reference.size() < 4 || judged.empty()) continue;
    const auto v = told(reference, judged);
    ++asked;
    damage += alone(v, RotorState::propeller_damage);
    other += !v.holds(RotorState::sound);
  }
  std::printf("%d choices of sound flights: called damaged %d, not as sound %d\n", asked, damage, other);
  EXPECT_EQ(asked, 315);
  EXPECT_EQ(damage, 0);
}

struct FittedLine {
  double offset, slope;
};
FittedLine fitted(const std::vector<std::pair<double, double>>& points) {
  const double n = static_cast<double>(points.size());
  double x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [a, b] : points) {
    x += a / n;
    y += b / n;
  }
  for (const auto& [a, b] : points) {
    xx += (a - x) * (a - x);
    xy += (a - x) * (b - y);
  }
  return {y - xy / xx * x, xy / xx};
}

/// ln command of motor 3 less the mean of the four, over the length cut off it (both blades together), each condition
/// predicted by the line through the others. The figures that come with the data: 0.094 without the length, 0.027 with.
TEST(CrazyPad, ShareOfMotorThreeIsPredictedByTheCutLengthHeldOutByCondition) {
  const std::string folder = std::string(BACKWASH_RECORDINGS).append("/crazypad");
  const std::map<std::string, double> cut_mm = {{"normal", 0},       {"cut_m3_1.0mm", 1},
                                                {"cut_m3_2.0mm", 2}, {"cut_m3_2.0mm_both_blades", 4},
                                                {"cut_m3_3.0mm", 3}, {"cut_m3_4.0mm_both_blades", 8}};
  std::map<std::string, std::vector<double>> share;  // half of ln thrust, which is about the square of the command
  for (const auto& [name, all] : recorded(folder))
    for (const auto& c : all) share[name].push_back(c[2] / 2);
  double without = 0, with = 0, count = 0, length = 0;
  for (const auto& [held_out, mm] : cut_mm) {
    std::vector<std::pair<double, double>> by_cut, by_share;
    double mean = 0;
    for (const auto& [name, other] : cut_mm)
      for (const double s : share.at(name))
        if (name != held_out) {
          by_cut.emplace_back(other, s);
          by_share.emplace_back(s, other);
          mean += s;
        }
    mean /= static_cast<double>(by_cut.size());
    const FittedLine of_share = fitted(by_cut), of_length = fitted(by_share);
    double predicted = 0, own = 0;
    for (const double s : share.at(held_out)) {
      without += std::pow(s - mean, 2);
      with += std::pow(s - of_share.offset - of_share.slope * mm, 2);
      count += 1;
      const double told = of_length.offset + of_length.slope * s;
      length += std::pow(told - mm, 2);
      predicted += told;
      own += 1;
    }
    std::printf("%-26s cut %.0f mm, predicted by the others %.1f mm\n", held_out.c_str(), mm, predicted / own);
  }
  std::printf("share of motor 3, held out: rmse %.3f without the length, %.3f with; length by share %.1f mm\n",
              std::sqrt(without / count), std::sqrt(with / count), std::sqrt(length / count));
  EXPECT_LT(std::sqrt(with / count), 0.04);
  EXPECT_LT(std::sqrt(with / count), 0.4 * std::sqrt(without / count));
  EXPECT_NEAR(std::sqrt(without / count), 0.094, 0.02);
}

}  // namespace

namespace backwash::study {
namespace {

/// Motor commands of flights: rotors as built, flights scattered by 0.01.
Observations flown(std::array<double, 4> built, int flights) {
  Observations seen;
  seen.flights = static_cast<std::size_t>(flights);
  seen.first = {0};
  for (int f = 0; f < flights; ++f) {
    for (int i = 0; i < 5; ++i) {
      seen.windows.emplace_back();
      for (std::size_t c = 0; c < kChannels; ++c) {
        const bool motor = c >= kMotor1 && c <= kMotor4;
        seen.weight[c].push_back(motor ? 1 : 0);
        seen.y[c].push_back(motor ? built[c - kMotor1] + 0.01 * (f % 3 - 1) * (c % 2 ? 1 : -1) : 0);
      }
    }
    seen.first.push_back(seen.windows.size());
  }
  seen.units.first = seen.first;
  return seen;
}

TEST(SoundRotors, AreLearntFromReferenceFlightsAndTakenOut) {
  const std::array<double, 4> built = {0.15, -0.1, -0.1, 0.05};
  const auto sound = sound_rotors(flown(built, 6));
  ASSERT_TRUE(sound);
  EXPECT_NEAR(sound->motor[0], 0.15, 1e-9);
  const auto damaged = settle_rotors(sound, flown({0.15 + 0.6, -0.1 - 0.2, -0.1 - 0.2, 0.05 - 0.2}, 12));
  EXPECT_EQ(damaged.unjudged, 0);
  EXPECT_NEAR(damaged.seen.y[kMotor1][5], 0.6, 1e-9);
  const auto other_session = settle_rotors(sound, flown({0.15 + 0.03, -0.1 - 0.01, -0.1 - 0.01, 0.05 - 0.01}, 12));
  EXPECT_NEAR(other_session.seen.y[kMotor1][5], 0, 1e-9) << "the search must not explain what sessions differ by";
  EXPECT_FALSE(sound_rotors(flown(built, 3))) << "three flights are no reference";
}

TEST(SoundRotors, WithoutAReferenceWhatCraftDifferByIsNotJudgedAndWhatIsMoreStays) {
  const auto settled = settle_rotors(std::nullopt, flown({0.15, -0.1, -0.1, 0.05}, 12));
  EXPECT_NEAR(settled.unjudged, 0.15, 1e-9);
  EXPECT_NEAR(settled.seen.y[kMotor1][5], 0, 1e-9);
  const auto broken = settle_rotors(std::nullopt, flown({1.35, -0.45, -0.45, -0.45}, 12));
  EXPECT_EQ(broken.unjudged, 0);
  EXPECT_NEAR(broken.seen.y[kMotor1][5], 1.35, 1e-9);
}

TEST(SoundRotors, AreThoseOfTheSoundHalfOfTheFlights) {
  auto seen = flown({0.01, -0.01, 0, 0}, 12);
  for (std::size_t i = seen.first[6]; i < seen.windows.size(); ++i) seen.y[kMotor4][i] -= 0.4;
  seen = settle_rotors(std::nullopt, seen).seen;
  EXPECT_NEAR(seen.y[kMotor4][5], 0, 0.03);
  EXPECT_NEAR(seen.y[kMotor4].back(), -0.4, 0.03);
}

}  // namespace
}  // namespace backwash::study
