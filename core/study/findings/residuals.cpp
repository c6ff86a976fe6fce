// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/residuals.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/report/page/page.hpp"
#include "core/study/findings/page_sections.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {
namespace {

/// The windows of one flight by the time of their middle.
using ByTime = std::map<double, std::size_t>;

std::vector<ByTime> by_time(const Observations& seen) {
  std::vector<ByTime> flights(seen.flights);
  for (std::size_t i = 0; i < seen.windows.size(); ++i) flights[seen.windows[i].flight][seen.windows[i].t] = i;
  return flights;
}

std::optional<std::size_t> nearest(const ByTime& flight, double t) {
  const auto after = flight.lower_bound(t);
  std::optional<std::size_t> best;
  double distance = kRules.window_match;
  const auto look = [&](auto at) {
    if (std::abs(at->first - t) <= distance) {
      distance = std::abs(at->first - t);
      best = at->second;
    }
  };
  if (after != flight.end()) look(after);
  if (after != flight.begin()) look(std::prev(after));
  return best;
}

bool both(const Observations& measured, const Told& told, Channel c, std::size_t i) {
  return measured.weight[c][i] > 0 && told[c][i].has_value();
}

/// Measured as dots, simulated as lines.
std::string picture(const Observations& measured, const Told& before, const Told& after, Channel c,
                    report::PageData& data) {
  std::string id = channel_name(c);
  std::ranges::replace(id, ' ', '_');
  report::DataTable table{id, {"window", "measured", "before", "after"}, {}, 0};
  for (std::size_t i = 0; i < measured.windows.size(); ++i)
    if (both(measured, before, c, i) && both(measured, after, c, i))
      table.rows.push_back({static_cast<double>(i), measured.y[c][i], *before[c][i], *after[c][i]});
  const report::TimePlot plot{id,
                              id,
                              channel_name(c),
                              c <= kMeanZ ? "m/s²" : "ln",
                              {{"measured", "measured", report::Kind::measured, false, report::Shape::dots},
                               {"before", "simulated before", report::Kind::before},
                               {"after", "simulated after", report::Kind::after}}};
  return report::plotted(data, table, {plot}) + report::files_html({id});
}

}  // namespace

Told told_of(const Observations& measured, std::span<const Observations> simulated) {
  std::array<std::vector<double>, kChannels> sum;
  for (auto& channel : sum) channel.assign(measured.windows.size(), 0);
  std::array<std::vector<int>, kChannels> count;
  for (auto& channel : count) channel.assign(measured.windows.size(), 0);
  for (const Observations& replica : simulated) {
    const auto flights = by_time(replica);
    for (std::size_t i = 0; i < measured.windows.size(); ++i) {
      const auto& w = measured.windows[i];
      if (w.flight >= flights.size()) continue;
      const auto at = nearest(flights[w.flight], w.t);
      for (std::size_t c = 0; at && c < kChannels; ++c)
        if (replica.weight[c][*at] > 0) {
          sum[c][i] += replica.y[c][*at];
          count[c][i] += 1;
        }
    }
  }
  Told told;
  for (std::size_t c = 0; c < kChannels; ++c) {
    told[c].resize(measured.windows.size());
    for (std::size_t i = 0; i < told[c].size(); ++i)
      if (count[c][i] > 0) told[c][i] = sum[c][i] / count[c][i];
  }
  return told;
}

std::optional<ChannelError> channel_error(const Observations& measured, const Told& told, Channel c, bool about_mean) {
  double weight = 0, mean = 0, square = 0;
  std::size_t windows = 0;
  for (std::size_t i = 0; i < measured.windows.size(); ++i) {
    if (!both(measured, told, c, i)) continue;
    const double w = measured.weight[c][i], r = measured.y[c][i] - *told[c][i];
    weight += w;
    mean += w * r;
    square += w * r * r;
    ++windows;
  }
  if (!(weight > 0)) return std::nullopt;
  mean /= weight;
  return ChannelError{std::sqrt(std::max(0.0, square / weight - (about_mean ? mean * mean : 0.0))), windows};
}

std::string residual_section(const Observations& measured, const Told& before, const Told& after,
                             report::PageData& data) {
  data.along = "window, in the order of the flights";
  data.along_unit = "";
  std::string rows, pictures;
  for (std::size_t k = 0; k < kChannels; ++k) {
    const auto c = static_cast<Channel>(k);
    const auto b = channel_error(measured, before, c), a = channel_error(measured, after, c);
    if (!b || !a || static_cast<double>(b->windows) < kRules.fewest_compared) continue;
    rows += row(channel_name(c), number(b->value) + " → " + number(a->value));
    pictures += picture(measured, before, after, c, data);
  }
  return report::section(
      "Simulated beside measured",
      "The set-points of these flights, flown by the simulation in the air of the model, before the extension and "
      "after "
      "it; the mean of several flights with other gusts. Errors are root mean squares over windows of 2 s.",
      report::table(rows) + pictures);
}

}  // namespace backwash::study
