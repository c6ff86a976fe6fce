// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/summary.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <map>

#include "tests/study_worlds/observe.hpp"

namespace study_worlds {
namespace {

std::string text(const char* format, ...) {
  char buffer[256];
  va_list values;
  va_start(values, format);
  std::vsnprintf(buffer, sizeof buffer, format, values);
  va_end(values);
  return buffer;
}

std::string text(const Rate& r) { return r.n == 0 ? "–" : text("%d/%d (%.2f–%.2f)", r.hits, r.n, r.low(), r.high()); }

/// Wilson's interval: centre and half width.
std::pair<double, double> wilson(const Rate& r) {
  const double z = 1.959964, n = r.n, p = r.hits / n, q = z * z / n;
  return {(p + q / 2) / (1 + q), z * std::sqrt(p * (1 - p) / n + q / (4 * n)) / (1 + q)};
}

double median(const std::vector<double>& sorted) { return sorted[sorted.size() / 2]; }

/// Cells with one hidden cause of the catalogue, flown so that it can be told.
bool plain(const CellSummary& c) {
  const auto& names = cause_names();
  return std::find(names.begin(), names.end(), c.cell) != names.end();
}

bool confounded(const CellSummary& c) { return c.cell.find(", ") != std::string::npos; }

std::string names_of(const std::vector<std::string>& names) {
  std::string all;
  for (const auto& n : names) all += (all.empty() ? "" : ", ") + n;
  return all;
}

/// Gate over every cell that `chosen` picks: the figure of the worst, and the cells that miss.
template <typename Chosen, typename Figure, typename Holds>
Requirement over(const std::string& name, const std::vector<CellSummary>& cells, Chosen chosen, Figure figure,
                 Holds holds) {
  std::vector<std::string> missed;
  int tested = 0;
  for (const auto& c : cells) {
    if (!chosen(c)) continue;
    ++tested;
    if (!holds(c)) missed.push_back(c.cell + " " + figure(c));
  }
  const std::string all = text("%d of %d cells", tested - static_cast<int>(missed.size()), tested);
  if (tested == 0) return {name, "not run", false};
  return {name, missed.empty() ? all : all + "; missed: " + names_of(missed), missed.empty()};
}

/// What was told most often; at the end of it the most frequent that is not what was hidden (self_test_rows.cmake).
std::string told_list(const CellSummary& c) {
  constexpr std::size_t kShown = 4;
  const auto as_hidden = [&](const std::string& told) {
    return told == c.cell || (c.cell == "none" && told == "nothing") || (c.cell == "unknown" && told[0] == '?');
  };
  const auto other = static_cast<std::size_t>(
      std::find_if(c.told.begin(), c.told.end(), [&](auto& t) { return !as_hidden(t.second); }) - c.told.begin());
  std::string list;
  for (std::size_t i = 0; i < c.told.size(); ++i) {
    if (i >= kShown && i != other) continue;
    list += (list.empty() ? "" : ", ") + std::to_string(c.told[i].first) + " `";
    for (const char letter : c.told[i].second) list += letter == '|' ? std::string("\\|") : std::string(1, letter);
    list += '`';
  }
  return list + (c.told.size() > kShown ? ", …" : "");
}

/// Of the structures without a name those that are too weak to be counted have a row of their own.
constexpr double kCounted = 0.15;  // of a channel's variance between windows
const char* const kWeaker = "unknown below 0.15";

std::string row_of(const WorldOutcome& o) { return o.cell == "unknown" && o.explained < kCounted ? kWeaker : o.cell; }

}  // namespace

double Rate::low() const { return std::max(0.0, wilson(*this).first - wilson(*this).second); }
double Rate::high() const { return std::min(1.0, wilson(*this).first + wilson(*this).second); }

std::vector<CellSummary> summarise(const std::vector<WorldOutcome>& outcomes) {
  std::vector<CellSummary> all;
  std::vector<std::string> names;
  for (const MatrixCell& cell : cells()) names.push_back(cell.name);
  names.push_back(kWeaker);
  for (const auto& name : names) {
    CellSummary s;
    s.cell = name;
    std::map<std::string, int> told_counts;
    for (const WorldOutcome& o : outcomes) {
      if (row_of(o) != name) continue;
      s.right.count(o.right());
      s.in_sets.count(o.in_sets());
      s.wrong_name.count(o.wrong_name());
      s.silent.count(o.silent());
      s.ambiguous.count(std::any_of(o.sets.begin(), o.sets.end(), [](auto& set) { return set.size() > 1; }));
      for (const auto& c : o.compared) {
        s.covered.count(c.covers(c.truth));
        if (c.best) s.covered_best.count(c.covers(*c.best));
      }
      if (o.error) s.errors.push_back(*o.error);
      if (o.gain_share) s.gain_shares.push_back(*o.gain_share);
      ++told_counts[told(o.sets, o.unknown)];
    }
    if (s.right.n == 0) continue;
    std::sort(s.errors.begin(), s.errors.end());
    std::sort(s.gain_shares.begin(), s.gain_shares.end());
    for (const auto& [what, count] : told_counts) s.told.emplace_back(count, what);
    std::sort(s.told.begin(), s.told.end(), [](auto& a, auto& b) { return a.first > b.first; });
    all.push_back(std::move(s));
  }
  return all;
}

std::vector<Requirement> gates(const std::vector<CellSummary>& cells) {
  const auto is = [](const char* name) { return [name](const CellSummary& c) { return c.cell == name; }; };
  const auto known = [](const CellSummary& c) { return plain(c) || c.cell == "unknown"; };
  const auto error = [](const CellSummary& c) { return text("%.2f", median(c.errors)); };
  const auto gain = [](const CellSummary& c) { return text("%.2f", median(c.gain_shares)); };
  const auto alarms = [](const CellSummary& c) { return text(Rate{c.silent.n - c.silent.hits, c.silent.n}); };
  Rate covered, best;
  for (const auto& c : cells)
    if (plain(c)) {
      covered.add(c.covered);
      best.add(c.covered_best);
    }
  std::vector<Requirement> all = {
      over("false alarms: 95 % upper limit ≤ 0.08", cells, is("none"), alarms,
           [](auto& c) {
             return Rate{c.silent.n - c.silent.hits, c.silent.n}.high() <= 0.08;
           }),
      over(
          "wrong name ≤ 0.03, in each cell", cells, known, [](auto& c) { return text(c.wrong_name); },
          [](auto& c) { return c.wrong_name.hits <= 0.03 * c.wrong_name.n; }),
      over(
          "power ≥ 0.8, the right name alone", cells, plain, [](auto& c) { return text(c.right); },
          [](auto& c) { return c.right.hits >= 0.8 * c.right.n; }),
      over(
          "power ≥ 0.8, the right name in the set", cells, plain, [](auto& c) { return text(c.in_sets); },
          [](auto& c) { return c.in_sets.hits >= 0.8 * c.in_sets.n; }),
      over(
          "unknown structure that explains ≥ 0.15 reported ≥ 0.8", cells, is("unknown"),
          [](auto& c) { return text(c.right); }, [](auto& c) { return c.right.hits >= 0.8 * c.right.n; }),
      over(
          "confounded: truth in the set ≥ 0.9", cells, confounded, [](auto& c) { return text(c.in_sets); },
          [](auto& c) { return c.in_sets.hits >= 0.9 * c.in_sets.n; }),
      over(
          "median parameter error ≤ 0.2", cells, [](auto& c) { return plain(c) && !c.errors.empty(); }, error,
          [](auto& c) { return median(c.errors) <= 0.2; }),
      over(
          "median gain ≥ 0.8 of the oracle's", cells, [](auto& c) { return plain(c) && !c.gain_shares.empty(); }, gain,
          [](auto& c) { return median(c.gain_shares) >= 0.8; })};
  const auto covers = [](const Rate& r) { return r.n > 0 && r.hits >= 0.9 * r.n && r.hits <= 0.98 * r.n; };
  all.push_back({"intervals cover the table's size 0.90 … 0.98", text(covered), covers(covered)});
  all.push_back({"intervals cover the best value of their form 0.90 … 0.98", text(best), covers(best)});
  return all;
}

std::string markdown(const std::vector<CellSummary>& cells, const std::vector<WorldOutcome>& outcomes) {
  std::string page =
      "| hidden | right name alone | truth in what is reported | wrong name | parameter error | interval covers size | "
      "of "
      "form "
      "| gain / oracle | reported |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const auto& c : cells) {
    page += "| " + c.cell + " | " + text(c.right) + " | " + text(c.in_sets) + " | " + text(c.wrong_name) + " | " +
            (c.errors.empty() ? "–" : text("%.2f", median(c.errors))) + " | " + text(c.covered) + " | " +
            text(c.covered_best) + " | " + (c.gain_shares.empty() ? "–" : text("%.2f", median(c.gain_shares))) + " | " +
            told_list(c) + " |\n";
  }
  page += "\n| gate | figure | held |\n| --- | --- | --- |\n";
  for (const auto& g : gates(cells))
    page += "| " + g.name + " | " + g.figure + " | " + (g.held ? "yes" : "**no**") + " |\n";
  std::vector<double> search, world;
  for (const auto& o : outcomes)
    if (o.study_s > 0) {
      search.push_back(o.study_s);
      world.push_back(o.world_s);
    }  // rows of a campaign have no times
  if (search.empty()) return page;
  std::sort(search.begin(), search.end());
  std::sort(world.begin(), world.end());
  return page + text("\nCPU a study, median and slowest: %.2f s and %.2f s; flying and observing its world %.2f s.\n",
                     median(search), search.back(), median(world));
}

}  // namespace study_worlds
