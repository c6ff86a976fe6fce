// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/shares.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>
#include <sstream>
#include <tuple>

#include "core/study/findings/when_it_acts.hpp"
#include "tests/study_worlds/effects.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/summary.hpp"

namespace study_worlds {
namespace {

constexpr int kFlights = 12;

std::vector<int> drawn_flights(const SharedFault& hidden, std::mt19937_64& rng) {
  std::vector<int> all(kFlights);
  std::iota(all.begin(), all.end(), 0);
  if (hidden.layout == "any") {
    std::shuffle(all.begin(), all.end(), rng);
  } else {
    const int last = kFlights - hidden.count;
    const int first = hidden.layout == "since" || hidden.layout == "from" || hidden.layout == "each"
                          ? last
                          : std::uniform_int_distribution(0, last)(rng);
    std::rotate(all.begin(), all.begin() + first, all.end());
  }
  all.resize(static_cast<std::size_t>(hidden.count));
  std::sort(all.begin(), all.end());
  return all;
}

void break_rotor(std::vector<Table>& flights, const std::vector<int>& which, std::size_t rotor, double since_s) {
  for (const int f : which) {
    Table& table = flights[static_cast<std::size_t>(f)];
    const auto at = std::find(table.names.begin(), table.names.end(), "rpm" + std::to_string(rotor + 1));
    const auto column = static_cast<std::size_t>(at - table.names.begin());
    for (auto& row : table.rows)
      if (f != which.front() || row[0] >= since_s) row[column] *= 0.54;
  }
}

}  // namespace

SharedOutcome score(const SharedFault& hidden, std::uint64_t seed, const std::filesystem::path& folder) {
  std::mt19937_64 rng(seed * 48271 + 5);
  SharedOutcome out;
  out.hidden = hidden;
  out.seed = seed;
  out.truth = drawn_flights(hidden, rng);
  const bool each = hidden.layout == "each";
  if (hidden.layout == "since" || each) out.since_s = std::uniform_real_distribution(20.0, 60.0)(rng);
  const bool rpm = hidden.fault == "rpm";
  Request request{seed, {}, hidden.size, kFlights, "", out.truth, out.since_s, each};
  if (!rpm) request.causes = {hidden.fault};
  const HiddenWorld world = draw_world(request);
  auto flights = fly_all(world);
  const std::size_t rotor = rpm ? rng() % 4 : static_cast<std::size_t>(std::abs(world.effects.shape_of(hidden.fault)));
  if (rpm) break_rotor(flights, out.truth, rotor, out.since_s);
  const std::string name = rpm ? "rotor_sensor_fault" : hidden.fault;
  auto options = with_reference(world, folder);
  options.minimum_detectable = options.dependence = false;
  const auto result = backwash::study::study(observe(world, flights, folder), options);
  for (const auto& cause : result.causes) {
    std::vector<std::string> set{cause.found.form->cause()};
    for (const auto& r : cause.found.rivals) set.push_back(r.name);
    out.told += (out.told.empty() ? "" : " + ");
    for (const auto& one : set) out.told += (&one == &set.front() ? "" : "|") + one;
    out.told += " (" + backwash::study::where(cause) + ")";
    if (std::find(set.begin(), set.end(), name) == set.end()) {
      out.wrong = true;
      continue;
    }
    if (cause.flights.empty()) continue;
    out.found = true;
    for (const auto& f : cause.flights) out.flights.push_back(static_cast<int>(f.flight));
    out.told_since_s = cause.flights.front().since_s.value_or(-1);
    for (const auto& e : cause.found.parameters)
      if (e.name == "rotor" && causes().contains(name) && name != "payload")
        out.rotor = static_cast<std::size_t>(e.value) == rotor + 1;
  }
  for (const auto& u : result.unknown) out.told += " ?" + u.along;
  if (out.told.empty()) out.told = "nothing";
  return out;
}

nlohmann::json to_json(const SharedOutcome& o) {
  return {{"fault", o.hidden.fault}, {"count", o.hidden.count}, {"layout", o.hidden.layout},
          {"size", o.hidden.size},   {"seed", o.seed},          {"truth", o.truth},
          {"flights", o.flights},    {"since_s", o.since_s},    {"told_since_s", o.told_since_s},
          {"found", o.found},        {"exact", o.exact()},      {"rotor", o.rotor},
          {"wrong", o.wrong},        {"told", o.told}};
}

std::string shares_table(const std::vector<SharedOutcome>& outcomes) {
  struct Row {
    Rate found, exact, rotor, wrong;
    std::vector<double> late;
  };
  std::map<std::tuple<std::string, double, std::string, int>, Row> rows;
  for (const auto& o : outcomes) {
    Row& row = rows[{o.hidden.fault, o.hidden.size, o.hidden.layout, o.hidden.count}];
    row.found.count(o.found);
    row.exact.count(o.exact());
    row.rotor.count(o.found && o.rotor);
    row.wrong.count(o.wrong);
    if (o.found && o.since_s > 0 && o.told_since_s >= 0) row.late.push_back(std::abs(o.told_since_s - o.since_s));
  }
  std::ostringstream text;
  text << "| hidden | size | flights | told, and in some flights | exactly these flights | right rotor | wrong name | "
          "since, "
          "median error |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n";
  const auto rate = [](const Rate& r) { return std::to_string(r.hits) + "/" + std::to_string(r.n); };
  for (auto& [key, row] : rows) {
    const auto& [fault, size, layout, count] = key;
    text << "| " << fault << " | " << size << " | " << count << " of 12, " << layout << " | " << rate(row.found)
         << " | " << rate(row.exact) << " | " << rate(row.rotor) << " | " << rate(row.wrong) << " | ";
    std::sort(row.late.begin(), row.late.end());
    if (row.late.empty())
      text << "– |\n";
    else
      text << row.late[row.late.size() / 2] << " s of " << row.late.size() << " |\n";
  }
  return text.str();
}

}  // namespace study_worlds
