// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/recorded_tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/log/raw/air_log.hpp"
#include "core/log/raw/tick_log.hpp"
#include "core/report/figures.hpp"
#include "core/report/recorded_map.hpp"
#include "core/types/text.hpp"

namespace backwash::report {
namespace {

using log::RecordKind;

double seconds_since(const log::RawRecord& record, std::int64_t zero_ns) {
  return 1e-9 * static_cast<double>(record.header.t_ns - zero_ns);
}

/// Calls `take` with each record of a kind whose payload is a T.
template <class T, class Take>
void each(std::span<const log::RawRecord> log, RecordKind kind, const Take& take) {
  for (const auto& record : log)
    if (record.header.kind == kind)
      if (const auto* row = log::payload<T>(record)) take(record, *row);
}

DataTable tick_table(std::span<const log::RawRecord> log, std::int64_t zero_ns) {
  DataTable table{"ticks", {"t_s", "compute_us", "lateness_us", "odometry_to_wire_us", "missed_periods"}, {}, 0};
  each<log::TickRecord>(log, RecordKind::tick, [&](const auto& record, const log::TickRecord& tick) {
    const double wire = tick.odometry_to_wire_us;
    table.rows.push_back({seconds_since(record, zero_ns), tick.compute_us, tick.lateness_us, wire < 0 ? kNoValue : wire,
                          static_cast<double>(tick.missed_periods)});
  });
  return thinned(std::move(table));
}

/// How many records of each kind each whole second holds.
DataTable rate_table(std::span<const log::RawRecord> log, std::int64_t zero_ns) {
  constexpr std::array kCounted{RecordKind::odometry, RecordKind::frame_in, RecordKind::frame_out, RecordKind::tick,
                                RecordKind::scan};
  DataTable table{"rates", {"t_s", "odometry_hz", "frames_in_hz", "frames_out_hz", "ticks_hz", "scans_hz"}, {}, 0};
  std::map<long, std::array<double, kCounted.size()>> seconds;
  for (const auto& record : log) {
    const auto kind = std::ranges::find(kCounted, record.header.kind);
    if (kind != kCounted.end())
      ++seconds[static_cast<long>(std::floor(seconds_since(record, zero_ns)))]
               [static_cast<std::size_t>(kind - kCounted.begin())];
  }
  if (seconds.size() < 3) return table;
  // The first and the last are no whole ones; a second in which nothing came is one with zeros.
  const long from = seconds.begin()->first + 1, until = seconds.rbegin()->first;
  for (long s = from; s < until; ++s) {
    table.rows.push_back({static_cast<double>(s)});
    for (const double count : seconds[s]) table.rows.back().push_back(count);
  }
  return thinned(std::move(table));
}

DataTable battery_table(std::span<const log::RawRecord> log, std::int64_t zero_ns) {
  DataTable table{"battery", {"t_s", "battery_share"}, {}, 0};
  std::optional<std::vector<double>> last;
  each<log::TickInputRecord>(log, RecordKind::tick_input, [&](const auto& record, const log::TickInputRecord& input) {
    const auto share = log::decode(input, nullptr).autopilot.battery;
    if (!share) return;
    last = {seconds_since(record, zero_ns), *share};
    if (table.rows.empty() || table.rows.back()[1] != *share) table.rows.push_back(*last);
  });
  if (last && table.rows.back()[0] < (*last)[0]) table.rows.push_back(*last);
  return thinned(std::move(table));
}

/// Alpha of the log's start; nothing: it learns of no air.
std::optional<double> alpha_of(std::span<const log::RawRecord> log) {
  std::optional<double> alpha;
  each<log::AirConstantsRecord>(log, RecordKind::air_constants, [&](const auto&, const auto& c) { alpha = c.alpha; });
  return alpha;
}

std::string column(const char* what, std::size_t k) {
  return std::string(what) + "_" + to_string(static_cast<AirClass>(k));
}

/// A plot of one of its quantities, a curve for each class.
TimePlot air_plot(const DataTable& table, const char* what, const char* name, const char* unit) {
  constexpr std::array kKinds{Kind::flown, Kind::commanded, Kind::paper, Kind::bound};
  TimePlot plot{std::string("air-") + what, table.id, name, unit, {}};
  for (std::size_t k = 0; k < kAirClasses; ++k)
    if (std::ranges::find(table.columns, column(what, k)) != table.columns.end())
      plot.curves.push_back({column(what, k), std::string(to_string(static_cast<AirClass>(k))),
                             kKinds[plot.curves.size() % kKinds.size()]});
  return plot;
}

/// The way from above, a colour for each class that was flown in, with the factor that it has at the end.
std::string rough_places(const DataTable& table, const map::OccupancyGrid& grid) {
  constexpr std::array kKinds{Kind::flown, Kind::commanded, Kind::bound, Kind::before, Kind::measured};
  std::array<Run, kAirClasses> places;
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (const auto& row : table.rows) {
    const Vec3 p(row[1], row[2], row[3]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    places[static_cast<std::size_t>(row[4])].push_back(p.head<2>());
  }
  const Vec3 around(1, 1, 0);
  Chart chart = seen_from_above(grid, low - around, high + around, low.z(), high.z());
  for (std::size_t k = 0; k < kAirClasses; ++k) {
    if (places[k].empty()) continue;
    const auto at = std::ranges::find(table.columns, column("factor", k)) - table.columns.begin();
    const std::string factor = to_text(table.rows.back()[static_cast<std::size_t>(at)], 2);
    chart.layers.push_back({Shape::dots,
                            kKinds[k % kKinds.size()],
                            std::string(to_string(static_cast<AirClass>(k))) + ", × " + factor,
                            {places[k]}});
  }
  return to_svg(chart);
}

void add_places(std::vector<Section>& sections, std::span<const log::RawRecord> log, const DataTable& table) {
  const auto grid = recorded_map(log);
  if (!grid || table.rows.empty()) return;
  sections.push_back({"Where the air was rough",
                      "The way flown, from above, as far as it was learnt from. Its colour is the class of the place; "
                      "the legend has the "
                      "factor on the variance that the class has at the end: 1 is as modelled.",
                      rough_places(table, *grid),
                      {table.id}});
}

}  // namespace

DataTable recorded_error(std::span<const log::RawRecord> log, std::int64_t zero_ns) {
  DataTable table{
      "error", {"t_s", "error_x_m", "bound_x_m", "error_y_m", "bound_y_m", "error_z_m", "bound_z_m"}, {}, 0};
  each<log::TickRecord>(log, RecordKind::tick, [&](const auto& record, const log::TickRecord& tick) {
    if (!tick.judged) return;
    table.rows.push_back({seconds_since(record, zero_ns)});
    for (const auto axis : {kX, kY, kZ}) {
      table.rows.back().push_back(tick.p[axis] - tick.center[axis]);
      table.rows.back().push_back(tick.half_widths[axis]);
    }
  });
  return thinned(std::move(table));
}

std::vector<TimePlot> error_plots(bool ellipsoids) {
  std::vector<TimePlot> plots;
  for (const std::string axis : {"x", "y", "z"}) {
    TimePlot plot{"error-" + axis, "error", "error along " + axis, "m", {}};
    plot.curves.push_back({"error_" + axis + "_m", "measured − predicted centre", Kind::flown});
    plot.curves.push_back({"bound_" + axis + "_m", "bound", Kind::bound, true});
    if (ellipsoids) plot.curves.push_back({"ellipsoid_" + axis + "_m", "bound of the ellipsoids", Kind::paper, true});
    plots.push_back(std::move(plot));
  }
  return plots;
}

DataTable recorded_air(std::span<const log::RawRecord> log, std::int64_t zero_ns) {
  DataTable table{"air", {"t_s", "x_m", "y_m", "z_m", "class"}, {}, 0};
  const auto alpha = alpha_of(log);
  if (!alpha) return table;
  std::array<bool, kAirClasses> flown{};
  each<log::AirRecord>(log, RecordKind::air, [&](const auto&, const log::AirRecord& air) {
    flown[std::min<std::size_t>(air.air, 4)] = true;
  });
  for (const char* what : {"factor", "evidence"})
    for (std::size_t k = 0; k < kAirClasses; ++k)
      if (flown[k]) table.columns.push_back(column(what, k));
  std::array<double, kAirClasses> evidences;
  evidences.fill(kNoValue);
  const log::AirRecord* air = nullptr;
  for (const auto& record : log) {
    if (record.header.kind == RecordKind::air) air = log::payload<log::AirRecord>(record);
    const auto* tick = record.header.kind == RecordKind::tick ? log::payload<log::TickRecord>(record) : nullptr;
    if (!tick || !air || air->tick != tick->tick) continue;
    const std::size_t here = std::min<std::size_t>(air->air, kAirClasses - 1);
    evidences[here] = log::evidence(*air, *alpha);
    table.rows.push_back({seconds_since(record, zero_ns), tick->p[0], tick->p[1], tick->p[2], double(here)});
    for (std::size_t k = 0; k < kAirClasses; ++k)
      if (flown[k]) table.rows.back().push_back(air->factors[k]);
    for (std::size_t k = 0; k < kAirClasses; ++k)
      if (flown[k]) table.rows.back().push_back(evidences[k]);
  }
  return thinned(std::move(table));
}

std::vector<Prism> recorded_tube(std::span<const log::RawRecord> log) {
  std::vector<Prism> tube;
  each<log::TickRecord>(log, RecordKind::tick, [&](const auto&, const log::TickRecord& tick) {
    if (!tick.judged) return;
    Prism prism{{tick.center[0], tick.center[1], tick.center[2]}, {}};
    std::copy_n(tick.half_widths, kDirections, prism.half_widths.begin());
    tube.push_back(prism);
  });
  return tube;
}

std::vector<Section> recorded_sections(std::span<const log::RawRecord> log, std::int64_t zero_ns, PageData& data) {
  std::vector<Section> sections;
  const auto add = [&](DataTable table, const char* title, const char* text, std::vector<TimePlot> plots) {
    add_plots(sections, data, std::move(table), title, text, std::move(plots));
  };
  const DataTable air = recorded_air(log, zero_ns);
  if (!air.rows.empty())
    add(air, "Air",
        "What was learnt of it, by class: the factor on the model's variance that the sets were grown by, and the "
        "evidence "
        "that it is above 1, as a share of what it takes.",
        {air_plot(air, "factor", "factor", "× variance"), air_plot(air, "evidence", "evidence", "share")});
  add_places(sections, log, air);
  add(tick_table(log, zero_ns), "Tick timing",
      "As each tick logged it: of the tick before it how long it computed and how late it began; and from a sample's "
      "reception to the set-point that first used it.",
      {{"ticks-compute",
        "ticks",
        "computing, late",
        "µs",
        {{"compute_us", "computing", Kind::flown}, {"lateness_us", "late", Kind::commanded}}},
       {"ticks-wire", "ticks", "odometry to wire", "µs", {{"odometry_to_wire_us", "odometry to wire", Kind::flown}}}});
  add(rate_table(log, zero_ns), "Link and odometry rates",
      "Records of each whole second: odometry taken, MAVLink frames received and sent, control ticks.",
      {{"rates-link",
        "rates",
        "frames",
        "1/s",
        {{"frames_in_hz", "received", Kind::flown}, {"frames_out_hz", "sent", Kind::commanded}}},
       {"rates-odometry",
        "rates",
        "odometry, ticks, scans",
        "1/s",
        {{"odometry_hz", "odometry", Kind::flown},
         {"ticks_hz", "ticks", Kind::bound},
         {"scans_hz", "scans", Kind::paper}}}});
  add(battery_table(log, zero_ns), "Battery", "Remaining share, as the autopilot says it.",
      {{"battery", "battery", "battery", "share", {{"battery_share", "remaining", Kind::flown}}}});
  return sections;
}

std::string recorded_configuration(std::span<const log::RawRecord> log) {
  std::string text;
  for (const auto& record : log)
    if (record.header.kind == RecordKind::configuration)
      text += std::string(record.bytes.begin(), record.bytes.end()) + "\n";
  return text;
}

}  // namespace backwash::report
