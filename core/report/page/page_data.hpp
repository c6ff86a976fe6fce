// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/report/field_box.hpp"
#include "core/report/map_faces.hpp"
#include "core/report/page/chart.hpp"

namespace backwash::report {

/// What a table has where there is nothing.
inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// The numbers behind a figure; on the page the file ID.csv.
struct DataTable {
  std::string id;
  std::vector<std::string> columns;       ///< units at their ends; the first one rises from row to row
  std::vector<std::vector<double>> rows;  ///< kNoValue: an empty field
  std::size_t before = 0;                 ///< rows before it was thinned; 0: it was not
};

/// A table of at most about `most` rows: of each group of consecutive rows those stay in which a column has its least
/// or its greatest value, and the group's first and last. No peak is lost, and each row that stays is as it was. (The
/// rows of a group that have nothing in a column do not count for it.)
DataTable thinned(DataTable table, std::size_t most = 4000);

/// A column of a table as a curve over the table's first one.
struct Curve {
  std::string column, name;
  Kind kind;
  bool mirrored = false;  ///< its negative, too; of a bound, with what lies between
  Shape shape = Shape::line;
};
struct TimePlot {
  std::string id, table, name, unit;
  std::vector<Curve> curves;
};

/// A part of a page.
struct Section {
  std::string title, text, drawing;  ///< HTML
  std::vector<std::string> tables;   ///< ids, to be had as files
};
std::string to_html(const Section& section);
/// Where the script puts the buttons that give tables as files.
std::string files_html(const std::vector<std::string>& tables);

/// A set predicted for some moment: |unit(d)·(p − center)| ≤ half_widths[d].
struct Prism {
  Vec3 center_W;  ///< m
  PerDirection half_widths;
};
/// What is looked at in three dimensions.
struct Scene {
  std::string path;         ///< id of a table with x_m, y_m, z_m and command_x_m, …
  std::vector<Prism> tube;  ///< at intervals
  std::optional<MapFaces> faces;
  double body_radius_m = 0;
};
/// Those at least `step` (m) apart, and more where there would be more than `most`.
std::vector<Prism> at_intervals(const std::vector<Prism>& tube, double step = 0.15, std::size_t most = 100);

struct ModeSpan {
  double from_s, until_s;
  std::string mode, reason;
};

/// What the scripts of a page work on.
struct PageData {
  std::vector<DataTable> tables;
  std::vector<TimePlot> plots;
  std::string along = "time", along_unit = "s";  ///< what the cursor of all plots moves along
  std::vector<ModeSpan> modes;
  std::optional<Scene> scene;
  std::optional<FieldBox> field;  ///< the page makes the table "field" of its layer
};

/// Adds plots of a table over its first column, below each other, to `data`, with the table; what draws them.
std::string plotted(PageData& data, const DataTable& table, const std::vector<TimePlot>& plots);

/// Adds a section of such plots. A plot that the table has no value for is none, and the section says so.
void add_plots(std::vector<Section>& sections, PageData& data, DataTable table, const std::string& title,
               const std::string& text, std::vector<TimePlot> plots);

/// Text as a string of JSON that may stand inside a script element whatever it holds: nothing in it ends one, and it is
/// ASCII alone. The one way of text into a script.
std::string script_quoted(const std::string& text);
/// The data as JSON, fit for a script element. Numbers have 9 significant digits.
std::string to_json(const PageData& data);
/// The section that the scene is drawn in; it has no static drawing.
std::string scene_html(const Scene& scene);
/// Corners of {e : |unit(d)·e| ≤ h_d} seen from above, relative to its centre, counter-clockwise, m.
std::vector<Vec3> octagon(const PerDirection& half_widths);

}  // namespace backwash::report
