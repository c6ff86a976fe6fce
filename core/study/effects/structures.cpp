// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/structures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/effect_rules.hpp"

namespace backwash::study {
namespace {

using std::numbers::pi;
using Take = std::function<void(Structure&&)>;

constexpr int kFew = static_cast<int>(kEffectRules.few_cosines), kMany = 2 * kFew;
constexpr int kTurns = static_cast<int>(kEffectRules.angle_turns);
constexpr double kHighest = kEffectRules.tone_highest;

std::vector<double> cosine(double k, std::vector<double> u) {
  for (double& q : u) q = std::cos(k * q);
  return u;
}

std::vector<double> sine(double k, std::vector<double> u) {
  for (double& q : u) q = std::sin(k * q);
  return u;
}

std::vector<double> product(std::vector<double> a, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] *= b[i];
  return a;
}

Functions turn(int k, const std::vector<double>& angle) { return {cosine(k, angle), sine(k, angle)}; }

void add_rank(const Take& take, const Regressor& along, const std::vector<double>& q) {
  Structure few{along.name, std::to_string(kFew) + " cosines", {}, {}};
  for (int k = 1; k <= kFew; ++k) few.functions.push_back(cosine(pi * k, q));
  Structure many = few;
  many.shape = std::to_string(kMany) + " cosines";
  for (int k = kFew + 1; k <= kMany; ++k) many.functions.push_back(cosine(pi * k, q));
  take(std::move(few));
  take(std::move(many));
}

void add_turns(const Take& take, const Regressor& along, const std::vector<double>& angle) {
  Structure both{along.name, "turns 1 and 2", {}, turn(1, angle)};
  for (auto& x : turn(2, angle)) both.functions.push_back(std::move(x));
  take(std::move(both));
  for (int k = 1; k <= kTurns; ++k) {
    Structure one{along.name, "turn " + std::to_string(k), {}, turn(k, angle)};
    // The others in the order of their number.
    one.further = [k, angle](int n) {
      const int other = n < k ? n : n + 1;
      return other <= kTurns ? turn(other, angle) : Functions{};
    };
    take(std::move(one));
  }
}

void add_products(const Take& take, const std::vector<std::string>& names, const std::vector<Functions>& bases) {
  for (std::size_t a = 0; a < bases.size(); ++a)
    for (std::size_t b = a + 1; b < bases.size(); ++b) {
      Structure pair{names[a] + ", " + names[b], "products", {}, bases[a]};
      for (const auto& y : bases[b]) pair.functions.push_back(y);
      for (const auto& x : bases[a])
        for (const auto& y : bases[b]) pair.functions.push_back(product(x, y));
      take(std::move(pair));
    }
}

/// When each window was flown and how long it is, s.
using Moments = std::vector<std::pair<double, double>>;

Functions tone(double hz, const Moments& windows) {
  Functions both(2);
  for (const auto& [t, duration] : windows) {
    // Its mean over the window is weaker than its value in the middle.
    const double half = pi * hz * duration, kept = half > 0 ? std::sin(half) / half : 1;
    both[0].push_back(kept * std::cos(2 * pi * hz * t));
    both[1].push_back(kept * std::sin(2 * pi * hz * t));
  }
  return both;
}

void add_tones(const Take& take, const Windows& windows) {
  const auto moments = std::make_shared<Moments>();
  double longest = 0;
  for (const auto& w : windows) {
    moments->emplace_back(w.t, w.duration);
    longest = std::max(longest, w.t + w.duration / 2);
  }
  for (int k = 0; k < kEffectRules.most_tones && longest > 0; ++k) {
    const double hz = (kEffectRules.tone_lowest + kEffectRules.tone_step * k) / longest;
    if (hz > kHighest) break;
    char shape[32];
    std::snprintf(shape, sizeof shape, "%.4f Hz", hz);
    take({"t_s", shape, hz, tone(hz, *moments),
          [moments, hz](int n) { return (n + 1) * hz <= kHighest ? tone((n + 1) * hz, *moments) : Functions{}; }});
  }
}

}  // namespace

void each_structure(const Observations& seen, const std::function<void(Structure&&)>& take) {
  std::vector<std::string> names;
  std::vector<Functions> bases;
  for (const auto& along : regressors(seen)) {
    const auto u = ranks(along, seen.windows);
    if (along.circular)
      add_turns(take, along, u);
    else
      add_rank(take, along, u);
    names.push_back(along.name);
    bases.push_back(along.circular ? turn(1, u) : Functions{cosine(pi, u), cosine(2 * pi, u)});
  }
  add_products(take, names, bases);
  add_tones(take, seen.windows);
}

std::vector<DesignColumn> columns_in(const std::vector<Channel>& group, const Functions& functions) {
  std::vector<DesignColumn> columns;
  for (const auto& x : functions) {
    if (group.front() == kVarX) {
      columns.emplace_back();
      for (const Channel c : group) columns.back().parts.push_back({c, x});
    } else {
      for (const Channel c : group) columns.push_back({{{c, x}}});
    }
  }
  return columns;
}

}  // namespace backwash::study
