// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/chart.hpp"

#include <algorithm>
#include <cmath>

#include "core/files/base64.hpp"
#include "core/files/png.hpp"
#include "core/report/page/page.hpp"
#include "core/types/formatted.hpp"
#include "core/types/text.hpp"

namespace backwash::report {
namespace {

struct Look {
  const char *name, *colour;
  double width;
  const char* dashes;
};

Look look_of(Kind kind) {
  switch (kind) {
    case Kind::flown:
      return {"flown", "#0b3d91", 2, ""};
    case Kind::commanded:
      return {"commanded", "#b3263c", 1.5, "7 4"};
    case Kind::bound:
      return {"bound", "#2f77ba", 1.5, ""};
    case Kind::paper:
      return {"paper", "#6b6b6b", 1.2, "4 4"};
    case Kind::band:
      return {"band", "#dbe9f6", 0, ""};
    case Kind::tube:
      return {"tube", "#9cc6ec", 3, ""};
    case Kind::body:
      return {"body", "#e3eef9", 3, ""};
    case Kind::occupied:
      return {"occupied", "#3c3c42", 0, ""};
    case Kind::unknown:
      return {"unknown", "#d5d5d5", 0, ""};
    case Kind::before:
      return {"before", "#c0561d", 2, ""};
    case Kind::after:
      return {"after", "#1f6f9f", 2, ""};
    default:
      return {"measured", "#8a8a8a", 1, ""};
  }
}

constexpr double kWidth = 1000, kLeft = 70, kTop = 26, kBelow = 44, kHighest = 700;

/// A window of a chart and where it is drawn, pixels.
struct Frame {
  Axis x, y;
  double left = kLeft, top = kTop, width, height;

  double at_x(double value) const { return left + (value - x.low) / (x.high - x.low) * width; }
  double at_y(double value) const { return top + (y.high - value) / (y.high - y.low) * height; }
  /// "x y" in pixels.
  std::string at(const Place& p) const { return formatted("%.2f %.2f", at_x(p.x()), at_y(p.y())); }
};

/// Gives an axis the range of what is drawn along it, and a little more.
void widen(Axis& axis, const Chart& chart, int along) {
  if (axis.low > axis.high) {
    for (const auto& layer : chart.layers)
      for (const auto& run : layer.runs)
        for (const auto& place : run) {
          axis.low = std::min(axis.low, place[along]);
          axis.high = std::max(axis.high, place[along]);
        }
    const double more = 0.04 * (axis.high - axis.low) * along;  // curves reach both sides
    axis.low -= more;
    axis.high += more;
  }
  if (!(axis.low <= axis.high)) axis.low = axis.high = 0;  // nothing is drawn
  if (axis.high - axis.low < 1e-9) {
    axis.low -= 0.5;
    axis.high += 0.5;
  }
}

Frame frame_of(const Chart& chart) {
  Frame frame{.x = chart.x, .y = chart.y, .width = kWidth - kLeft - (chart.scale_to > 0 ? 110 : 14), .height = 0};
  widen(frame.x, chart, 0);
  widen(frame.y, chart, 1);
  frame.height = chart.height - kTop - kBelow;
  if (chart.equal) {
    const double wide = frame.x.high - frame.x.low, tall = frame.y.high - frame.y.low;
    const double per_metre = std::min(frame.width / wide, kHighest / tall);
    frame.width = per_metre * wide;
    frame.height = per_metre * tall;
  }
  return frame;
}

/// Round numbers within a range, about so many.
std::vector<double> steps(double low, double high, double about) {
  const double rough = (high - low) / about, power = std::pow(10, std::floor(std::log10(rough)));
  const double step = power * (rough > 5 * power ? 10 : rough > 2 * power ? 5 : rough > power ? 2 : 1);
  std::vector<double> all;
  for (double n = std::ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; ++n) all.push_back(n * step + 0.0);
  return all;
}

std::string text(double x, double y, const char* more, const std::string& words) {
  return formatted("<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, more) + escaped(words) + "</text>";
}

/// Lines and numbers of both axes; the script replaces what is in it where it zooms.
std::string tics(const Frame& f) {
  std::string svg = "<g class=\"tics\">";
  const auto said = [](const Axis& axis, double value) {
    return formatted(axis.logarithmic ? "%.2g" : "%.6g", axis.logarithmic ? std::pow(10, value) : value);
  };
  const double right = f.left + f.width, bottom = f.top + f.height;
  const auto across = [&](double value, const std::string& words) {
    const double x = f.at_x(value);
    svg += formatted("<path d=\"M%.1f %.1fV%.1f\"/>", x, f.top, bottom) + text(x, bottom + 17, "", words);
  };
  if (f.x.words.empty())
    for (const double value : steps(f.x.low, f.x.high, f.width / 110)) across(value, said(f.x, value));
  for (std::size_t n = 0; n < f.x.words.size(); ++n) across(static_cast<double>(n) + 1, f.x.words[n]);
  const auto along = [&](double value) {
    svg += formatted("<path d=\"M%.1f %.1fH%.1f\"/>", f.left, f.at_y(value), right);
    return f.at_y(value);
  };
  if (f.y.words.empty())
    for (const double value : steps(f.y.low, f.y.high, f.height / 45))
      svg += text(f.left - 6, along(value) + 4, "text-anchor=\"end\"", said(f.y, value));
  for (std::size_t n = 0; n < f.y.words.size(); ++n)
    svg += text(f.left + 6, along(static_cast<double>(n) + 1) - 6, "text-anchor=\"start\"", f.y.words[n]);
  return svg + "</g>";
}

std::string image(const Raster& raster, double x, double y, double width, double height) {
  std::vector<std::uint32_t> down;  // rows from the top
  for (std::size_t end = raster.rgba.size(); end > 0; end -= raster.width)
    down.insert(down.end(), raster.rgba.begin() + static_cast<std::ptrdiff_t>(end - raster.width),
                raster.rgba.begin() + static_cast<std::ptrdiff_t>(end));
  return formatted("<image class=\"%s\" x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" ",
                   raster.cells ? "cells" : "field", x, y, width, height) +
         "preserveAspectRatio=\"none\" style=\"image-rendering: pixelated\" href=\"data:image/png;base64," +
         files::base64(files::png(raster.width, down)) + "\"/>";
}

std::string drawn(const Layer& layer, const Frame& f) {
  const Look look = look_of(layer.kind);
  std::string path;
  std::size_t places = 0;
  for (const auto& run : layer.runs) {
    places += run.size();
    const char* to = "M";
    for (const auto& place : run) {
      path += to;
      path += f.at(place);
      if (layer.shape == Shape::dots) path += "h0";
      to = layer.shape == Shape::dots ? "M" : "L";
    }
    if (layer.shape == Shape::area) path += 'Z';
  }
  if (path.empty()) return "";
  std::string svg = formatted("<path class=\"%s\" color=\"%s\" ", look.name, look.colour);
  if (layer.shape == Shape::area)
    svg += "fill=\"currentColor\" ";  // the border is drawn below: only that of the union remains
  else
    svg += "fill=\"none\" stroke-linecap=\"round\" ";
  const double width = layer.shape == Shape::dots ? (places > 100 ? 3.5 : 8) : look.width;
  if (width > 0)
    svg += formatted("stroke=\"%s\" stroke-width=\"%.1f\" ", layer.shape == Shape::area ? "#4a8fce" : "currentColor",
                     width);
  if (layer.shape == Shape::dots && layer.name.empty()) svg += "stroke-opacity=\"0.35\" ";  // a cloud behind lines
  if (layer.shape == Shape::line && *look.dashes) svg += formatted("stroke-dasharray=\"%s\" ", look.dashes);
  return svg + "paint-order=\"stroke\" vector-effect=\"non-scaling-stroke\" d=\"" + path + "\"/>";
}

std::string legend(const Chart& chart) {
  std::string svg;
  double x = kLeft;
  for (const auto& layer : chart.layers) {
    if (layer.name.empty()) continue;
    const Look look = look_of(layer.kind);
    svg += formatted("<path class=\"%s\" color=\"%s\" stroke=\"currentColor\" stroke-width=\"%.1f\" ", look.name,
                     look.colour, layer.shape == Shape::line ? look.width : 9.0) +
           (layer.shape == Shape::line && *look.dashes ? formatted("stroke-dasharray=\"%s\" ", look.dashes) : "") +
           formatted("d=\"M%.1f 12h22\"/>", x) + text(x + 28, 16, "text-anchor=\"start\"", layer.name);
    const auto letters = std::ranges::count_if(layer.name, [](char c) { return (c & 0xc0) != 0x80; });
    x += 46 + 7.6 * static_cast<double>(letters);
  }
  return svg;
}

/// The palette's bar, with its numbers and what they are.
std::string scale(const Chart& chart, const Frame& f) {
  Raster bar{.low = {}, .high = {}, .width = 1, .rgba = {}};
  for (int n = 0; n < 64; ++n) bar.rgba.push_back(palette_colour(n / 63.0));
  const double x = f.left + f.width + 16;
  std::string svg = image(bar, x, f.top, 14, f.height);
  for (const double value : steps(0, chart.scale_to, f.height / 45))
    svg += text(x + 20, f.top + f.height * (1 - value / chart.scale_to) + 4, "text-anchor=\"start\"",
                formatted("%.6g", value));
  const double middle = f.top + f.height / 2;
  return svg + text(x + 76, middle, formatted("transform=\"rotate(-90 %.1f %.1f)\"", x + 76, middle).c_str(),
                    chart.scale_name);
}

/// Height of the whole chart, pixels.
double height_of(const Frame& f) { return f.top + f.height + kBelow; }

std::string body(const Chart& chart, const Frame& f) {
  const double middle = f.top + f.height / 2;
  std::string svg = tics(f) + text(f.left + f.width / 2, height_of(f) - 8, "", chart.x.name) +
                    text(14, middle, formatted("transform=\"rotate(-90 14 %.1f)\"", middle).c_str(), chart.y.name) +
                    legend(chart) + "<g class=\"seen\"><g class=\"area\">";
  for (const auto& r : chart.rasters)
    svg += image(r, f.at_x(r.low.x()), f.at_y(r.high.y()), f.at_x(r.high.x()) - f.at_x(r.low.x()),
                 f.at_y(r.low.y()) - f.at_y(r.high.y()));
  for (const auto& layer : chart.layers) svg += drawn(layer, f);
  svg += "</g>";
  for (const auto& [place, words] : chart.marks)
    svg += "<g class=\"mark\" transform=\"translate(" + f.at(place) + ")\"><circle r=\"4\"/>" +
           text(8, -6, "text-anchor=\"start\"", words) + "</g>";
  return svg + "</g>" + (chart.scale_to > 0 ? scale(chart, f) : "");
}

const char* const kText =
    "font-family=\"DejaVu Sans, sans-serif\" font-size=\"13\" fill=\"currentColor\" text-anchor=\"middle\"";

}  // namespace

const char* to_string(Kind kind) { return look_of(kind).name; }

std::uint32_t palette_colour(double share) {
  const auto next = std::max(kFieldPalette.begin() + 1, std::ranges::find_if(kFieldPalette, [&](const PaletteStop& s) {
                               return s.share >= std::min(share, 1.0);
                             }));
  const auto& from = *(next - 1);
  const double part = (std::min(share, 1.0) - from.share) / (next->share - from.share);
  const auto a = std::stoul(from.colour + 1, nullptr, 16), b = std::stoul(next->colour + 1, nullptr, 16);
  std::uint32_t colour = 0;
  for (const int shift : {16, 8, 0})
    colour = colour << 8 | static_cast<std::uint32_t>(std::lround((1 - part) * static_cast<double>(a >> shift & 255) +
                                                                  part * static_cast<double>(b >> shift & 255)));
  return colour << 8 | 255;
}

std::string to_svg(const Chart& chart) {
  const Frame f = frame_of(chart);
  std::string svg = formatted("<svg class=\"chart\" viewBox=\"0 0 1000 %.0f\" ", height_of(f)) + kText;
  if (!chart.plot.empty()) svg += " data-plot=\"" + escaped(chart.plot) + '"';
  svg += formatted(" data-area=\"%.2f %.2f %.2f %.2f\"", f.left, f.top, f.width, f.height);
  if (chart.x.words.empty())
    svg += formatted(" data-window=\"%.9g %.9g %.9g %.9g\"", f.x.low, f.x.high, f.y.low, f.y.high);
  if (chart.equal) svg += " data-equal";
  if (chart.y.logarithmic) svg += " data-logarithmic";
  return svg + ">" + body(chart, f) + "</svg>";
}

std::string picture_file(std::span<const Chart> charts, const std::string& name) {
  if (name.ends_with(".png")) {
    std::vector<std::uint32_t> pixels;
    std::size_t width = 1;
    for (const auto& chart : charts)
      for (const auto& raster : chart.rasters) {
        const std::size_t k = std::max<std::size_t>(1, 800 / raster.width);  // a voxel is so many pixels wide
        width = k * raster.width;
        for (std::size_t row = k * raster.rgba.size() / raster.width; row-- > 0;)
          for (std::size_t x = 0; x < width; ++x) pixels.push_back(raster.rgba[row / k * raster.width + x / k]);
      }
    return files::png(width, pixels);
  }
  std::string svg;
  double below = 0;
  for (const auto& chart : charts) {
    const Frame f = frame_of(chart);
    svg += formatted("<g transform=\"translate(0 %.0f)\">", below) + body(chart, f) + "</g>\n";
    below += height_of(f);
  }
  return formatted("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1000 %.0f\" ", below) + kText +
         "><style>svg { background: white } .tics path { stroke: #d5dbe2 }</style>\n" + svg + "</svg>\n";
}

}  // namespace backwash::report
