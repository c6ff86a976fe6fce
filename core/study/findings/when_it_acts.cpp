// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/when_it_acts.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/study/inference/estimate.hpp"

namespace backwash::study {
namespace {

/// Observations with the cause put back.
Observations with(const Accepted& cause, const Observations& rest) {
  Observations seen = rest;
  each_value(cause.columns, cause.theta, [&](Channel c, std::size_t i, double x) { seen.y[c][i] += x; });
  return seen;
}

void measure_errors(Gain& gain, const Accepted& cause, const Observations& before, const Observations& after) {
  double square_before = 0, square_after = 0, weight = 0;
  for (const auto& [channel, x, aside] : cause.columns.front().parts)
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double w = x[i] != 0 ? before.weight[channel][i] : 0;
      square_before += w * std::pow(before.y[channel][i], 2);
      square_after += w * std::pow(after.y[channel][i], 2);
      weight += w;
    }
  if (weight > 0) {
    gain.rmse_before = std::sqrt(square_before / weight);
    gain.rmse_after = std::sqrt(square_after / weight);
  }
}

}  // namespace

NamedCause named(const Change& cause, const Evidence& rest) {
  NamedCause told{.found = cause.found, .gain = {}, .separate_by = {}, .flights = cause.flights};
  told.when = when(cause.when, cause.flights, rest.seen().flights);
  told.applied.refused = "it does not act in all flights alike: mend it, or study those flights by themselves";
  const auto before = with(cause.found, rest.seen());
  measure_errors(told.gain, cause.found, before, rest.seen());
  told.gain.coverage_before = coverage(before);
  told.gain.coverage_after = coverage(rest.seen());
  NormalEquations normal = rest.normal(cause.found.columns, {});
  if (!normal.solvable) return told;  // one flight alone shows it
  for (std::size_t f = 0; f < normal.b.size(); ++f) normal.b[f] += normal.A[f] * cause.found.theta;
  const auto nats = normal.gain_per_flight();
  told.gain.held_out_nats = std::accumulate(nats.begin(), nats.end(), 0.0);
  std::tie(told.gain.low_nats, told.gain.high_nats) = interval_of_sum(nats);
  return told;
}

std::string when(When when, const std::vector<ActingFlight>& acting, std::size_t flights) {
  if (when == When::growing) return "growing from flight to flight";
  if (acting.empty()) return "";
  const auto seconds = [](double s) { return std::to_string(std::lround(s)) + " s"; };
  const auto number = [&](std::size_t k) { return std::to_string(acting[k].flight + 1); };
  if (when == When::moment) return "since " + seconds(acting.front().since_s.value_or(0)) + " of each flight";
  const std::size_t first = acting.front().flight, n = acting.size();
  const bool together = acting.back().flight + 1 == first + n;
  std::string text = n == 1 ? "flight " : "flights ";
  if (together && n > 1 && first > 0 && first + n == flights) {
    text = "from flight " + number(0) + " on";
  } else if (together && n > 1 && first == 0 && n < flights) {
    text = "up to flight " + number(n - 1);
  } else {
    for (std::size_t k = 0; k < n;) {
      std::size_t last = k;
      while (last + 1 < n && acting[last + 1].flight == acting[last].flight + 1) ++last;
      text += (k == 0 ? "" : ", ") + number(k);
      if (last > k) text += (last > k + 1 ? "-" : ", ") + number(last);
      k = last + 1;
    }
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (acting[k].since_s) text += ", since " + seconds(*acting[k].since_s) + " in flight " + number(k);
    if (acting[k].until_s) text += ", until " + seconds(*acting[k].until_s) + " in flight " + number(k);
  }
  return text;
}

std::vector<NotMeasured> not_measured(const Observations& seen) {
  std::vector<NotMeasured> gaps;
  for (const auto& [channel, what] : {std::pair(kMotor1, "the rotors' commands"), {kRpm1, "rpm over command"}}) {
    NotMeasured gap{what, {}};
    for (std::size_t f = 0; f < seen.flights && seen.measured(channel); ++f) {
      const auto& weight = seen.weight[channel];
      const auto begin = weight.begin() + static_cast<std::ptrdiff_t>(seen.first[f]),
                 end = weight.begin() + static_cast<std::ptrdiff_t>(seen.first[f + 1]);
      if (begin != end && std::all_of(begin, end, [](double w) { return !(w > 0); })) gap.flights.push_back(f);
    }
    if (!gap.flights.empty()) gaps.push_back(std::move(gap));
  }
  return gaps;
}

std::string to_text(const NotMeasured& gap, std::size_t flights) {
  std::vector<ActingFlight> without;
  for (const std::size_t f : gap.flights) without.push_back({f});
  return gap.what + ", not measured in all flights; without: " + when(When::any, without, flights);
}

std::string where(const NamedCause& cause) {
  if (cause.flights.empty()) return "";
  for (const auto& e : cause.found.parameters)
    if (e.name == "rotor") return "rotor " + std::to_string(static_cast<int>(e.value)) + ", " + cause.when;
  return cause.when;
}

}  // namespace backwash::study
