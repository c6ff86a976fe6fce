// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/null_size.hpp"

#include <cmath>

#include "core/study/inference/levels/dependence.hpp"
#include "tests/study_worlds/observe.hpp"

namespace study_worlds {

namespace study = backwash::study;

namespace {

constexpr int kDraws = 4, kFlips = 400;

std::vector<double> per_dwell(const study::Windows& windows, std::mt19937_64& rng) {
  std::map<std::pair<std::size_t, std::optional<int>>, double> drawn;
  std::vector<double> x;
  for (const auto& w : windows) {
    const auto [at, fresh] = drawn.try_emplace({w.flight, w.segment}, 0);
    if (fresh) at->second = std::normal_distribution()(rng);
    x.push_back(at->second);
  }
  return x;
}

std::vector<double> per_flight(const study::Windows& windows, std::mt19937_64& rng) {
  std::map<std::size_t, double> drawn;
  std::vector<double> x;
  for (const auto& w : windows) {
    const auto [at, fresh] = drawn.try_emplace(w.flight, 0);
    if (fresh) at->second = std::normal_distribution()(rng);
    x.push_back(at->second);
  }
  return x;
}

std::vector<double> course_of_time(const study::Windows& windows, std::mt19937_64& rng) {
  std::uniform_real_distribution turn(0.0, 2 * M_PI);
  const double a = turn(rng), b = turn(rng), c = turn(rng);
  std::vector<double> x;
  for (const auto& w : windows) x.push_back(std::sin(w.t / 25 + a) + std::sin(w.t / 12 + b) + std::sin(w.t / 7 + c));
  return x;
}

/// Share of flipped gains at least as large as the true one.
double p_value(const study::NormalEquations& normal, const std::vector<std::vector<int>>& draws) {
  const double gain = normal.gain();
  int above = 0;
  for (const auto& signs : draws) above += normal.gain(signs) >= gain ? 1 : 0;
  return (1.0 + above) / (1.0 + static_cast<double>(draws.size()));
}

}  // namespace

NullSize null_size(std::uint64_t seed, int flights, const std::filesystem::path& folder) {
  const auto seen = observe(draw_world({seed, {}, 1, flights, ""}), folder);
  const study::Evidence evidence(seen);
  const auto draws = study::sign_draws(seen.units.size(), kFlips, static_cast<unsigned>(seed));
  std::mt19937_64 rng(seed + 4242);
  NullSize sizes;
  const auto test = [&](const std::string& name, const char* kind, const std::vector<study::Channel>& channels,
                        const std::vector<double>& x) {
    study::DesignColumn column;
    for (const auto c : channels) column.parts.push_back({c, x});
    std::vector<study::DesignColumn> free = study::offsets({column}, seen);
    if (free.empty())
      for (const auto c : channels) free.push_back({{{c, std::vector<double>(seen.windows.size(), 1.0)}}});
    const auto normal = evidence.normal({column}, free);
    if (!normal.solvable) return;
    const double p = p_value(normal, draws);
    sizes[{name, kind}].first.count(p <= 0.05);
    sizes[{name, kind}].second.count(p <= 0.03);
  };
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto dwell = per_dwell(seen.windows, rng), course = course_of_time(seen.windows, rng),
               flight = per_flight(seen.windows, rng);
    for (std::size_t c = 0; c < study::kChannels; ++c) {
      const auto channel = static_cast<study::Channel>(c);
      if (!seen.measured(channel)) continue;
      std::string family = study::channel_name(channel);
      if (const auto digit = family.find_last_of("1234"); digit + 1 == family.size()) family.pop_back();
      test(family, "dwell", {channel}, dwell);
      test(family, "time", {channel}, course);
      test(family, "flight", {channel}, flight);
    }
    const std::vector<study::Channel> variances = {study::kVarX, study::kVarY, study::kVarZ};
    test("ln variance, all axes", "dwell", variances, dwell);
    test("ln variance, all axes", "time", variances, course);
    test("ln variance, all axes", "flight", variances, flight);
  }
  // Family-wise: the smallest p, corrected, of all pairs of what remains.
  const auto remaining = study::remaining_dependence(evidence, {}, static_cast<unsigned>(seed));
  const double least = remaining.empty() ? 1 : remaining.front().p_holm;
  auto& left = sizes[{"what remains (HSIC, Holm)", "all"}];
  left.first.count(least <= 0.05);
  left.second.count(least <= 0.03);
  return sizes;
}

void add(NullSize& sum, const NullSize& one) {
  for (const auto& [key, rates] : one) {
    auto& [five, three] = sum[key];
    five.add(rates.first);
    three.add(rates.second);
  }
}

std::string markdown(const NullSize& sizes) {
  std::string page = "| channel | regressor | rejected at 0.05 | at 0.03 |\n| --- | --- | --- | --- |\n";
  char line[160];
  for (const auto& [key, rates] : sizes) {
    const auto& [five, three] = rates;
    std::snprintf(line, sizeof line, "| %s | %s | %.3f (%.3f–%.3f) | %.3f (%.3f–%.3f) |\n", key.first.c_str(),
                  key.second.c_str(), static_cast<double>(five.hits) / five.n, five.low(), five.high(),
                  static_cast<double>(three.hits) / three.n, three.low(), three.high());
    page += line;
  }
  return page;
}

}  // namespace study_worlds
