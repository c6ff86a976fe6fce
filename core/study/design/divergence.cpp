// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/design/divergence.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/design/design_rules.hpp"
#include "core/study/inference/rotors/sound_rotors.hpp"
#include "core/types/normal.hpp"

namespace backwash::study {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

/// What remains of the cause's columns, G with the others projected out.
MatrixXd rest(const MatrixXd& gram, Eigen::Index own) {
  const Eigen::Index others = gram.rows() - own;
  if (others == 0) return gram;
  const MatrixXd cross = gram.bottomLeftCorner(others, own);
  return gram.topLeftCorner(own, own) -
         cross.transpose() * gram.bottomRightCorner(others, others).completeOrthogonalDecomposition().solve(cross);
}

MatrixXd gram_of(const Evidence& evidence, const std::vector<DesignColumn>& columns) {
  return evidence.normal(columns, {}).total;
}

Scale anchored(const Form& form, Scale scale, const Windows& flown) {
  if (form.anchor && scale.anchor.empty()) scale.anchor = form.anchor(flown);
  return scale;
}

void append(std::vector<DesignColumn>& to, const std::vector<DesignColumn>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

}  // namespace

double Imitation::left(double flights) const {
  const MatrixXd all = flown + flights * flight;
  return std::max(0.0, 0.5 * theta.dot(rest(all, theta.size()) * theta));
}

double Imitation::divergence() const {
  const Eigen::Index own = theta.size(), others = flown.rows() - own;
  VectorXd gap = VectorXd::Zero(flown.rows());
  gap.head(own) = theta;
  if (others > 0) {
    const MatrixXd all = flown + kDesignRules.design_refit * flight;
    const VectorXd asked = all.bottomLeftCorner(others, own) * theta;
    gap.tail(others) = -all.bottomRightCorner(others, others).completeOrthogonalDecomposition().solve(asked);
  }
  return std::max(0.0, 0.5 * gap.dot(flight * gap));
}

double passes(double lead, double growth, double needed) {
  if (!(growth > 0)) return lead > needed ? 1 : 0;
  return normal::below((lead + growth - needed) / std::sqrt(2 * growth));
}

std::optional<int> Outlook::flights() const {
  const auto enough = std::ranges::find_if(separated, [](double p) { return p >= kDesignRules.design_separated; });
  if (enough == separated.end()) return std::nullopt;
  return static_cast<int>(enough - separated.begin()) + 1;
}

Contest::Contest(const Evidence& flown, const std::vector<Accepted>& accepted, std::size_t which, double threshold)
    : flown_(&flown), accepted_(&accepted), which_(which), threshold_(threshold) {
  const Accepted& named = accepted[which];
  all_.push_back({named.form, anchored(*named.form, named.scale, flown.seen().windows), 0, 1});
  for (const Rival& r : named.rivals)
    all_.push_back({r.form, anchored(*r.form, r.scale, flown.seen().windows), r.behind_nats, 0});
  double best = 0, sum = 0;
  for (const auto& e : all_) best = std::min(best, e.behind);
  for (auto& e : all_) {
    e.probability = std::exp(best - e.behind);
    sum += e.probability;
  }
  for (auto& e : all_) e.probability /= sum;
  for (std::size_t i = 0; i < all_.size(); ++i)
    for (std::size_t j = 0; j < all_.size(); ++j)
      if (i != j) duels_.push_back(duel(i, j));
}

std::vector<std::pair<std::size_t, std::size_t>> Contest::pairs() const {
  std::vector<std::pair<std::size_t, std::size_t>> all;
  for (const Duel& d : duels_)
    if (d.truth < d.rival) all.emplace_back(d.truth, d.rival);
  return all;
}

std::vector<DesignColumn> Contest::beside(const std::vector<DesignColumn>& both, bool constant,
                                          const Observations& seen) const {
  std::vector<DesignColumn> columns = constant ? std::vector<DesignColumn>() : offsets(both, seen);
  for (std::size_t k = 0; k < accepted_->size(); ++k) {
    if (k == which_) continue;
    const Accepted& other = (*accepted_)[k];
    append(columns, other.form->columns(seen.windows, anchored(*other.form, other.scale, flown_->seen().windows)));
    append(columns, companions(*other.form, seen));
  }
  return columns;
}

std::vector<DesignColumn> Contest::joint(const Explanation& truth, const Form* rival, const Scale& scale,
                                         const Observations& seen) const {
  std::vector<DesignColumn> columns = truth.form->columns(seen.windows, truth.scale);
  if (rival) append(columns, rival->columns(seen.windows, scale));
  append(columns, beside(columns, truth.form->constant || (rival && rival->constant), seen));
  if (columns.size() > static_cast<std::size_t>(kMostColumns)) columns.clear();
  return columns;
}

Contest::Duel Contest::duel(std::size_t truth, std::size_t rival) const {
  const Explanation &ours = all_[truth], &theirs = all_[rival];
  const Observations& seen = flown_->seen();
  Duel d{};
  d.truth = truth;
  d.rival = rival;
  d.lead = theirs.behind - ours.behind;
  const auto own = ours.form->columns(seen.windows, ours.scale),
             other = theirs.form->columns(seen.windows, theirs.scale);
  auto both = own;
  append(both, other);
  const auto nuisance = beside(both, ours.form->constant || theirs.form->constant, seen);
  const NormalEquations we = flown_->normal(own, nuisance), they = flown_->normal(other, nuisance);
  d.never = !we.solvable || !they.solvable || (rotor_state(*ours.form) && rotor_state(*theirs.form));
  if (d.never) return d;
  d.theta = we.fit();
  d.gain = we.gain();
  d.error = lead_over(we, they).error;
  d.dynamic = dynamic(own) || dynamic(other);
  add_copies(d);
  d.never = d.copies.empty() || d.alone.size() == 0;
  return d;
}

void Contest::add_copies(Duel& d) const {
  const Explanation &ours = all_[d.truth], &theirs = all_[d.rival];
  const Observations& seen = flown_->seen();
  for (const Form& form : theirs.form->effect->forms) {
    if (why_not_tested(form, seen)) continue;
    auto scales = form.scales;
    if (&form == theirs.form) scales.push_back(theirs.scale);
    for (const Scale& each : scales) {
      const Scale scale = anchored(form, each, seen.windows);
      const auto columns = joint(ours, &form, scale, seen);
      if (!columns.empty()) d.copies.push_back({&form, scale, gram_of(*flown_, columns)});
    }
  }
  const auto alone = joint(ours, nullptr, {}, seen);
  if (!alone.empty()) d.alone = gram_of(*flown_, alone);
}

Contest::Growth Contest::growth(const Duel& d, const Evidence& next) const {
  const auto most = static_cast<std::size_t>(kDesignRules.design_most_flights);
  const Explanation& truth = all_[d.truth];
  Growth grown;
  std::vector<double> left(most + 1, INFINITY);
  for (const Copy& copy : d.copies) {
    const auto columns = joint(truth, copy.form, copy.scale, next.seen());
    const Imitation imitation{copy.flown, gram_of(next, columns), d.theta};
    const double now = imitation.left(0);
    if (now < left[0]) grown.divergence = imitation.divergence();
    for (std::size_t n = 0; n <= most; ++n)
      left[n] = std::min(left[n], n == 0 ? now : imitation.left(static_cast<double>(n)));
  }
  const Imitation alone{d.alone, gram_of(next, joint(truth, nullptr, {}, next.seen())), d.theta};
  for (std::size_t n = 1; n <= most; ++n) {
    grown.lead.push_back(left[n] - left[0]);
    grown.gain.push_back(alone.left(static_cast<double>(n)) - alone.left(0));
  }
  return grown;
}

double Contest::chance(const Duel& d, double lead_growth, double gain_growth) const {
  const double gain = d.gain + gain_growth, error = std::sqrt(d.error * d.error + 2 * lead_growth);
  // What gains little itself is no rival, however little it is behind (find_rivals).
  const double too_weak = std::max(gain - threshold_, (1 - kRules.rival_rest) * gain);
  return passes(d.lead, lead_growth, std::min(needed_lead(error, d.dynamic ? gain : 0), too_weak));
}

Outlook Contest::after(const Evidence& next) const {
  const auto most = static_cast<std::size_t>(kDesignRules.design_most_flights);
  Outlook told;
  std::vector<double> missed(all_.size() * most, 0);  // Σ over rivals of P that one stays in the set
  std::vector<double> of(all_.size() * all_.size(), 0);
  for (const Duel& d : duels_) {
    if (d.never) {
      for (std::size_t n = 0; n < most; ++n) missed[d.truth * most + n] += 1;
      continue;
    }
    const Growth grown = growth(d, next);
    of[d.truth * all_.size() + d.rival] = grown.divergence;
    for (std::size_t n = 0; n < most; ++n) missed[d.truth * most + n] += 1 - chance(d, grown.lead[n], grown.gain[n]);
  }
  for (std::size_t n = 0; n < most; ++n) {
    double p = 0;
    for (std::size_t i = 0; i < all_.size(); ++i) p += all_[i].probability * std::max(0.0, 1 - missed[i * most + n]);
    told.separated.push_back(p);
  }
  for (const auto& [i, j] : pairs()) {
    told.of_pair.push_back(0.5 * (of[i * all_.size() + j] + of[j * all_.size() + i]));
    told.divergence += all_[i].probability * all_[j].probability * told.of_pair.back();
  }
  return told;
}

}  // namespace backwash::study
