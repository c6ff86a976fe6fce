// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/levels/some_flights.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "core/study/inference/estimate.hpp"
#include "core/study/inference/levels/levels_of_flights.hpp"
#include "core/study/inference/rivals.hpp"
#include "core/study/inference/rotors/rotor_rules.hpp"

namespace backwash::study {
namespace {

/// Accepted columns, but for constants of the form's own effect: their part is seen in every flight alike.
std::vector<DesignColumn> others(const CauseSearchResult& found, const Form& own, const Observations& seen) {
  std::vector<DesignColumn> all;
  for (const auto& a : found.accepted) {
    if (a.form->constant && a.form->effect == own.effect) continue;
    all.insert(all.end(), a.columns.begin(), a.columns.end());
    const auto open = companions(*a.form, seen);
    all.insert(all.end(), open.begin(), open.end());
  }
  return all;
}

/// Rotors tell by channels of their own what is the matter with them, and other flights' scatter there is small. Pushes
/// and tails differ between flights for too many reasons.
std::vector<Amplitudes> all_amplitudes(const Evidence& evidence, const CauseSearchResult& found) {
  std::vector<Amplitudes> all;
  for (const Form* form : catalogue()) {
    if (!form->constant || why_not_tested(*form, evidence.seen())) continue;
    for (const Scale& scale : form->scales) {
      if (form->columns(evidence.seen().windows, scale).front().parts.front().channel < kLine1) break;
      all.emplace_back(evidence, *form, scale, evidence.residual(others(found, *form, evidence.seen())));
    }
  }
  return all;
}

/// Causes that explain the same segments alike.
std::vector<Rival> rivals_of(const Located& own, double nats, const std::vector<Amplitudes>& all) {
  const Amplitudes& a = *own.finding.asked.amplitudes;
  double weight = 0;
  for (const auto& s : own.segments)
    weight += own.finding.asked.direction.dot(a.information(s.begin, s.end) * own.finding.asked.direction) /
              static_cast<double>(own.segments.size());
  const double flights =
      1 + own.finding.spread * own.finding.spread * weight;  // what scatter between flights takes off
  std::vector<Rival> rivals;
  for (const auto& b : all) {
    if (b.form().effect == a.form().effect) continue;
    const auto d = difference(b, own.segments);
    if (!d || !b.effect(d->value())) continue;
    const double behind = (nats - gain(b, own.segments, d->value())) / flights;
    const bool alike = a.form().motors_alone && b.form().motors_alone;
    if (!alike && behind > kRules.rival_nats) continue;
    rivals.push_back({b.form().cause(), &b.form(), b.scale(), behind});
  }
  return rivals;
}

/// A cause where it fits best, its gain, and the family-wise p of its kind.
struct Fitting {
  Located located;
  double nats, chance;
};

/// Adds the causes of the same channels that gain half as much where they fit best themselves: which of them it is the
/// flights do not tell. Leaves each name once, the nearest first.
void add_elsewhere(std::vector<Rival>& rivals, const Fitting& best, const std::vector<Fitting>& places) {
  const Amplitudes& own = *best.located.finding.asked.amplitudes;
  for (const auto& place : places) {
    const Amplitudes& a = *place.located.finding.asked.amplitudes;
    if (a.form().effect == own.form().effect || !share_a_channel(a.columns(), own.columns())) continue;
    if (place.nats > kRules.rival_rest * best.nats)
      rivals.push_back({a.form().cause(), &a.form(), a.scale(), best.nats - place.nats});
  }
  std::sort(rivals.begin(), rivals.end(), [](auto& x, auto& y) { return x.behind_nats < y.behind_nats; });
  std::vector<Rival> named;
  for (const auto& r : rivals)
    if (std::none_of(named.begin(), named.end(), [&](auto& n) { return n.name == r.name; })) named.push_back(r);
  rivals = std::move(named);
}

std::vector<ActingFlight> flights_of(const std::vector<Segment>& segments, const Observations& seen) {
  std::vector<ActingFlight> flights;
  for (const auto& s : segments) {
    if (!s.acting) continue;
    const std::size_t first = seen.units.first[s.unit], end = seen.units.first[s.unit + 1];
    const auto& from = seen.windows[s.begin];
    const auto& to = seen.windows[s.end - 1];
    for (std::size_t f = from.flight; f <= to.flight; ++f) flights.push_back({f});
    if (s.begin > first) flights.back().since_s = from.t - from.duration / 2;
    if (s.end < end) flights.back().until_s = to.t + to.duration / 2;
  }
  return flights;
}

/// Columns that are 0 where no segment acts.
std::vector<DesignColumn> masked(std::vector<DesignColumn> columns, const std::vector<Segment>& segments) {
  for (const auto& s : segments)
    for (auto& column : columns)
      for (auto& part : column.parts)
        for (std::size_t i = s.begin; i < s.end && !s.acting; ++i) part.x[i] = 0;
  return columns;
}

InSomeFlights told(Located l, double p, std::vector<Rival> rivals, const Observations& seen) {
  const Amplitudes& a = *l.finding.asked.amplitudes;
  const double nats = gain(a, l.segments, l.difference.value());
  if (sound_is_odd(l)) {
    for (auto& s : l.segments) s.acting = !s.acting;
    std::swap(l.difference.sound, l.difference.acting);
  }
  const SmallVector value = l.difference.value();
  InSomeFlights found{{&a.form(), a.scale(), masked(a.columns(), l.segments), value, p, nats, {}, std::move(rivals)},
                      flights_of(l.segments, seen),
                      masked(companions(a.form(), seen), l.segments)};
  const double t = student_975(l.difference.degrees);
  for (std::size_t k = 0; k < a.form().parameters.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double error = t * l.difference.error[i];
    found.found.parameters.push_back({a.form().parameters[k], value[i], value[i] - error, value[i] + error});
  }
  if (!a.form().scale_name.empty()) {
    const double number = a.scale().value + (a.form().integer_scale ? 1 : 0);
    found.found.parameters.push_back({a.form().scale_name, number, number, number});
  }
  return found;
}

/// Whether a known cause acts where segments do, or where they do not, up to a tenth of the windows.
bool alike(const InSomeFlights& known, const std::vector<Segment>& segments) {
  double same = 0, all = 0;
  for (const auto& s : segments)
    for (std::size_t i = s.begin; i < s.end; ++i) {
      const auto& parts = known.found.columns.front().parts;
      const bool acts = std::any_of(parts.begin(), parts.end(), [i](auto& part) { return part.x[i] != 0; });
      same += acts == s.acting ? 1 : 0;
      all += 1;
    }
  return std::max(same, all - same) > (1 - kRotorRules.alike_windows) * all;
}

/// Channels in which causes compete for the same scatter between flights: a question each.
std::size_t kind_of(const Asked& asked) {
  const Channel c = asked.amplitudes->columns().front().parts.front().channel;
  constexpr std::array kFirst = {kLine1, kMotor1, kRpm1, kDropout1};
  return static_cast<std::size_t>(std::upper_bound(kFirst.begin(), kFirst.end(), c) - kFirst.begin());
}

/// What is asked of the flights, and at which share of the level.
class Questions {
 public:
  Questions(const std::vector<Amplitudes>& all, const CauseSearchResult& found, const std::vector<InSomeFlights>& known)
      : found_(&found), known_(&known) {
    for (const auto& a : all)
      for (const auto& direction : directions(a)) asked_.push_back({&a, direction});
    for (const auto& one : asked_) {
      ++count_[kind_of(one)];
      of_accepted_ += accepted(one) ? 1 : 0;
    }
  }
  const std::vector<Asked>& asked() const { return asked_; }

  /// Family-wise p: each kind of channel has the same share, both routes half of it. An accepted cause is known to be
  /// there: asked is only where.
  double chance(const Asked& one, double p) const {
    const double tried = accepted(one) ? of_accepted_ * kRules.further_level.value
                                       : static_cast<double>(count_.size()) * count_.at(kind_of(one));
    return std::min(1.0, 2 * tried * p);
  }

  /// Whether it was told already, or may be what the form of something told leaves: it is small beside that, or divides
  /// the flights alike. Two rotors may fail in flights of their own.
  bool left_out(const Located& place, double nats) const {
    const Amplitudes& own = *place.finding.asked.amplitudes;
    return std::any_of(known_->begin(), known_->end(), [&](const InSomeFlights& k) {
      const bool same = k.found.form == &own.form() && k.found.scale.value == own.scale().value;
      return same || nats < kRules.least_share * k.found.gain || alike(k, place.segments);
    });
  }

 private:
  bool accepted(const Asked& one) const {
    return std::any_of(found_->accepted.begin(), found_->accepted.end(),
                       [&](auto& a) { return a.form == &one.amplitudes->form(); });
  }

  const CauseSearchResult* found_;
  const std::vector<InSomeFlights>* known_;
  std::vector<Asked> asked_;
  std::map<std::size_t, double> count_;  // by kind
  double of_accepted_ = 0;
};

}  // namespace

std::optional<InSomeFlights> in_some_flights(const Evidence& evidence, const CauseSearchResult& found,
                                             const std::vector<InSomeFlights>& known,
                                             const CauseSearchOptions& options) {
  const auto all = all_amplitudes(evidence, found);
  const Questions questions(all, found, known);
  std::vector<Finding> findings;
  std::map<std::size_t, double> least;  // family-wise p, by kind
  for (const auto& one : questions.asked())
    for (auto& finding : {across(one), within(one)}) {
      const double chance = questions.chance(one, finding.p);
      findings.push_back(finding);
      const auto [at, fresh] = least.emplace(kind_of(one), chance);
      if (!fresh) at->second = std::min(at->second, chance);
    }
  // Which cause it is the gain says, not the clearest p.
  std::vector<Fitting> places;
  for (const auto& finding : findings) {
    const double chance = least.at(kind_of(finding.asked));
    if (chance > options.accept_p * kRotorRules.some_level) continue;
    auto place = located(finding, evidence.seen());
    if (!place) continue;
    const double nats = gain(*finding.asked.amplitudes, place->segments, place->difference.value());
    if (questions.left_out(*place, nats)) continue;
    places.push_back({std::move(*place), nats, chance});
  }
  const auto best = std::max_element(places.begin(), places.end(), [](auto& a, auto& b) { return a.nats < b.nats; });
  if (best == places.end()) return std::nullopt;
  auto rivals = rivals_of(best->located, best->nats, all);
  add_elsewhere(rivals, *best, places);
  return told(std::move(best->located), best->chance, std::move(rivals), evidence.seen());
}

}  // namespace backwash::study
