// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_output.hpp"

#include <cmath>
#include <cstdio>

#include "core/study/before_after/before_after_rules.hpp"
#include "core/study/calibrate/calibration_rules.hpp"
#include "core/study/design/design_rules.hpp"
#include "core/study/findings/page_sections.hpp"
#include "core/study/findings/when_it_acts.hpp"
#include "core/study/findings/words.hpp"

namespace backwash::services {

namespace {

Json to_json(const study::Remedy& remedy) {
  Json set = Json::array();
  for (const auto& [key, from, to] : remedy.set) set.push_back({{"key", key}, {"from", from}, {"to", to}});
  return {{"file", study::to_string(remedy.in)}, {"set", set}, {"words", remedy.words}};
}

/// Flights in which a cause acts, counted from 1, with the names of their logs.
Json to_json(const std::vector<study::ActingFlight>& flights, const std::vector<std::string>& logs) {
  Json all = Json::array();
  for (const auto& f : flights) {
    Json one = {{"flight", f.flight + 1}};
    if (f.flight < logs.size()) one["log"] = logs[f.flight];
    if (f.since_s) one["since_s"] = *f.since_s;
    if (f.until_s) one["until_s"] = *f.until_s;
    all.push_back(one);
  }
  return all;
}

/// Two ends of a range; null: none.
Json ends(double least, double most) {
  const auto end = [](double at) { return std::isfinite(at) ? Json(at) : Json(); };
  return Json::array({end(least), end(most)});
}

Json to_json(const study::NamedCause& cause, const Vehicle& vehicle, const std::vector<std::string>& logs) {
  const auto& found = cause.found;
  Json parameters = Json::object();
  for (const auto& e : found.parameters) parameters[e.name] = {{"value", e.value}, {"ci95", {e.low, e.high}}};
  Json set = Json::array({found.form->cause()});
  for (const auto& rival : found.rivals) set.push_back(rival.name);
  Json separate = Json::array();
  for (const auto& s : cause.separate_by)
    separate.push_back(
        {{"rival", s.rival}, {"manoeuvre", s.manoeuvre}, {"expected_nats", s.expected_nats.value_or(0)}});
  const auto& g = cause.gain;
  Json channels = Json::array();
  for (const auto& c : g.channels)
    channels.push_back({{"channel", study::channel_name(c.channel)},
                        {"before", c.before},
                        {"after", c.after},
                        {"windows", c.windows}});
  Json json = {{"name", found.form->cause()},
               {"set", set},
               {"p", found.p},
               {"form", found.form->formula},
               {"parameters", parameters},
               {"gain",
                {{"held_out_nats", g.held_out_nats},
                 {"ci95_nats", {g.low_nats, g.high_nats}},
                 {"rmse_before", g.rmse_before},
                 {"rmse_after", g.rmse_after},
                 {"variance_coverage_before", g.coverage_before},
                 {"variance_coverage_after", g.coverage_after},
                 {"channels", channels}}},
               {"applied", {{"refused", cause.applied.refused}}},
               {"positions", cause.positions},
               {"extrapolated", cause.extrapolated},
               {"beforehand", {{"nats", -study::prior_nats_of(found)}, {"words", study::beforehand(found)}}},
               {"largest_flown", cause.largest_flown},
               {"odds", study::odds(g.held_out_nats)},
               {"change", to_json(study::remedy_of(cause, vehicle))},
               {"separate_by", separate}};
  if (cause.flights.empty()) return json;
  json["where"] = study::where(cause);
  json["when"] = cause.when;
  json["in_flights"] = to_json(cause.flights, logs);
  return json;
}

Json to_json(const study::SteadyAnswer::Axes& s) {
  return {{"predicted_m", s.predicted}, {"measured_m", s.measured}, {"left", s.left},
          {"ci95", {s.low, s.high}},    {"decay_per_s", s.rate},    {"told", s.matters() && s.told()}};
}

void print_text(const char* of, const study::calibrate::HeightEffect& h) {
  const auto ratio = [](const char* name, const std::optional<study::calibrate::CalibratedValue>& e) {
    if (e) std::printf("  %s: x%.2f [%.2f, %.2f]\n", name, e->value, e->ci95.low, e->ci95.high);
  };
  std::printf("vertical variance, day and speed held fixed, %s: %zu windows, %zu flights, %zu days\n", of, h.windows,
              h.flights, h.days);
  ratio("near the surface against far from it, by the law of height", h.low_over_high);
  ratio("the same by heights within a factor of two", h.bins);
  ratio("under a plate against without", h.ceiling);
}

Json to_json(const study::FlightOutcome& o) {
  Json json = {{"samples_inside_bound", o.inside}, {"hover_half_width_m", nullptr}, {"hover_shift_m", nullptr}};
  if (const auto& h = o.hover) {
    json["hover_half_width_m"] = {{"median", h->extent_median}, {"q95", h->extent_95}};
    json["hover_shift_m"] = {{"median", h->shift_median}, {"q95", h->shift_95}};
  }
  if (o.plan) {
    json["hover_safe_share"] = o.safe.value();
    json["plan"] = {{"status", plan::to_string(*o.plan)}};
    if (const auto& f = o.flown)
      json["plan"].update({{"length_m", f->length_m}, {"time_s", f->time_s}, {"min_clearance_m", f->min_clearance_m}});
  }
  return json;
}

}  // namespace

Json to_json(const study::StudyResult& result, const study::Observations& seen, const Vehicle& vehicle,
             const std::vector<std::string>& logs) {
  Json json = {{"verdict", study::to_string(result.verdict)},
               {"advice", study::advice(result, seen, vehicle)},
               {"try_after", study::to_try(result, vehicle)},
               {"flights", seen.flights},
               {"windows", seen.windows.size()},
               {"gated_out", Json::object()},
               {"causes", Json::array()},
               {"unknown", Json::array()},
               {"not_tested", Json::array()},
               {"not_measured", Json::array()},
               {"remaining_dependence", Json::array()},
               {"minimum_detectable", Json::object()}};
  for (const auto& [gate, count] : seen.gated_out) json["gated_out"][study::to_string(gate)] = count;
  for (const auto& cause : result.causes) json["causes"].push_back(to_json(cause, vehicle, logs));
  json["steady_answer"] = {{"level", to_json(result.steady.axes[0])}, {"up", to_json(result.steady.axes[1])}};
  json["refused"] = Json::array();
  for (const auto& r : result.refused)
    json["refused"].push_back({{"name", r.name},
                               {"form", r.form},
                               {"parameter", r.parameter},
                               {"value", r.value},
                               {"possible", ends(r.least, r.most)},
                               {"why", r.reason}});
  for (const auto& u : result.unknown)
    json["unknown"].push_back({{"along", u.along},
                               {"of", u.group},
                               {"p", u.p},
                               {"held_out_nats", u.gain.value_or(0)},
                               {"shape", u.shape},
                               {"hz", u.hz.value_or(0)}});
  for (const auto& [name, why] : result.not_tested) json["not_tested"].push_back({{"name", name}, {"why", why}});
  for (const auto& [what, flights] : study::not_measured(seen)) {
    Json in = Json::array();
    for (const std::size_t f : flights) in.push_back(f + 1);
    json["not_measured"].push_back({{"what", what}, {"flights", in}});
  }
  for (const auto& d : result.remaining)
    if (d.found)
      json["remaining_dependence"].push_back(
          {{"regressor", d.regressor}, {"group", d.group}, {"hsic", d.hsic}, {"p", d.p}, {"p_holm", d.p_holm}});
  for (const auto& [cause, sizes] : result.minimum_detectable)
    for (const auto& [parameter, size] : sizes) json["minimum_detectable"][cause][parameter] = size;
  json["threshold_nats"] = result.threshold;
  return json;
}

Json to_json(const study::Consequence& c) {
  Json json = {{"places", c.places}, {"before", to_json(c.before)}, {"after", to_json(c.after)}};
  if (c.corrected) {
    json["corrected"] = to_json(*c.corrected);
    json["corrected"].erase("samples_inside_bound");  // not simulated anew
  }
  if (const auto cost = study::clearance_cost(c)) json["clearance_cost_m"] = *cost;
  if (c.before.plan) json.update({{"start", to_json(c.start_W)}, {"goal", to_json(c.goal_W)}});
  return json;
}

Json to_json(const study::RotorVerdict& v) {
  Json set = Json::array();
  for (const auto state : v.told.set) set.push_back(study::to_string(state));
  const auto& need = v.told.each[v.told.rotor];
  return {{"verdict", study::to_string(v.kind)},
          {"set", std::move(set)},
          {"rotor", v.told.rotor + 1},
          {"d", {{"value", need.d}, {"ci95", {need.low, need.high}}}},
          {"weight", {{"rotor", v.told.heavy + 1}, {"share", v.told.weight}}},
          {"minimum_detectable", {{"d", v.minimum}}},
          {"t", {{"yaw", v.t[0]}, {"pair_1_3", v.t[1]}, {"pair_2_4", v.t[2]}}},
          {"nats", {{"damage_over_sound", v.told.lead}, {"chance", v.told.needed}}}};
}

Json to_json(const study::calibrate::HeightEffects& effects) {
  const auto ratio = [](const study::calibrate::CalibratedValue& e) {
    return Json{{"value", e.value}, {"ci95", {e.ci95.low, e.ci95.high}}};
  };
  const auto one = [&](const study::calibrate::HeightEffect& h) {
    Json json = {{"low_m", h.low_m},
                 {"high_m", h.high_m},
                 {"variance_ratio_z", ratio(h.low_over_high)},
                 {"windows", h.windows},
                 {"flights", h.flights},
                 {"low_flights", h.low_flights},
                 {"high_flights", h.high_flights},
                 {"days", h.days},
                 {"sd_ln_variance", {{"within_flights", h.within}, {"between_flights", h.between}}}};
    if (h.bins) json["variance_ratio_z_without_law"] = ratio(*h.bins);
    if (h.ceiling) json["plate_variance_ratio_z"] = ratio(*h.ceiling);
    return json;
  };
  Json json = one(effects.all);
  if (effects.hovers) json["hovers"] = one(*effects.hovers);
  return json;
}

namespace {

void print_text(const study::NamedCause& cause, const Vehicle& vehicle, const std::vector<std::string>& logs) {
  std::printf("%s: %s\n  p %.4f, held-out gain %.1f nats: odds of %s\n", cause.found.form->cause().c_str(),
              cause.found.form->formula.c_str(), cause.found.p, cause.gain.held_out_nats,
              study::odds(cause.gain.held_out_nats).c_str());
  if (!cause.flights.empty()) std::printf("  %s:", study::where(cause).c_str());
  for (const auto& f : cause.flights) std::printf(" %s", f.flight < logs.size() ? logs[f.flight].c_str() : "?");
  if (!cause.flights.empty()) std::printf("\n");
  if (!cause.applied.refused.empty()) std::printf("  does not join the model: %s\n", cause.applied.refused.c_str());
  for (const auto& c : cause.gain.channels)
    std::printf("  %s: error %.4g before, %.4g after\n", study::channel_name(c.channel), c.before, c.after);
  if (!cause.positions.empty()) std::printf("  positions refused: %s\n", cause.positions.c_str());
  for (const auto& e : cause.found.parameters)
    std::printf("  %s %.4g [%.4g, %.4g]\n", e.name.c_str(), e.value, e.low, e.high);
  std::printf("  size: %s\n", study::beforehand(cause.found).c_str());
  if (!cause.extrapolated.empty()) std::printf("  extrapolated: %s\n", cause.extrapolated.c_str());
  std::printf("  what to change: %s\n", study::remedy_of(cause, vehicle).words.c_str());
  for (const auto& s : cause.separate_by) {
    std::printf("  not told from %s; fly: %s", s.rival.c_str(), s.manoeuvre.c_str());
    std::printf(s.expected_nats ? " (%.1f nats expected)\n" : "\n", s.expected_nats.value_or(0));
  }
}

/// Of study, its next flight and calibration.
std::vector<study::Rule> all_rules() {
  auto all = study::rules();
  study::append_rules(all, study::calibrate::kCalibrationRules);
  study::append_rules(all, study::kDesignRules);
  study::append_rules(all, study::kBeforeAfterRules);
  return all;
}

}  // namespace

void print_text(const study::StudyResult& result, const study::Observations& seen, const Vehicle& vehicle,
                const std::vector<std::string>& logs, const std::optional<study::Consequence>& consequence,
                const std::optional<study::RotorVerdict>& rotors,
                const std::optional<study::calibrate::HeightEffects>& height) {
  std::printf("%s\n", study::advice(result, seen, vehicle).c_str());
  if (const auto keys = study::to_try(result, vehicle); !keys.empty())
    std::printf("correct this, and study again: --after %s\n", keys.c_str());
  std::printf("%s: %zu flights, %zu windows\n", study::to_string(result.verdict), seen.flights, seen.windows.size());
  for (const auto& cause : result.causes) print_text(cause, vehicle, logs);
  for (std::size_t k = 0; k < result.steady.axes.size(); ++k)
    if (const auto text = study::steady_words(result.steady, k); !text.empty()) std::printf("%s\n", text.c_str());
  if (consequence && consequence->corrected) std::printf("%s\n", study::correction_sentence(*consequence).c_str());
  if (consequence) std::printf("%s\n", study::cost_sentence(*consequence).c_str());
  for (const auto& r : result.refused) std::printf("refused: %s\n", study::refusal(r).c_str());
  for (const auto& u : result.unknown)
    std::printf("unknown structure in %s along %s (%s), p %.4f\n", u.group.c_str(), u.along.c_str(), u.shape.c_str(),
                u.p);
  for (const auto& d : result.remaining)
    if (d.found)
      std::printf("what remains in %s depends on %s, p %.4f (Holm)\n", d.group.c_str(), d.regressor.c_str(), d.p_holm);
  for (const auto& [name, why] : result.not_tested) std::printf("not tested: %s (%s)\n", name.c_str(), why.c_str());
  for (const auto& gap : study::not_measured(seen)) std::printf("%s\n", study::to_text(gap, seen.flights).c_str());
  if (height) print_text("hovers and passes", height->all);
  if (height && height->hovers) print_text("hovers", *height->hovers);
  if (rotors) {
    std::printf("rotors against the reference flights: %s\n", study::rotor_sentence(*rotors).c_str());
    std::printf("  damage over a sound craft %.1f nats, chance %.1f; t of the twist %.1f\n", rotors->told.lead,
                rotors->told.needed, rotors->t[0]);
  }
}

void print_rules(bool json) {
  if (json) {
    Json all;
    for (const auto& r : all_rules())
      all["rules"].push_back({{"name", r.name}, {"value", r.value}, {"unit", r.unit}, {"reason", r.reason}});
    for (const study::Form* f : study::catalogue()) {
      Json priors = Json::object();
      for (std::size_t k = 0; k < f->priors.size(); ++k) {
        const auto& p = f->priors[k];
        priors[f->parameters[k]] = {{"typical", p.typical.value},
                                    {"rule", p.typical.name},
                                    {"range", ends(p.least, p.most)},
                                    {"why", p.reason}};
      }
      all["forms"].push_back({{"effect", f->cause()},
                              {"form", f->formula},
                              {"least_rms", f->floor},
                              {"least_parameter", f->least},
                              {"priors", priors}});
    }
    return print(all);
  }
  for (const auto& [name, value, unit, reason] : all_rules())
    std::printf("%-20.*s %10.7g  %-22.*s %.*s\n", static_cast<int>(name.size()), name.data(), value,
                static_cast<int>(unit.size()), unit.data(), static_cast<int>(reason.size()), reason.data());
  std::printf("\nleast root mean square over the flown windows, least first parameter, of each form:\n");
  for (const study::Form* f : study::catalogue())
    std::printf("%-20s %7.3g %7.3g  %s\n", f->cause().c_str(), f->floor, f->least, f->formula.c_str());
  std::printf("\ntypical size of each parameter, and ends of its law:\n");
  for (const study::Form* f : study::catalogue())
    for (std::size_t k = 0; k < f->priors.size(); ++k) {
      const auto& p = f->priors[k];
      std::printf("%-20s %-16s %6.3g, %.3g to %.3g  %s\n", f->cause().c_str(), f->parameters[k].c_str(),
                  p.typical.value, p.least, p.most, p.reason.c_str());
    }
}

}  // namespace backwash::services
