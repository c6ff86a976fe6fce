// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/study.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/study/findings/extend.hpp"
#include "core/study/findings/where_it_acts.hpp"
#include "core/study/findings/words.hpp"
#include "core/study/inference/coverage.hpp"
#include "core/study/inference/estimate.hpp"
#include "core/study/inference/rivals.hpp"
#include "core/study/inference/rotors/rotor_rules.hpp"

namespace backwash::study {
namespace {

/// What the cause adds to a channel in each window, its parameters fitted without the window's flight.
std::vector<double> held_out(const Accepted& cause, const NormalEquations& normal, const Observations& seen,
                             Channel channel) {
  std::vector<double> sum(seen.windows.size(), 0);
  for (std::size_t f = 0; f < seen.units.size(); ++f) {
    const SmallVector theta = normal.fit_without(f);
    for (std::size_t k = 0; k < cause.columns.size(); ++k)
      for (const auto& part : cause.columns[k].parts)
        if (part.channel == channel)
          for (std::size_t i = seen.units.first[f]; i < seen.units.first[f + 1]; ++i)
            sum[i] += theta[static_cast<Eigen::Index>(k)] * part.x[i];
  }
  return sum;
}

struct Covered {
  double before = 0, after = 0;
};

/// Share of the windows' samples within the central 90 %, without and with what the cause moves by channel.
Covered covered(const Observations& seen, const std::array<std::vector<double>, kChannels>& moved) {
  double covered_before = 0, covered_after = 0, samples = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t mean = kMeanX + static_cast<std::size_t>(axis), variance = kVarX + static_cast<std::size_t>(axis);
    for (std::size_t i = 0; i < seen.windows.size(); ++i) {
      const auto& w = seen.windows[i];
      if (!(seen.weight[variance][i] > 0)) continue;
      const double m = seen.y[mean][i], x_m = moved[mean].empty() ? 0 : moved[mean][i];
      const double factor = moved[variance].empty() ? 1 : std::exp(moved[variance][i]);
      covered_before += share_of_interval(m, w.measured_variance[axis], w.sigma[axis]);
      covered_after += share_of_interval(m - x_m, w.measured_variance[axis], w.sigma[axis] * factor);
      samples += 1;
    }
  }
  return samples > 0 ? Covered{covered_before / samples, covered_after / samples} : Covered{};
}

/// `total`: of all accepted causes; `own`: of this one. Residuals y − (total − own) before, y − total after.
Gain gain_of(const Evidence& evidence, const std::vector<Accepted>& all, std::size_t which) {
  const Observations& seen = evidence.seen();
  const Accepted& cause = all[which];
  auto nuisance = cause.form->constant ? std::vector<DesignColumn>{} : offsets(cause.columns, seen);
  const auto others = columns_of(all, seen, which);
  nuisance.insert(nuisance.end(), others.begin(), others.end());
  const NormalEquations normal = evidence.normal(cause.columns, nuisance);
  Gain gain;
  if (!normal.solvable) return gain;
  const auto per_flight = normal.gain_per_flight();
  const double n = static_cast<double>(per_flight.size());
  double square = 0;
  for (const double g : per_flight) gain.held_out_nats += g;
  for (const double g : per_flight) square += std::pow(g - gain.held_out_nats / n, 2);
  const double error = student_975(n - 1) * std::sqrt(square * n / (n - 1));
  gain.low_nats = gain.held_out_nats - error;
  gain.high_nats = gain.held_out_nats + error;

  double before = 0, after = 0, count = 0;
  std::array<std::vector<double>, kChannels> moved;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const auto x = held_out(cause, normal, seen, static_cast<Channel>(c));
    if (std::none_of(x.begin(), x.end(), [](double v) { return v != 0; })) continue;
    // Offsets that stand beside the cause (offsets()) and that it does not claim are taken out of both.
    double offset_before = 0, offset_after = 0, weight = 0;
    for (std::size_t i = 0; i < x.size() && !cause.form->constant && c <= kVarZ; ++i) {
      const double w = seen.weight[c][i];
      offset_before += w * seen.y[c][i];
      offset_after += w * (seen.y[c][i] - x[i]);
      weight += w;
    }
    if (weight > 0) {
      offset_before /= weight;
      offset_after /= weight;
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double w = seen.weight[c][i];
      before += w * std::pow(seen.y[c][i] - offset_before, 2);
      after += w * std::pow(seen.y[c][i] - offset_after - x[i], 2);
      count += w;
    }
    moved[c] = x;
  }
  if (count > 0) {
    gain.rmse_before = std::sqrt(before / count);
    gain.rmse_after = std::sqrt(after / count);
  }
  const Covered shares = covered(seen, moved);
  gain.coverage_before = shares.before;
  gain.coverage_after = shares.after;
  return gain;
}

/// Flights with windows.
std::size_t flown(const Observations& seen) {
  std::size_t count = 0;
  for (std::size_t f = 0; f < seen.units.size(); ++f) count += seen.units.first[f + 1] > seen.units.first[f] ? 1u : 0u;
  return count;
}

/// Effects and why they are not tested. `unjudged`: by how much the rotors differ without being judged, ln.
std::vector<std::pair<std::string, std::string>> untested(const Observations& seen, std::optional<double> unjudged) {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Effect& effect : effects()) {
    std::string why;
    bool tested = false;
    for (const Form& form : effect.forms) {
      const auto reason = why_not_tested(form, seen);
      if (!reason) tested = true;
      if (reason && why.empty()) why = *reason;
    }
    if (!tested) all.emplace_back(effect.name, why);
  }
  for (const Effect& effect : effects())
    if (unjudged && (effect.at_rotors == AtRotors::propeller || effect.at_rotors == AtRotors::sensor))
      all.emplace_back(effect.name,
                       "the same in all flights and no more than craft are built with: the rotors differ by " +
                           percent(*unjudged) + ", as those of a sound craft may; give --reference flights");
  return all;
}

/// Where nothing else was found, a dependence is looked for at its share of the verdict's level.
std::vector<Dependence> what_remains(const Evidence& evidence, const std::vector<Accepted>& accepted, bool silent,
                                     const CauseSearchOptions& options) {
  options.progress("whether what remains depends on something");
  const double level = silent ? kRules.dependence_share * options.accept_p : kRules.dependence_level.value;
  return remaining_dependence(evidence, columns_of(accepted, evidence.seen()), options.seed, level);
}

/// Where nothing else was found, a dependence is a structure without a name. Beside an accepted cause, or one that the
/// model holds, it is a hint: with enough flights the error of the cause's form is found as well.
std::vector<UnknownStructure> with_dependence(std::vector<UnknownStructure> unknown,
                                              const std::vector<Dependence>& remaining, bool silent) {
  if (!silent || remaining.empty() || !remaining.front().found) return unknown;
  const Dependence& first = remaining.front();
  unknown.push_back({first.regressor, first.group, first.p_holm / kRules.dependence_share, {}, "any", {}});
  return unknown;
}

/// Gain, worth as applied and hover shift of what acts in all flights.
std::vector<NamedCause> in_all_flights(const Evidence& evidence, const std::vector<Accepted>& accepted) {
  std::vector<NamedCause> causes;
  std::vector<std::string> unwritable(accepted.size());
  auto applied = judge(evidence, accepted, unwritable);
  for (std::size_t i = 0; i < accepted.size(); ++i) {
    const NamedCause cause{accepted[i], {}, {}, applied[i]};
    if (!applied[i].refused.empty()) continue;
    if (const auto why = why_unwritable(cause, evidence.seen())) unwritable[i] = "no model file holds it: " + *why;
  }
  if (std::ranges::any_of(unwritable, [](auto& why) { return !why.empty(); }))
    applied = judge(evidence, accepted, unwritable);
  for (std::size_t i = 0; i < accepted.size(); ++i) {
    NamedCause cause{accepted[i],
                     gain_of(evidence, accepted, i),
                     {},
                     applied[i],
                     extrapolated(accepted[i], evidence.seen()),
                     largest_flown(accepted[i], evidence.seen()),
                     check_shift(accepted[i], applied[i].beside, evidence.seen())};
    if (cause.found.form->anchor) cause.found.scale.anchor = cause.found.form->anchor(evidence.seen().windows);
    causes.push_back(std::move(cause));
  }
  return causes;
}

/// What a cause may be as well, and what would tell.
struct Doubt {
  const Form* form;
  std::string what;
};

/// A rotor that lost a share of its thrust costs a quarter of it in all. Where the rotors differ as such a one would,
/// unjudged, a payload is not told from it.
std::optional<Doubt> doubted_payload(const NamedCause& cause, double unjudged) {
  const Accepted& found = cause.found;
  if (found.form->effect->at_rotors != AtRotors::weight || found.form->motors_alone || !cause.flights.empty() ||
      found.parameters.empty())
    return std::nullopt;
  const double lost = found.parameters.front().value;
  if (lost <= 0 || unjudged < kRotorRules.unjudged_loss * lost) return std::nullopt;
  const auto propeller = std::ranges::find_if(
      catalogue(), [](auto* form) { return form->effect->at_rotors == AtRotors::propeller && !form->motors_alone; });
  return Doubt{*propeller, "none: give --reference flights of the craft while its rotors were sound"};
}

/// How much more thrust was commanded per unit of x, within flights, m/s².
double asked_along(const std::vector<double>& x, const Observations& seen) {
  double product = 0, square = 0;
  for (std::size_t f = 0; f + 1 < seen.first.size(); ++f) {
    const double n = static_cast<double>(seen.first[f + 1] - seen.first[f]);
    double mean = 0;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i) mean += x[i] / n;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i) {
      product += (x[i] - mean) * seen.windows[i].thrust_acc;
      square += (x[i] - mean) * (x[i] - mean);
    }
  }
  return square > 0 ? product / square : 0;
}

/// A drift of the sensor asks for no more thrust, a battery that sags for as much as the drift. Without a logged
/// voltage the one is told as the other: where more than half of it was commanded both stand.
std::optional<Doubt> doubted_drift(const NamedCause& cause, const Observations& seen) {
  const Accepted& found = cause.found;
  if (seen.has(Source::battery) || !seen.has(Source::thrust) || !found.form->in_sensor || found.columns.size() <= kZ)
    return std::nullopt;
  const double z = found.theta[kZ], asked = asked_along(found.columns[kZ].parts.back().x, seen);
  if (-asked * z < z * z / 2) return std::nullopt;
  const auto sag =
      std::ranges::find_if(catalogue(), [](auto* f) { return std::ranges::count(f->needs, Source::battery) > 0; });
  return Doubt{*sag, "none: log the battery's voltage (battery_v)"};
}

/// All that was found, with what it is told apart by. `unjudged`: as of untested().
std::vector<NamedCause> causes_of(const WholeSearch& whole, const Evidence& evidence, const Observations& seen,
                                  std::optional<double> unjudged, const std::optional<SoundRotors>& sound) {
  std::vector<NamedCause> causes = in_all_flights(evidence, whole.found.accepted);
  for (const auto& cause : whole.some) causes.push_back(named(cause, evidence));
  const double between_craft = sound ? sound->spread : kRotorRules.rotor_spread.value;
  for (auto& cause : causes) {
    const bool some = !cause.flights.empty();  // against the craft's own other flights
    const double spread = some ? kRules.motor_scatter.value : between_craft;
    cause.found = tell_shares(name_by_balance(std::move(cause.found), whole.rest, some, spread));
    for (const Rival& rival : cause.found.rivals)
      cause.separate_by.push_back(separations(evidence, cause.found, rival).front());
    const auto payload = unjudged ? doubted_payload(cause, *unjudged) : std::nullopt;
    for (const auto& doubt : {payload, doubted_drift(cause, seen)}) {
      if (!doubt) continue;
      cause.found.rivals.push_back({doubt->form->cause(), doubt->form, doubt->form->scales.front(), 0});
      cause.separate_by.push_back({doubt->form->cause(), doubt->what, std::nullopt});
    }
  }
  return causes;
}

StudyVerdict verdict_of(const std::vector<NamedCause>& causes, const std::vector<UnknownStructure>& unknown) {
  if (causes.empty()) return unknown.empty() ? StudyVerdict::nothing_found : StudyVerdict::unknown_structure;
  const bool clear = std::ranges::all_of(causes, [](const auto& cause) { return cause.found.rivals.empty(); });
  return clear ? StudyVerdict::cause_found : StudyVerdict::cannot_distinguish;
}

}  // namespace

double coverage(const Observations& seen) { return covered(seen, {}).before; }

const char* to_string(StudyVerdict verdict) {
  static const char* const kNames[] = {"cause_found", "cannot_distinguish", "unknown_structure", "nothing_found",
                                       "insufficient"};
  return kNames[static_cast<std::size_t>(verdict)];
}

StudyResult study(const Observations& seen, const StudyOptions& options) {
  if (flown(seen) < options.fewest_flights)
    return {.verdict = StudyVerdict::insufficient, .not_tested = untested(seen, std::nullopt)};
  SettledRotors settled = settle_rotors(options.sound, seen);
  const WholeSearch whole = search_all(std::move(settled.seen), options.search);
  const CauseSearchResult& found = whole.found;
  Evidence evidence(whole.rest);
  evidence.whiten(columns_of(found.accepted, whole.rest));
  const auto causes = causes_of(whole, evidence, seen, settled.unjudged, options.sound);
  const bool silent = causes.empty() && found.unknown.empty() && options.search.known.empty();
  const auto remaining =
      options.dependence ? what_remains(evidence, found.accepted, silent, options.search) : std::vector<Dependence>{};
  const auto unknown = with_dependence(found.unknown, remaining, silent);
  const double threshold = std::max(found.threshold, kRules.least_threshold.value);
  if (options.minimum_detectable) options.search.progress("smallest effects that these flights would show");
  return {.verdict = verdict_of(causes, unknown),
          .causes = causes,
          .unknown = unknown,
          .refused = found.refused,
          .not_tested = untested(seen, settled.unjudged),
          .minimum_detectable = options.minimum_detectable ? minimum_detectable(evidence, options.search, threshold)
                                                           : decltype(StudyResult::minimum_detectable){},
          .smallest_looked_for = options.minimum_detectable,
          .threshold = found.threshold,
          .remaining = remaining};
}

std::map<std::string, std::map<std::string, double>> minimum_detectable(const Evidence& evidence,
                                                                        const CauseSearchOptions& options,
                                                                        double threshold) {
  constexpr int kFlips = static_cast<int>(kRules.power_flips);
  const auto draws = sign_draws(evidence.seen().units.size(), kFlips, options.seed + 1);
  std::map<std::string, std::map<std::string, double>> least;
  each_named(evidence, {}, [&](SearchCandidate&& c) {
    if (least.contains(c.name) && !least[c.name].contains(c.form->parameters[0])) return;
    NormalEquations injected = c.normal;
    const auto power = [&](double size) {
      int found = 0;
      for (const auto& signs : draws) {
        for (std::size_t f = 0; f < injected.b.size(); ++f)
          injected.b[f] = signs[f] * c.normal.b[f] + size * c.normal.A[f].col(0);
        const SmallVector fit = injected.fit();
        if (injected.gain() - c.prior_nats(fit) >= threshold && c.effect(fit)) ++found;
      }
      return static_cast<double>(found) / kFlips;
    };
    double low = kRules.power_low, high = kRules.power_high;  // ln of the parameter
    if (power(std::exp(high)) < kRules.power) return;
    for (int i = 0; i < kRules.power_halvings; ++i) {
      const double middle = (low + high) / 2;
      (power(std::exp(middle)) >= kRules.power ? high : low) = middle;
    }
    auto& entry = least[c.name];
    const double size = std::exp(high);
    const auto [at, fresh] = entry.emplace(c.form->parameters[0], size);
    if (!fresh) at->second = std::min(at->second, size);
  });
  return least;
}

}  // namespace backwash::study
