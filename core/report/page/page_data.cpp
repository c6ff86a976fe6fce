// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/page_data.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/files/base64.hpp"
#include "core/report/page/page.hpp"
#include "core/types/text.hpp"

namespace backwash::report {
namespace {

/// Joins what `write` makes of each, with commas.
template <class Things, class Write>
std::string list(const Things& things, const Write& write) {
  std::string text = "[";
  for (const auto& thing : things) {
    if (text.size() > 1) text += ',';
    text += write(thing);
  }
  text += ']';
  return text;
}

std::string json_number(double value) {
  if (!std::isfinite(value)) return "null";
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

std::string object(std::initializer_list<std::pair<const char*, std::string>> fields) {
  std::string text;
  for (const auto& [name, json] : fields) {
    text += text.empty() ? "{\"" : ",\"";
    text += name;
    text += "\":";
    text += json;
  }
  text += '}';
  return text;
}

std::string array(const std::vector<std::string>& entries) {
  return list(entries, [](const std::string& json) { return json; });
}

std::string to_json(const DataTable& t) {
  return object({{"id", script_quoted(t.id)},
                 {"before", std::to_string(t.before)},
                 {"columns", list(t.columns, script_quoted)},
                 {"rows", list(t.rows, [](const auto& row) { return list(row, json_number); })}});
}

std::string to_json(const TimePlot& p) {
  const auto curve = [](const Curve& c) {
    return object({{"column", script_quoted(c.column)},
                   {"name", script_quoted(c.name)},
                   {"mirrored", c.mirrored ? "true" : "false"},
                   {"kind", script_quoted(to_string(c.kind))}});
  };
  return object({{"id", script_quoted(p.id)},
                 {"table", script_quoted(p.table)},
                 {"name", script_quoted(p.name)},
                 {"unit", script_quoted(p.unit)},
                 {"curves", list(p.curves, curve)}});
}

std::string to_json(const ModeSpan& m) {
  return array({json_number(m.from_s), json_number(m.until_s), script_quoted(m.mode), script_quoted(m.reason)});
}

template <class Three>
std::string json_point(const Three& p) {
  return array({json_number(p.x()), json_number(p.y()), json_number(p.z())});
}

std::string to_json(const Scene& s) {
  const auto prism = [](const Prism& p) {
    std::vector<std::string> corners;
    for (const Vec3& c : octagon(p.half_widths))
      for (const double value : {c.x(), c.y()}) corners.push_back(json_number(value));
    return array({json_point(p.center_W), json_number(p.half_widths[kZ]), array(corners)});
  };
  std::string map = "null";
  if (s.faces) {
    std::vector<int> faces;
    for (const auto& f : s.faces->faces)
      for (const int n : {f.side, f.plane, f.low[0], f.low[1], f.high[0], f.high[1]}) faces.push_back(n);
    map = object({{"origin", json_point(s.faces->origin_W)},
                  {"side", json_number(s.faces->side_m)},
                  {"faces", list(faces, [](int n) { return std::to_string(n); })}});
  }
  return object({{"path", script_quoted(s.path)},
                 {"radius", json_number(s.body_radius_m)},
                 {"tube", list(s.tube, prism)},
                 {"map", map}});
}

/// Codes as two bytes each, the lower one first.
std::string to_json(const FieldBox& box) {
  std::string bytes;
  for (const reach::BoundCode code : box.codes) {
    bytes += static_cast<char>(code & 0xff);
    bytes += static_cast<char>(code >> 8);
  }
  const auto stop = [](const PaletteStop& s) { return array({json_number(s.share), script_quoted(s.colour)}); };
  return object({{"first", json_point(box.first_W)},
                 {"side", json_number(box.side_m)},
                 {"stride", json_point(box.stride)},
                 {"count", json_point(box.count)},
                 {"level", std::to_string(box.level)},
                 {"palette", list(kFieldPalette, stop)},
                 {"codes", script_quoted(files::base64(bytes))}});
}

/// Rows of a group that hold an extreme of a column, its first and its last.
std::set<std::size_t> envelope(const DataTable& table, std::size_t from, std::size_t until) {
  std::set<std::size_t> kept{from, until - 1};
  for (std::size_t c = 1; c < table.columns.size(); ++c) {
    std::optional<std::size_t> least, greatest;
    for (std::size_t n = from; n < until; ++n) {
      const double value = table.rows[n][c];
      if (std::isnan(value)) continue;
      if (!least || value < table.rows[*least][c]) least = n;
      if (!greatest || value > table.rows[*greatest][c]) greatest = n;
    }
    if (least) kept.insert({*least, *greatest});
  }
  return kept;
}

std::size_t column_of(const DataTable& table, const Curve& curve) {
  return static_cast<std::size_t>(std::ranges::find(table.columns, curve.column) - table.columns.begin());
}

/// Whether the table has a value of it.
bool has_values(const DataTable& table, const TimePlot& plot) {
  return std::ranges::any_of(plot.curves, [&](const Curve& curve) {
    const std::size_t column = column_of(table, curve);
    return std::ranges::any_of(table.rows, [&](const auto& row) { return !std::isnan(row[column]); });
  });
}

/// Its stretches without a gap.
std::vector<Run> runs_of(const DataTable& table, const Curve& curve, double sign) {
  const std::size_t column = column_of(table, curve);
  std::vector<Run> runs(1);
  for (const auto& row : table.rows) {
    if (std::isnan(row[column])) {
      if (!runs.back().empty()) runs.emplace_back();
    } else {
      runs.back().push_back({row[0], sign * row[column]});
    }
  }
  return runs;
}

Chart chart_of(const DataTable& table, const TimePlot& plot, const std::string& along) {
  Chart chart{.x = {.name = along}, .y = {.name = plot.name + ", " + plot.unit}, .plot = plot.id};
  if (!table.rows.empty()) chart.x = {along, table.rows.front()[0], table.rows.back()[0]};
  for (const auto& curve : plot.curves) {
    const auto runs = runs_of(table, curve, 1);
    auto below = runs_of(table, curve, -1);
    if (curve.mirrored && curve.kind == Kind::bound) {
      auto band = runs;
      for (std::size_t n = 0; n < band.size(); ++n) band[n].insert(band[n].end(), below[n].rbegin(), below[n].rend());
      chart.layers.insert(chart.layers.begin(), {Shape::area, Kind::band, "", std::move(band)});
    }
    if (curve.mirrored) chart.layers.push_back({curve.shape, curve.kind, "", std::move(below)});
    chart.layers.push_back({curve.shape, curve.kind, curve.name, runs});
  }
  return chart;
}

}  // namespace

DataTable thinned(DataTable table, std::size_t most) {
  if (table.rows.size() <= most) return table;
  const std::size_t groups = std::max<std::size_t>(1, most / (2 * table.columns.size()));
  std::vector<std::vector<double>> rows;
  for (std::size_t g = 0; g < groups; ++g) {
    const std::size_t from = g * table.rows.size() / groups, until = (g + 1) * table.rows.size() / groups;
    for (const std::size_t n : envelope(table, from, until)) rows.push_back(std::move(table.rows[n]));
  }
  table.before = table.rows.size();
  table.rows = std::move(rows);
  return table;
}

std::vector<Prism> at_intervals(const std::vector<Prism>& tube, double step, std::size_t most) {
  double way = 0;
  for (std::size_t k = 1; k < tube.size(); ++k) way += (tube[k].center_W - tube[k - 1].center_W).norm();
  step = std::max(step, way / static_cast<double>(most));
  std::vector<Prism> kept;
  double since = step;
  for (std::size_t k = 0; k < tube.size(); ++k) {
    if (k > 0) since += (tube[k].center_W - tube[k - 1].center_W).norm();
    if (since < step) continue;
    kept.push_back(tube[k]);
    since = 0;
  }
  return kept;
}

std::string files_html(const std::vector<std::string>& tables) {
  std::string names;
  for (const auto& table : tables) names += (names.empty() ? "" : " ") + table;
  return "<p class=\"files\" data-tables=\"" + escaped(names) + "\"></p>\n";
}

std::string to_html(const Section& section) {
  return report::section(section.title, section.text, section.drawing + files_html(section.tables));
}

std::string plotted(PageData& data, const DataTable& table, const std::vector<TimePlot>& plots) {
  std::string html;
  for (const auto& plot : plots)
    html += to_svg(chart_of(table, plot, data.along + (data.along_unit.empty() ? "" : ", " + data.along_unit))) + "\n";
  data.plots.insert(data.plots.end(), plots.begin(), plots.end());
  if (!table.rows.empty() && std::ranges::find(data.tables, table.id, &DataTable::id) == data.tables.end())
    data.tables.push_back(table);
  return html;
}

void add_plots(std::vector<Section>& sections, PageData& data, DataTable table, const std::string& title,
               const std::string& text, std::vector<TimePlot> plots) {
  std::string without;
  std::erase_if(plots, [&](const TimePlot& plot) {
    if (has_values(table, plot)) return false;
    without += (without.empty() ? "" : ", ") + plot.name;
    return true;
  });
  if (!without.empty()) without = " Not drawn, because the log has no value of it: " + without + ".";
  sections.push_back({title, text + without, plotted(data, table, plots), {}});
  if (!table.rows.empty()) sections.back().tables.push_back(table.id);
}

std::vector<Vec3> octagon(const PerDirection& h) {
  std::vector<Vec3> corners = {{h[kX], -h[kY], 0}, {h[kX], h[kY], 0}, {-h[kX], h[kY], 0}, {-h[kX], -h[kY], 0}};
  for (const auto& [d, sign] : {std::pair{kXyPlus, 1.0}, {kXyPlus, -1.0}, {kXyMinus, 1.0}, {kXyMinus, -1.0}}) {
    const Vec3 n = sign * unit(d);
    std::vector<Vec3> kept;
    for (std::size_t i = 0; i < corners.size(); ++i) {  // Sutherland and Hodgman's clip at n·e = h
      const Vec3 &from = corners[i], &to = corners[(i + 1) % corners.size()];
      const double a = n.dot(from) - h[d], b = n.dot(to) - h[d];
      if (a <= 0) kept.push_back(from);
      if ((a < 0 && b > 0) || (a > 0 && b < 0)) kept.push_back(from + a / (a - b) * (to - from));
    }
    corners = std::move(kept);
  }
  return corners;
}

std::string script_quoted(const std::string& text) {
  std::string quoted = nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  for (auto at = quoted.find('<'); at != quoted.npos; at = quoted.find('<', at)) quoted.replace(at, 1, "\\u003c");
  return quoted;
}

std::string to_json(const PageData& data) {
  const auto any = [](const auto& thing) { return to_json(thing); };
  return object({{"tables", list(data.tables, any)},
                 {"plots", list(data.plots, any)},
                 {"along", array({script_quoted(data.along), script_quoted(data.along_unit)})},
                 {"modes", list(data.modes, any)},
                 {"scene", data.scene ? to_json(*data.scene) : "null"},
                 {"field", data.field ? to_json(*data.field) : "null"}});
}

std::string scene_html(const Scene& scene) {
  std::string words = "The path flown, its commands, and the sets predicted for it";
  if (scene.faces) {
    words += "; obstacles up to " + to_text(scene.faces->around_m, 0) +
             " m around the path, where free space meets them: a ceiling does not hide the room below it.";
    if (scene.faces->left_out > 0)
      words += std::string(" ") + std::to_string(scene.faces->left_out) + " of " +
               std::to_string(scene.faces->left_out + scene.faces->faces.size()) +
               " rectangles are left out, the nearest of them " + to_text(scene.faces->beyond_m, 1) +
               " m from the path.";
  } else {
    words += "; no map was recorded.";
  }
  return "<section id=\"scene\"><h2>In three dimensions</h2>\n<p>" + words +
         "</p>\n<p class=\"note\">Shown where scripts run and WebGL is there.</p>\n<div "
         "class=\"scene\"></div>\n</section>\n";
}

}  // namespace backwash::report
