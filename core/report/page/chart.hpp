// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/types/geometry.hpp"

/// The one kit that draws: charts as SVG, which the page's script can zoom into and put a cursor on (plots.js).
namespace backwash::report {

using Place = Eigen::Vector2d;  ///< along both axes of a chart, in their units
using Run = std::vector<Place>;

/// Colour and dashes of what is drawn, the same on every page; a dark page has other colours (page.css).
enum class Kind { flown, commanded, bound, paper, band, tube, body, occupied, unknown, before, after, measured };

const char* to_string(Kind kind);

enum class Shape { line, dots, area };
struct Layer {
  Shape shape;
  Kind kind;
  std::string name;       ///< in the legend; empty: none
  std::vector<Run> runs;  ///< lines or outlines each; areas that meet are one
};

/// Pixels over a rectangle of a chart.
struct Raster {
  Place low, high;  ///< outer edges
  std::size_t width;
  std::vector<std::uint32_t> rgba;  ///< 0xRRGGBBAA in rows of `width`, from the lowest one up
  bool cells = false;               ///< occupied and unknown voxels: a dark page turns their shades round
};

struct Axis {
  std::string name;  ///< with its unit
  /// Range; where low is above high, that of what is drawn.
  double low = std::numeric_limits<double>::infinity(), high = -low;
  bool logarithmic = false;             ///< places are common logarithms
  std::vector<std::string> words = {};  ///< at 1, 2, … instead of numbers; of y within the chart
};

struct Chart {
  Axis x, y;
  std::vector<Raster> rasters = {};  ///< below
  std::vector<Layer> layers = {};    ///< each over those before
  std::vector<std::pair<Place, std::string>> marks = {};
  double scale_to = 0;          ///< of the palette, in the unit that its name says; 0: no palette
  std::string scale_name = {};  ///< what the palette shows
  bool equal = false;           ///< a metre is as long on both axes; the height is what that makes it
  int height = 260;             ///< pixels; the width is 1000
  std::string plot = {};        ///< id of the TimePlot that it is
};

/// SVG to stand in a page.
std::string to_svg(const Chart& chart);
/// Charts below each other as a file: SVG, or, where its name ends in .png, their rasters alone.
std::string picture_file(std::span<const Chart> charts, const std::string& name);

/// Colours of a bound from none to the largest: share of the largest, colour.
struct PaletteStop {
  double share;
  const char* colour;
};
inline constexpr std::array<PaletteStop, 6> kFieldPalette{
    {{0, "#f7fbff"}, {0.15, "#d6e6f4"}, {0.35, "#8fc3dd"}, {0.55, "#f6c667"}, {0.78, "#e8703a"}, {1, "#8b1a1a"}}};
/// Its colour at a share of the largest, 0xRRGGBBAA.
std::uint32_t palette_colour(double share);

}  // namespace backwash::report
