// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/recorded_tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/log/tick_log.hpp"

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

/// Adds the section if the table has rows.
void add(std::vector<Section>& sections, PageData& data, DataTable table, const char* title, const char* text,
         std::vector<TimePlot> plots) {
  if (table.rows.size() < 2) return;
  auto drawing = plots_figure(table, plots);
  sections.push_back({title, text, std::move(drawing), plots, {table.id}});
  data.tables.push_back(std::move(table));
  data.plots.insert(data.plots.end(), plots.begin(), plots.end());
}

}  // namespace

std::optional<std::int64_t> first_tick_ns(std::span<const log::RawRecord> log, std::optional<std::uint64_t> segment) {
  for (const auto& record : log) {
    if (record.header.kind != RecordKind::tick) continue;
    const auto* tick = log::payload<log::TickRecord>(record);
    if (tick && (!segment || tick->segment == *segment)) return record.header.t_ns;
  }
  return std::nullopt;
}

std::optional<std::uint64_t> first_segment(std::span<const log::RawRecord> log) {
  for (const auto& record : log)
    if (record.header.kind == RecordKind::segment)
      if (const auto* head = log::payload<log::SegmentRecord>(record)) return head->id;
  return std::nullopt;
}

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
    plot.curves.push_back({"error_" + axis + "_m", "measured − predicted centre", "flown"});
    plot.curves.push_back({"bound_" + axis + "_m", "bound", "bound", true});
    if (ellipsoids) plot.curves.push_back({"ellipsoid_" + axis + "_m", "bound of the ellipsoids", "paper", true});
    plots.push_back(std::move(plot));
  }
  return plots;
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
  add(sections, data, tick_table(log, zero_ns), "Tick timing",
      "As each tick logged it: of the tick before it how long it computed and how late it began; and from a sample's "
      "reception to the set-point that first used it.",
      {{"ticks-compute",
        "ticks",
        "computing, late",
        "µs",
        {{"compute_us", "computing", "flown"}, {"lateness_us", "late", "commanded"}}},
       {"ticks-wire", "ticks", "odometry to wire", "µs", {{"odometry_to_wire_us", "odometry to wire", "flown"}}}});
  add(sections, data, rate_table(log, zero_ns), "Link and odometry rates",
      "Records of each whole second: odometry taken, MAVLink frames received and sent, control ticks.",
      {{"rates-link",
        "rates",
        "frames",
        "1/s",
        {{"frames_in_hz", "received", "flown"}, {"frames_out_hz", "sent", "commanded"}}},
       {"rates-odometry",
        "rates",
        "odometry, ticks, scans",
        "1/s",
        {{"odometry_hz", "odometry", "flown"}, {"ticks_hz", "ticks", "bound"}, {"scans_hz", "scans", "paper"}}}});
  add(sections, data, battery_table(log, zero_ns), "Battery", "Remaining share, as the autopilot says it.",
      {{"battery", "battery", "battery", "share", {{"battery_share", "remaining", "flown"}}}});
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
