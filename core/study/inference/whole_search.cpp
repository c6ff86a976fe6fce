// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/whole_search.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "core/study/inference/rivals.hpp"

namespace backwash::study {
namespace {

void subtract(const std::vector<DesignColumn>& columns, const SmallVector& theta, Observations& seen) {
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& [channel, x, aside] : columns[k].parts)
      for (std::size_t i = 0; i < x.size(); ++i) seen.y[channel][i] -= theta[static_cast<Eigen::Index>(k)] * x[i];
}

/// ln likelihood of each unit with what was found, and the price of its parameters.
struct Scored {
  std::vector<double> nats;
  double price;
};
Scored scored(Evidence evidence, const CauseSearchResult& found) {
  const Observations& seen = evidence.seen();
  const auto columns = columns_of(found.accepted, seen);
  evidence.whiten(columns);
  double price = static_cast<double>(columns.size()) * std::log(static_cast<double>(seen.units.size())) / 2;
  return {evidence.ln_likelihood(columns), price};
}

/// What structures without a name gain.
double unnamed(const CauseSearchResult& found) {
  double nats = 0;
  for (const auto& u : found.unknown) nats += u.gain.value_or(0);
  return nats;
}

/// Nats by which flights are likelier with a change and what is found beside it than without, less what is needed: a
/// ratio of 20, or the flights' differences.
double lead(const Scored& with, const Scored& without) {
  const double n = static_cast<double>(with.nats.size());
  double sum = 0, square = 0;
  for (std::size_t u = 0; u < with.nats.size(); ++u) {
    const double d = with.nats[u] - without.nats[u];
    sum += d;
    square += d * d;
  }
  const double error = std::sqrt(std::max(0.0, (square - sum * sum / n) * n / (n - 1)));
  return sum - with.price + without.price - needed_lead(error, 0);
}

/// All with one change more, and by how much that leads.
struct Next {
  WholeSearch all;
  double lead;
};

/// The search beside changes: what they leave may be the error of their forms.
CauseSearchResult search_beside(const std::vector<Change>& changes, const Evidence& rest, CauseSearchOptions options) {
  for (const auto& c : changes) options.known.push_back({c.found.columns, c.found.gain});
  return search(rest, options);
}

Next with(const WholeSearch& all, std::vector<Change> changes, const Scored& now, const CauseSearchOptions& options) {
  WholeSearch then{{}, all.changes, all.rest};
  double price = 0;
  for (auto& c : changes) {
    subtract(c.found.columns, c.found.theta, then.rest);
    price += static_cast<double>(c.found.columns.size()) * std::log(static_cast<double>(all.rest.units.size())) / 2;
    then.changes.push_back(std::move(c));
  }
  const Evidence rest = then.evidence();
  then.found = search_beside(then.changes, rest, options);
  Scored score = scored(rest, then.found);
  // A structure that the change leaves no room for might be the better explanation, if one without a name.
  score.price += price + std::max(0.0, unnamed(all.found) - unnamed(then.found));
  return {std::move(then), lead(score, now)};
}

/// The change that leads most, beside what is found or instead of it.
std::optional<Next> next_change(const WholeSearch& all, const CauseSearchOptions& options) {
  const Scored now = scored(all.evidence(), all.found);
  std::optional<Next> best;
  for (const bool instead : {false, true}) {
    if (instead && all.found.accepted.empty()) break;
    const auto beside = instead ? std::vector<Accepted>{} : all.found.accepted;
    Evidence evidence = all.evidence();
    evidence.whiten(columns_of(beside, all.rest));
    for (auto& changes : likeliest_changes(evidence, beside, all.changes, options))
      if (Next next = with(all, std::move(changes), now, options); !best || next.lead > best->lead)
        best = std::move(next);
  }
  return best;
}

}  // namespace

Evidence WholeSearch::evidence() const {
  Evidence evidence(rest);
  std::vector<DesignColumn> open;
  for (const auto& c : changes) open.insert(open.end(), c.open.begin(), c.open.end());
  evidence.leave_free(std::move(open));
  return evidence;
}

WholeSearch search_all(Observations seen, const CauseSearchOptions& options) {
  WholeSearch all{{}, {}, std::move(seen)};
  all.found = search(Evidence(all.rest), options);
  while (static_cast<double>(all.changes.size()) < kRules.most_parts) {
    options.progress("when causes act");
    auto next = next_change(all, options);
    if (!next || next->lead <= 0) break;
    all = std::move(next->all);
  }
  return all;
}

}  // namespace backwash::study
