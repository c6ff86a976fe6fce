// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rivals.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/study/inference/rotors/sound_rotors.hpp"

namespace backwash::study {

std::vector<DesignColumn> columns_of(const std::vector<Accepted>& accepted, const Observations& seen, std::size_t but) {
  std::vector<DesignColumn> all;
  for (std::size_t i = 0; i < accepted.size(); ++i) {
    if (i == but) continue;
    all.insert(all.end(), accepted[i].columns.begin(), accepted[i].columns.end());
    const auto open = companions(*accepted[i].form, seen);
    all.insert(all.end(), open.begin(), open.end());
  }
  return all;
}

bool dynamic(const std::vector<DesignColumn>& columns) {
  const Channel c = columns.front().parts.front().channel;
  return c >= kThrustDelay && c <= kTiltDelay;
}

bool share_a_channel(const std::vector<DesignColumn>& a, const std::vector<DesignColumn>& b) {
  std::array<bool, kChannels> moved{};
  for (const auto& column : a)
    for (const auto& part : column.parts) moved[part.channel] = moved[part.channel] || !part.aside;
  return std::any_of(b.begin(), b.end(), [&](const DesignColumn& column) {
    return std::any_of(column.parts.begin(), column.parts.end(),
                       [&](auto& part) { return !part.aside && moved[part.channel]; });
  });
}

/// Σ and standard error of the sum of per-flight differences.
Lead lead_over(const NormalEquations& a, const NormalEquations& b) {
  const auto ga = a.gain_per_flight(), gb = b.gain_per_flight();
  double sum = 0, square = 0;
  const double n = static_cast<double>(ga.size());
  for (std::size_t f = 0; f < ga.size(); ++f) {
    sum += ga[f] - gb[f];
    square += (ga[f] - gb[f]) * (ga[f] - gb[f]);
  }
  return {sum, std::sqrt(std::max(0.0, (square - sum * sum / n) * n / (n - 1)))};
}

double needed_lead(double error, double gain) {
  const double share = kRules.rival_share * gain;
  return std::min(std::max({kRules.rival_nats.value, share, kRules.rival_errors * error}),
                  std::max(kRules.rival_most_nats.value, share));
}

void find_rivals(const Evidence& evidence, std::vector<Accepted>& accepted, std::size_t which, double threshold) {
  Accepted& own = accepted[which];
  const auto others = columns_of(accepted, evidence.seen(), which);
  std::vector<Rival> found;
  for (const Form* each : catalogue()) {
    const Form& form = *each;
    if (form.effect == own.form->effect || why_not_tested(form, evidence.seen())) continue;
    if (std::any_of(accepted.begin(), accepted.end(), [&](auto& a) { return a.form->effect == form.effect; })) continue;
    for (const Scale& scale : form.scales) {
      const auto columns = form.columns(evidence.seen().windows, scale);
      // Both with the same free offsets, unless one of them is an offset itself.
      std::vector<DesignColumn> both = own.columns;
      both.insert(both.end(), columns.begin(), columns.end());
      std::vector<DesignColumn> nuisance = others;
      if (!form.constant && !own.form->constant) {
        const auto free = offsets(both, evidence.seen(), others);
        nuisance.insert(nuisance.end(), free.begin(), free.end());
      }
      const NormalEquations theirs = evidence.normal(columns, nuisance), ours = evidence.normal(own.columns, nuisance);
      if (!theirs.solvable || !ours.solvable || theirs.gain() < std::min(threshold, kRules.rival_rest * ours.gain()))
        continue;
      const SearchCandidate rival{&form, form.cause(), scale, {}, {}, 0, evidence.size(columns)};
      const SmallVector size = theirs.fit();
      if (!rival.effect(size)) continue;
      // Two causes that explain different data are two causes, not rivals: a rival gains less once ours is known.
      std::vector<DesignColumn> with_ours = nuisance;
      with_ours.insert(with_ours.end(), own.columns.begin(), own.columns.end());
      const NormalEquations rest = evidence.normal(columns, with_ours);
      if (rest.solvable && rest.gain() > kRules.rival_rest * theirs.gain()) continue;
      auto [lead, error] = lead_over(ours, theirs);
      lead += rival.prior_nats(size) - prior_nats_of(own);
      if (lead > needed_lead(error, dynamic(own.columns) || dynamic(columns) ? ours.gain() : 0.0)) continue;
      found.push_back({form.cause(), &form, scale, lead});
    }
  }
  std::sort(found.begin(), found.end(), [](auto& a, auto& b) { return a.behind_nats < b.behind_nats; });
  for (const auto& rival : found)
    if (std::none_of(own.rivals.begin(), own.rivals.end(), [&](auto& r) { return r.name == rival.name; }))
      own.rivals.push_back(rival);
  if (const auto told = rotor_state(*own.form) ? rotors_of(evidence.seen()) : std::nullopt) name_rotors(own, *told);
}

}  // namespace backwash::study
