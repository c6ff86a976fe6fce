// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/page_data.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "core/files/base64.hpp"
#include "core/report/page/figure_parts.hpp"
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
                   {"kind", script_quoted(c.kind)}});
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

const char* line_of(const std::string& kind) {
  if (kind == "flown") return "linewidth 2 linecolor '#0b3d91'";
  if (kind == "commanded") return "linewidth 1.5 dashtype 2 linecolor '#d1495b'";
  return kind == "bound" ? "linewidth 1.5 linecolor '#4a8fce'" : "linewidth 1.2 dashtype 2 linecolor '#8a8a8a'";
}

/// Whether the table has a value of it.
bool has_values(const DataTable& table, const TimePlot& plot) {
  return std::ranges::any_of(plot.curves, [&](const Curve& curve) {
    const auto column = std::ranges::find(table.columns, curve.column) - table.columns.begin();
    return std::ranges::any_of(table.rows,
                               [&](const auto& row) { return !std::isnan(row[static_cast<std::size_t>(column)]); });
  });
}

}  // namespace

Figure plots_figure(const DataTable& table, const std::vector<TimePlot>& plots) {
  std::ostringstream script;
  script << "$rows << EOD\n";
  for (const auto& row : table.rows) {
    for (const double value : row) std::isnan(value) ? script << "NaN " : script << value << ' ';
    script << '\n';
  }
  script << "EOD\n"
         << kAxes << "set lmargin 10\nset key outside top center horizontal\nset multiplot layout " << plots.size()
         << ",1\n";
  for (const auto& plot : plots) {
    if (&plot == &plots.back()) script << "set xlabel 'time, s'\n";
    script << "set ylabel " << gnuplot_quoted(plot.name + ", " + plot.unit) << "\nplot ";
    for (const auto& curve : plot.curves) {
      const auto column = std::ranges::find(table.columns, curve.column) - table.columns.begin() + 1;
      if (curve.mirrored)
        script << "$rows using 1:(-$" << column << ") with lines " << line_of(curve.kind) << " notitle, ";
      script << "$rows using 1:" << column << " with lines " << line_of(curve.kind) << " title "
             << gnuplot_quoted(curve.name) << (&curve == &plot.curves.back() ? "\n" : ", ");
    }
  }
  script << "unset multiplot\n";
  return draw(script.str(), Format::svg, 1000, 60 + 220 * static_cast<int>(plots.size()));
}

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

std::string to_html(const Section& section) {
  std::string html = "<section><h2>" + section.title + "</h2>\n<p>" + section.text + "</p>\n" + *section.drawing + "\n";
  for (const auto& plot : section.plots) html += "<div class=\"plot\" data-plot=\"" + escaped(plot.id) + "\"></div>\n";
  std::string tables;
  for (const auto& table : section.tables) tables += (tables.empty() ? "" : " ") + table;
  return html + "<p class=\"files\" data-tables=\"" + escaped(tables) + "\"></p>\n</section>\n";
}

void add_plots(std::vector<Section>& sections, PageData& data, DataTable table, const std::string& title,
               const std::string& text, std::vector<TimePlot> plots) {
  std::string without;
  std::erase_if(plots, [&](const TimePlot& plot) {
    if (has_values(table, plot)) return false;
    without += (without.empty() ? "" : ", ") + plot.name;
    return true;
  });
  const std::string said =
      without.empty() ? text : text + " Not drawn, because the log has no value of it: " + without + ".";
  sections.push_back({title, said, plots.empty() ? Figure("") : plots_figure(table, plots), plots, {}});
  data.plots.insert(data.plots.end(), plots.begin(), plots.end());
  if (table.rows.empty()) return;
  sections.back().tables.push_back(table.id);
  data.tables.push_back(std::move(table));
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
