// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/words.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/study/findings/extend.hpp"
#include "core/study/findings/page_sections.hpp"
#include "core/study/findings/when_it_acts.hpp"
#include "core/study/inference/rules.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study {

Remedy remedy_of(const NamedCause& cause, const Vehicle& vehicle) {
  auto remedy = cause.found.form->effect->remedy(fitted_form(cause), vehicle);
  if (cause.flights.empty() || remedy.in == RemedyIn::craft) return remedy;
  return {RemedyIn::craft, {}, "Look for what was different: " + where(cause) + "."};  // no file holds for some flights
}

namespace {

std::string sure(double nats) {
  return nats >= kRules.sure_nats ? "surely" : nats >= kRules.probable_nats ? "probably" : "perhaps";
}

/// The fitted value of a form's first parameter that its words tell as `told`, by Newton's method from `near`.
double fitted(const Form& form, double told, double near) {
  const double step = std::sqrt(std::numeric_limits<double>::epsilon());
  for (int k = 0; k < 6; ++k) {
    const double here = form.in_words(0, near);
    near += step * (told - here) / (form.in_words(0, near + step) - here);
  }
  return near;
}

/// Of the first number of a cause's remedy, or of its first parameter.
std::string interval_of(const NamedCause& cause, const Vehicle& vehicle) {
  if (cause.found.parameters.empty()) return "";
  const auto& first = cause.found.parameters.front();
  double low = first.low, high = first.high;
  std::string of = " (" + spoken(first.name) + ")";
  if (const auto set = remedy_of(cause, vehicle).set; !set.empty()) {
    NamedCause at = cause;
    const auto end = [&](double told) {
      at.found.theta[0] = fitted(*cause.found.form, told, cause.found.theta[0]);
      return remedy_of(at, vehicle).set.front().to;
    };
    std::tie(low, high) = std::minmax({end(first.low), end(first.high)});
    of = "";
  }
  const bool apart = number(low) != number(high);
  return ", " + (apart ? number(low) + " to " + number(high) : formatted("%.5g to %.5g", low, high)) + of + " at 95 %";
}

}  // namespace

std::string advice(const StudyResult& result, const Observations& seen, const Vehicle& vehicle) {
  switch (result.verdict) {
    case StudyVerdict::unknown_structure:
      return "Look for what changes with " + result.unknown.front().along +
             ": the simulation is wrong along it, and no known cause fits.";
    case StudyVerdict::insufficient:
      return "Fly more: " + too_few(seen);
    case StudyVerdict::nothing_found:
      return "Nothing to change: nothing was found that the simulation gets wrong.";
    default:
      break;
  }
  std::string text;
  for (const auto& cause : result.causes) {
    std::string names = spoken(cause.found.form->cause());
    for (const auto& rival : cause.found.rivals) names += " from " + spoken(rival.name);
    text += text.empty() ? "" : " ";
    if (!cause.separate_by.empty() && !cause.found.rivals.empty())
      text += "Fly next: " + cause.separate_by.front().manoeuvre + ". These flights cannot tell " + names + ".";
    else
      text += remedy_of(cause, vehicle).words + " That is " + sure(cause.gain.held_out_nats) + " so" +
              interval_of(cause, vehicle) + ".";
  }
  return text;
}

std::string to_try(const StudyResult& result, const Vehicle& vehicle) {
  std::string text;
  for (const auto& cause : result.causes) {
    if (!cause.found.rivals.empty()) continue;
    for (const auto& [key, from, to] : remedy_of(cause, vehicle).set)
      text += (text.empty() ? "" : " ") + key + "=" + number(to);
  }
  return text;
}

Accepted in_words(Accepted cause) {
  for (std::size_t k = 0; k < cause.form->parameters.size() && k < cause.parameters.size(); ++k)
    for (double* x : {&cause.parameters[k].value, &cause.parameters[k].low, &cause.parameters[k].high})
      *x = cause.form->in_words(k, *x);
  return cause;
}

std::string percent(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

std::string odds(double nats) {
  const double ratio = std::exp(std::abs(nats));
  const std::string told = ratio > kRules.most_odds ? "more than a million" : number(ratio);
  return nats < 0 ? "1 to " + told : told + " to 1";
}

double largest_flown(const Accepted& cause, const Observations& seen) {
  const Channel channel = cause.columns.front().parts.front().channel;
  std::vector<double> sum(seen.windows.size(), 0);
  each_value(cause.columns, cause.theta, [&](Channel c, std::size_t i, double x) { sum[i] += c == channel ? x : 0; });
  double largest = 0;
  for (const double x : sum) largest = std::max(largest, std::abs(x));
  return largest;
}

std::string extrapolated(const Accepted& cause, const Observations& seen) {
  const auto& reference = cause.form->reference;
  if (!reference) return "";
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (const auto& w : seen.windows) {
    const double flown = reference->flown(w);
    if (std::isfinite(flown)) {
      least = std::min(least, flown);
      most = std::max(most, flown);
    }
  }
  const double at = reference->value;
  if (at * kRules.beyond_flown >= least && at <= most * kRules.beyond_flown) return "";
  return "stated at " + number(at) + " " + reference->unit + ", flown " + number(least) + " to " + number(most) +
         "; the most that was flown is " + number(largest_flown(cause, seen));
}

std::string refusal(const Refused& r) {
  return spoken(r.name) + " would have to be " + number(r.value) + " (" + r.parameter + "), its law has " +
         number(r.least) + " to " + number(r.most) + ": " + r.reason;
}

std::string steady_words(const SteadyAnswer& answer, std::size_t axes) {
  const auto& s = answer.axes[axes];
  if (!s.matters()) return "";
  const std::string loop = !s.told()    ? "cannot be told whether the loop holds it off"
                           : s.rate > 0 ? "the loop holds it off at " + number(s.rate) + " 1/s"
                                        : "the loop keeps it";
  return std::string(axes == 0 ? "level" : "up") + ": " + number(s.left) + " [" + number(s.low) + ", " +
         number(s.high) + "] of a steady push's shift is left; " + loop;
}

std::string beforehand(const Accepted& cause) {
  double most = 0;
  for (std::size_t k = 0; k < cause.form->priors.size(); ++k)
    most = std::max(most, std::abs(cause.theta[static_cast<Eigen::Index>(k)]) / cause.form->priors[k].typical);
  return number(most) + " times what is typical: " + odds(-prior_nats_of(cause)) + " beforehand";
}

std::optional<double> clearance_cost(const Consequence& c) {
  if (!c.before.flown || !c.after.flown) return std::nullopt;
  return c.before.flown->min_clearance_m - c.after.flown->min_clearance_m;
}

namespace {

std::string cost_of(const FlightOutcome& b, const FlightOutcome& a) {
  const auto &before = b.hover, &after = a.hover;
  std::string text = !before && !after ? "no hover set is bounded, before or after"
                     : !before         ? "no hover set was bounded before"
                                       : "no hover set is bounded any more";
  if (before && after)
    text = "hover sets reach " +
           number(100 * (after->extent_95 - before->extent_95 + after->shift_95 - before->shift_95)) +
           " cm farther (95 % of the flown places)";
  if (b.flown && a.flown) {
    const double cost = b.flown->min_clearance_m - a.flown->min_clearance_m;
    return text + "; the plan between two of them has " + number(100 * std::abs(cost)) +
           (cost < 0 ? " cm more clearance." : " cm less clearance.");
  }
  if (b.flown && a.plan)
    return text + "; the plan between two of them is none any more: " + plan::to_string(*a.plan) + ".";
  return text + ".";
}

}  // namespace

std::string cost_sentence(const Consequence& c) { return "With the extended model " + cost_of(c.before, c.after); }

std::string correction_sentence(const Consequence& c) {
  return c.corrected ? "With the corrected vehicle file " + cost_of(c.before, *c.corrected) : "";
}

}  // namespace backwash::study
