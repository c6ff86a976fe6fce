// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/levels/levels_of_flights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "core/types/quantile.hpp"

namespace backwash::study {
namespace {

constexpr auto kSide = static_cast<std::size_t>(kRules.side_windows.value);
constexpr auto kLags = static_cast<std::size_t>(kRules.likeness_lags.value);

/// Variance of a flight's mean over that of independent windows: the median flight's, so that a step is not likeness.
double typical_inflation(const Asked& asked) {
  std::vector<double> all;
  for (std::size_t u = 0; u < asked.amplitudes->units(); ++u)
    all.push_back(inflation(asked.amplitudes->course(u, asked.direction), kLags));
  return quantile(std::move(all), 0.5);
}

/// Amplitude of every flight that tells it, and the mean square of its error by the windows' noise.
struct Values {
  std::vector<double> of;
  double error2 = 0;
};
Values values_of(const Asked& asked) {
  const Amplitudes& a = *asked.amplitudes;
  Values values;
  for (std::size_t u = 0; u < a.units(); ++u) {
    if (!a.told(u)) continue;
    values.of.push_back(asked.direction.dot(a.theta(a.begin(u), a.end(u))));
    values.error2 += asked.direction.dot(a.information(a.begin(u), a.end(u)).ldlt().solve(asked.direction));
  }
  if (!values.of.empty()) values.error2 /= static_cast<double>(values.of.size());
  return values;
}

/// Where each unit lies high.
std::vector<Segment> segments_of(const Finding& finding, const Observations& seen) {
  const Amplitudes& a = *finding.asked.amplitudes;
  const bool single = seen.units.size() == seen.flights;
  std::vector<Segment> all;
  for (std::size_t u = 0; u < a.units(); ++u) {
    AmplitudeCourse course = a.course(u, finding.asked.direction);
    for (double& w : course.weight) w /= finding.inflation;
    const std::size_t n = course.value.size();
    const Acting at = acting(course, finding.low, finding.high, finding.spread * finding.spread, kRules.step_price,
                             single ? kSide : n);
    for (const auto& [begin, end, high] :
         {std::tuple(std::size_t{0}, at.begin, false), {at.begin, at.end, true}, {at.end, n, false}}) {
      const double weight = level(course, begin, end).weight;
      if (weight > 0)
        all.push_back(
            {u, a.begin(u) + begin, a.begin(u) + end, high, 1 / (finding.spread * finding.spread + 1 / weight)});
    }
  }
  return all;
}

}  // namespace

std::vector<SmallVector> directions(const Amplitudes& a) {
  const auto p = static_cast<Eigen::Index>(a.columns().size());
  std::vector<SmallVector> all;
  for (Eigen::Index k = 0; k < (a.form().one_sided ? 1 : p); ++k) all.push_back(SmallVector::Unit(p, k));
  return all;
}

Finding across(const Asked& asked) {
  Finding finding{asked};
  finding.inflation = typical_inflation(asked);
  const Values values = values_of(asked);
  const auto levels = two_levels(values.of, std::sqrt(values.error2 * finding.inflation));
  if (!levels) return finding;
  std::array<double, 2> sum{}, count{};
  for (std::size_t f = 0; f < values.of.size(); ++f) {
    sum[levels->high[f]] += values.of[f];
    count[levels->high[f]] += 1;
  }
  finding.p = levels->p;
  finding.spread = levels->spread;
  finding.low = sum[0] / count[0];
  finding.high = sum[1] / count[1];
  return finding;
}

Finding within(const Asked& asked) {
  Finding finding{asked};
  const Amplitudes& a = *asked.amplitudes;
  finding.inflation = typical_inflation(asked);
  double steps = 0, most = 0;
  for (std::size_t u = 0; u < a.units(); ++u) {
    const AmplitudeCourse course = a.course(u, asked.direction);
    const auto step = largest_step(course, kSide);
    if (course.value.size() >= 2 * kSide) steps += static_cast<double>(course.value.size() - 2 * kSide + 1);
    if (!step || step->t <= most) continue;
    most = step->t;
    const double before = level(course, 0, step->at).value;
    finding.low = std::min(before, before + step->size);
    finding.high = std::max(before, before + step->size);
  }
  std::vector<double> off = values_of(asked).of;
  if (!(most > 0) || off.empty()) return finding;
  const double median = quantile(off, 0.5);
  for (double& x : off) x = std::abs(x - median);
  finding.spread = quantile(std::move(off), 0.5);
  finding.p = std::min(1.0, steps * std::erfc(most / std::sqrt(2 * finding.inflation)));
  return finding;
}

std::optional<Difference> difference(const Amplitudes& a, const std::vector<Segment>& segments) {
  const auto p = static_cast<Eigen::Index>(a.columns().size());
  std::array<SmallVector, 2> mean{SmallVector(SmallVector::Zero(p)), SmallVector(SmallVector::Zero(p))};
  std::array<double, 2> weight{}, square{};
  double count = 0;
  for (const auto& s : segments) {
    if (!a.told(s.unit)) continue;
    mean[s.acting] += s.weight * a.theta(s.begin, s.end);
    count += 1;
    weight[s.acting] += s.weight;
    square[s.acting] += s.weight * s.weight;
  }
  if (!(weight[0] > 0 && weight[1] > 0 && count > 2)) return std::nullopt;
  for (const std::size_t k : {0u, 1u}) mean[k] /= weight[k];
  SmallVector scatter = SmallVector::Zero(p);
  for (const auto& s : segments)
    if (a.told(s.unit)) scatter += s.weight * (a.theta(s.begin, s.end) - mean[s.acting]).cwiseAbs2();
  const double shares = square[0] / (weight[0] * weight[0]) + square[1] / (weight[1] * weight[1]);
  scatter *= count / (count - 2) / (weight[0] + weight[1]) * shares;
  return Difference{mean[0], mean[1], scatter.cwiseSqrt(), count - 2};
}

double price(const std::vector<Segment>& segments) {
  std::map<std::size_t, bool> flights;  // by their last segment
  for (const auto& s : segments) flights[s.unit] = s.acting;
  double turns = 0;
  for (auto f = flights.begin(); f != flights.end() && std::next(f) != flights.end(); ++f)
    turns += f->second != std::next(f)->second ? 1 : 0;
  const double n = static_cast<double>(flights.size()), steps = static_cast<double>(segments.size()) - n;
  const double ways = turns <= 1 ? std::log(n) : turns <= 2 ? std::log(n * n / 2) : n * std::log(2);
  return ways + kRules.step_price * steps;
}

double gain(const Amplitudes& a, const std::vector<Segment>& segments, const SmallVector& difference) {
  std::array<SmallMatrix, 2> information{SmallMatrix(a.information(0, 0)), SmallMatrix(a.information(0, 0))};
  for (const auto& s : segments) information[s.acting] += a.information(s.begin, s.end);
  const SmallMatrix both = information[0] + information[1];
  const SmallVector moved = information[1] * both.ldlt().solve(information[0] * difference);
  return 0.5 * difference.dot(moved) - kRules.column_price * static_cast<double>(a.columns().size() - 1) -
         price(segments);
}

namespace {

/// Whether a whole flight lies on the level that is not called acting.
bool sound_flight(const std::vector<Segment>& segments) {
  std::map<std::size_t, bool> sound;
  for (const auto& s : segments) sound.emplace(s.unit, true).first->second &= !s.acting;
  return std::any_of(sound.begin(), sound.end(), [](auto& flight) { return flight.second; });
}

}  // namespace

bool sound_is_odd(const Located& l) {
  const Amplitudes& a = *l.finding.asked.amplitudes;
  if (a.form().one_sided) return false;
  const Channel c = a.columns().front().parts.front().channel;
  const double built = c >= kMotor1 && c <= kRpm4 ? kRules.sound_spread.value : a.form().floor + a.form().least;
  const double low = l.difference.sound.norm(), high = l.difference.acting.norm();
  double acting = 1, sound = 1;
  for (const auto& s : l.segments) (s.acting ? acting : sound) += 1;
  return (low * low - high * high) / (2 * built * built) + std::log(acting / sound) +
             (l.segments.front().acting ? 1 : -1) * kRules.sound_first >
         0;
}

std::optional<Located> located(Finding finding, const Observations& seen) {
  const Amplitudes& a = *finding.asked.amplitudes;
  for (const bool last : {false, true}) {
    auto segments = segments_of(finding, seen);
    auto d = difference(a, segments);
    if (!d) return std::nullopt;
    if (last && !a.effect(d->value())) return std::nullopt;
    if (last && a.form().one_sided && !sound_flight(segments)) return std::nullopt;
    if (last) return Located{finding, std::move(segments), *d};
    if (!a.form().one_sided) finding.asked.direction = d->value().normalized();
    finding.low = finding.asked.direction.dot(d->sound);
    finding.high = finding.asked.direction.dot(d->acting);
    if (!(finding.high > finding.low)) return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace backwash::study
