// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/changes/changes.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <set>

#include "core/study/inference/changes/acting.hpp"
#include "core/study/inference/rivals.hpp"
#include "core/study/inference/rotors/rotor_rules.hpp"
#include "core/study/inference/rotors/sound_rotors.hpp"

namespace backwash::study {
namespace {

constexpr auto kBesideMoment = static_cast<std::size_t>(kRules.side_windows.value);

/// A cause, a form, a scale and a time, and its p over all of these.
struct Hypothesis {
  const Amplitudes* amplitudes;
  Division division;
  double chance;
  std::size_t at = 0;  ///< of a moment: windows into each flight
};

/// Flights whose windows tell something of the parameters in `rows`.
struct Told {
  std::vector<std::size_t> units;
  FlightValues values;
};
template <typename F>
Told told_values(const Amplitudes& a, const std::vector<Eigen::Index>& rows, F of) {
  Told told;
  std::vector<Amplitudes::Told> all;
  for (std::size_t u = 0; u < a.units(); ++u)
    if (auto one = of(u)) {
      told.units.push_back(u);
      all.push_back(std::move(*one));
    }
  const auto p = static_cast<Eigen::Index>(rows.size()), n = static_cast<Eigen::Index>(all.size());
  told.values = {Eigen::MatrixXd(p, n), Eigen::VectorXd::Zero(n)};
  for (Eigen::Index f = 0; f < n; ++f)
    for (Eigen::Index k = 0; k < p; ++k) {
      const auto& one = all[static_cast<std::size_t>(f)];
      told.values.of(k, f) = one.theta[rows[static_cast<std::size_t>(k)]];
      told.values.error2[f] += one.error2[rows[static_cast<std::size_t>(k)]] / static_cast<double>(p);
    }
  return told;
}

/// Parameters that are asked together: two of one kind, as the level axes, scatter alike. Of a one-sided form the first
/// alone.
std::vector<std::vector<Eigen::Index>> asked_together(const Amplitudes& a) {
  const auto& columns = a.columns();
  if (a.form().one_sided || columns.size() == 1) return {{0}};
  const auto kind = [](const DesignColumn& c) {
    const Channel first = c.parts.front().channel;
    return first == kMeanY ? kMeanX : first >= kMotor1 && first <= kMotor4 ? kMotor1 : first;
  };
  if (columns.size() == 2 && kind(columns[0]) == kind(columns[1])) return {{0, 1}};
  std::vector<std::vector<Eigen::Index>> each;
  for (std::size_t k = 0; k < columns.size(); ++k) each.push_back({static_cast<Eigen::Index>(k)});
  return each;
}

/// All that is asked, and what part of the level each hypothesis has: causes share it alike, an accepted one half of it
/// with the other accepted ones, and of a cause all its forms, scales and parameters.
class Hypotheses {
 public:
  Hypotheses(const Evidence& evidence, const std::vector<Accepted>& accepted) : evidence_(evidence) {
    const Observations& seen = evidence.seen();
    const DesignColumn rest = evidence.residual(columns_of(accepted, seen));
    for (const Form* form : catalogue()) {
      if (form->displaces_map || why_not_tested(*form, seen)) continue;
      std::vector<Accepted> others;
      for (const auto& a : accepted)
        if (a.form->effect != form->effect) others.push_back(a);
      const bool own = others.size() < accepted.size();
      const DesignColumn left = own ? evidence.residual(columns_of(others, seen)) : rest;
      for (const Scale& scale : asked_at(*form)) all_.emplace_back(evidence, *form, scale, left);
      left_.emplace(form, left);
      (own ? known_ : new_).insert(form->effect);
    }
    std::vector<FlightValues> free;  // of flights whose offsets are free: what these scatter by is no one's own
    for (const auto& a : all_) {
      asked_[a.form().effect] += static_cast<double>(asked_together(a).size());
      for (const auto& rows : asked_together(a))
        if (!a.form().constant)
          if (auto told = told_values(a, rows, [&](std::size_t u) { return a.level(u); }); told.units.size() > 2)
            free.push_back(std::move(told.values));
    }
    expected_ = expected(free);
  }

  /// Those that flights without any change show with probability `level` at most, all together.
  std::vector<Hypothesis> below(double level) {
    std::vector<Hypothesis> passed;
    for (const auto& a : all_)
      for (const auto& rows : asked_together(a)) {
        const double share = kWhens * share_of(a);
        const auto told = told_values(a, rows, [&](std::size_t u) { return a.level(u); });
        for (auto& d : divisions(told.values, a.form().constant ? Expected{} : expected_)) {
          const double chance = d.p * share;
          if (chance <= level) passed.push_back({&a, std::move(d), chance});
        }
        add_moments(a, rows, share, level, passed);
      }
    const std::size_t first = passed.size();
    for (std::size_t k = 0; k < first; ++k) add_scales(Hypothesis(passed[k]), passed);
    return passed;
  }

 private:
  /// Whether it changes hardly goes by the scale of a length or a time: it is asked at the middle one.
  static std::vector<Scale> asked_at(const Form& form) {
    if (form.integer_scale) return form.scales;
    return {form.scales[form.scales.size() / 2]};
  }

  /// Adds the other scales of one that passed.
  void add_scales(const Hypothesis& one, std::vector<Hypothesis>& passed) {
    const Form& form = one.amplitudes->form();
    for (const Scale& scale : form.scales) {
      if (form.integer_scale || scale.value == one.amplitudes->scale().value) continue;
      auto at =
          std::ranges::find_if(others_, [&](auto& a) { return &a.form() == &form && a.scale().value == scale.value; });
      if (at == others_.end()) {
        others_.emplace_back(evidence_, form, scale, left_.at(&form));
        at = std::prev(others_.end());
      }
      passed.push_back({&*at, one.division, one.chance, one.at});
    }
  }

  double share_of(const Amplitudes& a) const {
    const bool known = known_.contains(a.form().effect);
    const double causes = static_cast<double>((known ? known_ : new_).size());
    return asked_.at(a.form().effect) * causes * (known_.empty() || new_.empty() ? 1 : 2);
  }

  /// Moments of a grid that flights have on both sides.
  void add_moments(const Amplitudes& a, const std::vector<Eigen::Index>& rows, double share, double level,
                   std::vector<Hypothesis>& passed) const {
    const auto& units = evidence_.seen().units;
    if (units.size() != evidence_.seen().flights) return;
    std::size_t longest = 0;
    for (std::size_t u = 0; u < a.units(); ++u) longest = std::max(longest, a.end(u) - a.begin(u));
    const auto every = static_cast<std::size_t>(kRules.moment_windows.value);
    const double ways = std::max(1.0, static_cast<double>(longest / every));
    for (std::size_t at = every; at + kBesideMoment <= longest; at += every) {
      const auto told = told_values(a, rows, [&](std::size_t u) {
        return a.begin(u) + at + kBesideMoment <= a.end(u) ? a.step(u, a.begin(u) + at) : std::nullopt;
      });
      if (static_cast<double>(told.units.size()) < kRules.fewest_divided) continue;
      Hypothesis one{&a, moment(told.values, ways, a.form().constant ? Expected{} : expected_), 1, at};
      one.chance = one.division.p * share;
      if (one.chance <= level) passed.push_back(std::move(one));
    }
  }

  const Evidence& evidence_;
  std::vector<Amplitudes> all_;
  std::deque<Amplitudes> others_;             // at the other scales of what passed
  std::map<const Form*, DesignColumn> left_;  // by what else is accepted
  Expected expected_;
  std::set<const Effect*> known_, new_;
  std::map<const Effect*, double> asked_;
};

/// A hypothesis as it is told: one change, or two of a cause in two steps.
struct Fitted {
  std::vector<Change> changes;
  std::vector<double> nats;  ///< per unit, against no change
  double score = 0;          ///< their sum less the price of parameters and times
  const Effect* effect() const { return changes.front().found.form->effect; }
};

double sum(const std::vector<double>& all) {
  double s = 0;
  for (const double x : all) s += x;
  return s;
}

/// Gives a change the columns of the windows in which it acts: what a form takes the mean of, as the thrust of which a
/// share is missing, was another without it. The factor of each parameter keeps what it moves first.
void size_by_own(Change& change, const std::vector<double>& amount, const Observations& seen) {
  Windows own;
  for (std::size_t i = 0; i < amount.size(); ++i)
    if (amount[i] > 0) own.push_back(seen.windows[i]);
  Accepted& found = change.found;
  const auto columns = found.form->columns(own, found.scale);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    double product = 0, square = 0;
    for (std::size_t part = 0; part < columns[k].parts.size(); ++part) {
      auto& x = found.columns[k].parts[part].x;
      for (std::size_t i = 0, j = 0; i < amount.size(); ++i) {
        if (!(amount[i] > 0)) continue;
        const double now = amount[i] * columns[k].parts[part].x[j++];
        if (part == 0) {
          product += now * x[i];
          square += now * now;
        }
        x[i] = now;
      }
    }
    if (square > 0) found.theta[static_cast<Eigen::Index>(k)] *= product / square;
  }
}

bool of_rotors(const Accepted& cause) { return cause.columns.front().parts.front().channel >= kLine1; }

/// Fits hypotheses beside what is accepted, in the scatter that each leaves.
class Fitting {
 public:
  Fitting(const Evidence& evidence, const std::vector<Accepted>& accepted)
      : evidence_(evidence),
        seen_(evidence.seen()),
        accepted_(columns_of(accepted, seen_)),
        without_(evidence.ln_likelihood(accepted_)) {}

  std::optional<Fitted> fit(const Hypothesis& h) const {
    const Amplitudes& a = *h.amplitudes;
    Fitted fitted;
    auto columns = accepted_;
    const auto acting = acting_of(a, h.division, h.at, seen_);
    for (const Acting& one : acting) {
      if (!a.effect(one.theta)) return std::nullopt;
      Change change = changed(a, h, one);
      const auto& own = change.found.columns;
      columns.insert(columns.end(), own.begin(), own.end());
      columns.insert(columns.end(), change.open.begin(), change.open.end());
      fitted.changes.push_back(std::move(change));
    }
    if (fitted.changes.empty()) return std::nullopt;
    const double n = static_cast<double>(seen_.units.size());
    double free = static_cast<double>(a.columns().size() * acting.size());
    if (a.form().constant && acting.front().stands_on &&
        !of_rotors(fitted.changes.front().found)) {  // the level that is changed is no news
      columns.insert(columns.end(), a.columns().begin(), a.columns().end());
      free += static_cast<double>(a.columns().size());
    }
    Evidence own = evidence_;
    own.whiten(columns);
    fitted.nats = own.ln_likelihood(columns);
    for (std::size_t u = 0; u < fitted.nats.size(); ++u) fitted.nats[u] -= without_[u];
    fitted.score = sum(fitted.nats) - free * std::log(n) / 2 - std::log(h.division.ways);
    for (auto& c : fitted.changes) c.found.gain = fitted.score;
    return fitted;
  }

 private:
  Change changed(const Amplitudes& a, const Hypothesis& h, const Acting& one) const {
    Change change{{&a.form(), a.scale(), masked(a.columns(), one.amount), one.theta, h.chance, 0, {}, {}},
                  h.division.when,
                  flights_of(one.amount, seen_),
                  masked(companions(a.form(), seen_), one.amount)};
    if (of_rotors(change.found)) change.open.insert(change.open.end(), a.columns().begin(), a.columns().end());
    if (!a.form().anchor) size_by_own(change, one.amount, seen_);
    for (std::size_t k = 0; k < a.form().parameters.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      const double theta = change.found.theta[i], factor = one.theta[i] != 0 ? theta / one.theta[i] : 1;
      const double error = student_975(one.degrees) * one.error[i] * std::abs(factor);
      change.found.parameters.push_back({a.form().parameters[k], theta, theta - error, theta + error});
    }
    if (!a.form().scale_name.empty()) {
      const double number = a.scale().value + (a.form().integer_scale ? 1 : 0);
      change.found.parameters.push_back({a.form().scale_name, number, number, number});
    }
    return change;
  }

  const Evidence& evidence_;
  const Observations& seen_;
  std::vector<DesignColumn> accepted_;
  std::vector<double> without_;
};

/// Whether two act in the same windows, or in the others, up to a tenth of them.
bool alike(const Accepted& a, const Accepted& b) {
  const auto acts = [](const Accepted& one, std::size_t i) {
    return std::ranges::any_of(one.columns.front().parts, [i](auto& part) { return part.x[i] != 0; });
  };
  const std::size_t n = a.columns.front().parts.front().x.size();
  double same = 0;
  for (std::size_t i = 0; i < n; ++i) same += acts(a, i) == acts(b, i) ? 1 : 0;
  return std::max(same, static_cast<double>(n) - same) > (1 - kRotorRules.alike_windows) * static_cast<double>(n);
}

/// Whether it is what the form of a change that was told already leaves: little beside it, or in the same flights of
/// the same craft's rotors, of which the channels all tell of one fault.
bool left_by(const std::vector<Change>& known, const Fitted& fitted) {
  const Accepted& own = fitted.changes.front().found;
  return std::ranges::any_of(known, [&](const Change& k) {
    if (!of_rotors(own) && !share_a_channel(own.columns, k.found.columns)) return false;
    if (fitted.score < kRules.least_share * k.found.gain) return true;
    return of_rotors(own) && of_rotors(k.found) && alike(k.found, own);
  });
}

/// What the rotors show in the windows of a change of their commands; nothing of another one.
std::optional<RotorsTold> rotors_where(const Change& change, const Observations& seen) {
  if (!rotor_state(*change.found.form)) return std::nullopt;
  std::vector<double> amount;
  for (const double x : change.found.columns.front().parts.front().x) amount.push_back(std::abs(x));
  return rotors_of(seen, amount);
}

/// Whether it is no more than rotors of a sound craft differ by from session to session.
bool of_sound_rotors(const Fitted& fitted, const Observations& seen) {
  const auto told = rotors_where(fitted.changes.front(), seen);
  return told && told->holds(RotorState::sound);
}

/// The lead over another, and the standard error of that sum.
Lead lead_over(const Fitted& ours, const Fitted& theirs) {
  const double n = static_cast<double>(ours.nats.size());
  double whole = 0, square = 0;
  for (std::size_t u = 0; u < ours.nats.size(); ++u) {
    const double d = ours.nats[u] - theirs.nats[u];
    whole += d;
    square += d * d;
  }
  return {ours.score - theirs.score, std::sqrt(std::max(0.0, (square - whole * whole / n) * n / (n - 1)))};
}

}  // namespace

std::vector<std::vector<Change>> likeliest_changes(const Evidence& evidence, const std::vector<Accepted>& accepted,
                                                   const std::vector<Change>& known,
                                                   const CauseSearchOptions& options) {
  Hypotheses hypotheses(evidence, accepted);
  const auto passed = hypotheses.below(options.accept_p * kRules.change_share);
  const Fitting fitting(evidence, accepted);
  std::vector<Fitted> all;
  for (const auto& h : passed)
    if (auto fitted = fitting.fit(h))
      if (fitted->score > 0 && !left_by(known, *fitted)) all.push_back(std::move(*fitted));
  std::ranges::stable_sort(all, [](auto& a, auto& b) { return a.score > b.score; });
  std::vector<Fitted> best;  // of each cause
  for (auto& one : all)
    if (std::ranges::none_of(best, [&](auto& b) { return b.effect() == one.effect(); }) &&
        !of_sound_rotors(one, evidence.seen()))
      best.push_back(std::move(one));
  std::vector<std::vector<Change>> changes;
  for (std::size_t k = 0; k < best.size() && static_cast<double>(k) < kRules.most_causes; ++k) {
    std::vector<Rival> rivals;
    for (const auto& other : best) {
      if (&other == &best[k]) continue;
      const Accepted& theirs = other.changes.front().found;
      const Lead lead = lead_over(best[k], other);
      if (lead.nats < needed_lead(lead.error, 0))
        rivals.push_back({theirs.form->cause(), theirs.form, theirs.scale, lead.nats});
    }
    changes.push_back(best[k].changes);
    for (auto& c : changes.back()) {
      c.found.rivals = rivals;
      if (const auto told = rotors_where(c, evidence.seen())) name_rotors(c.found, *told);
    }
  }
  return changes;
}

}  // namespace backwash::study
