// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/whole_search.hpp"

#include <utility>

#include "core/study/inference/rivals.hpp"

namespace backwash::study {
namespace {

void subtract(const std::vector<DesignColumn>& columns, const SmallVector& theta, Observations& seen) {
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& [channel, x, aside] : columns[k].parts)
      for (std::size_t i = 0; i < x.size(); ++i) seen.y[channel][i] -= theta[static_cast<Eigen::Index>(k)] * x[i];
}

/// Takes a cause out where it acts, and then what it leaves open there, as large as the flights say beside the accepted
/// causes: no other cause may claim it.
void take_out(const InSomeFlights& cause, const std::vector<Accepted>& accepted, Observations& seen) {
  subtract(cause.found.columns, cause.found.theta, seen);
  if (cause.open.empty()) return;
  auto known = columns_of(accepted, seen);
  Evidence evidence(seen);
  auto all = known;
  all.insert(all.end(), cause.open.begin(), cause.open.end());
  evidence.whiten(all);
  const NormalEquations left = evidence.normal(cause.open, known);
  if (left.excited) subtract(cause.open, left.fit(), seen);
}

}  // namespace

WholeSearch search_all(Observations seen, const CauseSearchOptions& options) {
  WholeSearch all{{}, {}, std::move(seen)};
  for (;;) {
    Evidence evidence(all.rest);
    all.found = search(evidence, options);
    if (static_cast<double>(all.some.size()) >= kRules.most_parts) return all;
    evidence.whiten(columns_of(all.found.accepted, all.rest));
    options.progress("flight by flight");
    auto next = in_some_flights(evidence, all.found, all.some, options);
    if (!next) return all;
    take_out(*next, all.found.accepted, all.rest);
    all.some.push_back(std::move(*next));
  }
}

}  // namespace backwash::study
