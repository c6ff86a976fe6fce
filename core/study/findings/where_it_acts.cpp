// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/where_it_acts.hpp"

#include <cmath>
#include <numeric>

#include "core/study/inference/estimate.hpp"

namespace backwash::study {
namespace {

/// Observations with the cause put back.
Observations with(const Accepted& cause, const Observations& rest) {
  Observations seen = rest;
  for (std::size_t k = 0; k < cause.columns.size(); ++k)
    for (const auto& [channel, x, aside] : cause.columns[k].parts)
      for (std::size_t i = 0; i < x.size(); ++i) seen.y[channel][i] += cause.theta[static_cast<Eigen::Index>(k)] * x[i];
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

NamedCause named(const InSomeFlights& cause, const Evidence& rest) {
  NamedCause told{.found = cause.found, .gain = {}, .separate_by = {}, .flights = cause.flights};
  told.applied.refused = "it acts in some flights only: mend it, or study those flights by themselves";
  const auto before = with(cause.found, rest.seen());
  measure_errors(told.gain, cause.found, before, rest.seen());
  told.gain.coverage_before = coverage(before);
  told.gain.coverage_after = coverage(rest.seen());
  NormalEquations normal = rest.normal(cause.found.columns, {});
  if (!normal.solvable) return told;  // one flight alone shows it
  for (std::size_t f = 0; f < normal.b.size(); ++f) normal.b[f] += normal.A[f] * cause.found.theta;
  const auto nats = normal.gain_per_flight();
  const double n = static_cast<double>(nats.size()), sum = std::accumulate(nats.begin(), nats.end(), 0.0);
  double square = 0;
  for (const double g : nats) square += std::pow(g - sum / n, 2);
  const double error = student_975(n - 1) * std::sqrt(square * n / (n - 1));
  told.gain.held_out_nats = sum;
  told.gain.low_nats = sum - error;
  told.gain.high_nats = sum + error;
  return told;
}

std::string where(const NamedCause& cause) {
  if (cause.flights.empty()) return "";
  std::string text;
  for (const auto& e : cause.found.parameters)
    if (e.name == "rotor") text = "rotor " + std::to_string(static_cast<int>(e.value)) + ", ";
  text += cause.flights.size() == 1 ? "flight " : "flights ";
  for (std::size_t k = 0; k < cause.flights.size();) {
    std::size_t last = k;
    while (last + 1 < cause.flights.size() && cause.flights[last + 1].flight == cause.flights[last].flight + 1) ++last;
    text += (k == 0 ? "" : ", ") + std::to_string(cause.flights[k].flight + 1);
    if (last > k) text += (last > k + 1 ? "-" : ", ") + std::to_string(cause.flights[last].flight + 1);
    k = last + 1;
  }
  for (const auto& f : cause.flights) {
    const std::string in = " s in flight " + std::to_string(f.flight + 1);
    if (f.since_s) text += ", since " + std::to_string(std::lround(*f.since_s)) + in;
    if (f.until_s) text += ", until " + std::to_string(std::lround(*f.until_s)) + in;
  }
  return text;
}

}  // namespace backwash::study
