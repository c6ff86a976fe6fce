// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/figures.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <sstream>

#include "core/files/png.hpp"
#include "core/types/formatted.hpp"

namespace backwash::report {
namespace {

TEST(Octagon, HasTheHalfWidthsAsItsSupports) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(0.9, 1.1);
  for (int n = 0; n < 200; ++n) {
    // Near-regular octagons: every face touches.
    PerDirection h{draw(random), draw(random), 1.0, draw(random), draw(random)};
    const auto corners = octagon(h);
    ASSERT_EQ(corners.size(), 8u);
    for (const auto d : {kX, kY, kXyPlus, kXyMinus}) {
      double high = -1e9, low = 1e9;
      for (const auto& c : corners) {
        high = std::max(high, unit(d).dot(c));
        low = std::min(low, unit(d).dot(c));
      }
      EXPECT_NEAR(high, h[d], 1e-12);
      EXPECT_NEAR(low, -h[d], 1e-12);
    }
    double area = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const auto &a = corners[i], &b = corners[(i + 1) % 8];
      area += (a.x() * b.y() - a.y() * b.x()) / 2;
    }
    EXPECT_GT(area, 0) << "counter-clockwise";
  }
}

TEST(Octagon, IsTheBoxWhereDiagonalsDoNotBind) {
  const auto corners = octagon({1, 2, 0, 9, 9});
  EXPECT_EQ(corners.size(), 4u);
}

/// Numbers of an attribute.
std::vector<double> numbers(const std::string& svg, const std::string& attribute) {
  const auto from = svg.find(attribute + "=\"") + attribute.size() + 2;
  std::istringstream text(svg.substr(from, svg.find('"', from) - from));
  return {std::istream_iterator<double>(text), {}};
}

TEST(Chart, PutsEachPlaceWhereItsAxesSayAndNamesThem) {
  const Chart chart{.x = {"way, m", 0, 10},
                    .y = {"z <m>", -1, 1},
                    .layers = {{Shape::line, Kind::flown, "flown", {{{0, -1}, {2.5, 0}, {10, 1}}}}}};
  const auto svg = to_svg(chart);
  EXPECT_TRUE(svg.starts_with("<svg"));
  EXPECT_EQ(svg.find("<svg", 1), svg.npos);
  for (const char* words : {">way, m<", ">z &lt;m&gt;<", ">flown<", ">2<", ">-0.5<", "</svg>"})
    EXPECT_NE(svg.find(words), svg.npos) << words;
  const auto area = numbers(svg, "data-area");
  ASSERT_EQ(area.size(), 4u);
  EXPECT_EQ(numbers(svg, "data-window"), (std::vector<double>{0, 10, -1, 1}));
  const auto at = [&](double across, double up) {
    return formatted("%.2f %.2f", area[0] + across * area[2], area[1] + (1 - up) * area[3]);
  };
  EXPECT_NE(svg.find("d=\"M" + at(0, 0) + "L" + at(0.25, 0.5) + "L" + at(1, 1) + "\""), svg.npos) << svg;
}

TEST(Chart, TakesTheRangeOfWhatIsDrawnAndMetresAsLongOnBothAxes) {
  Chart chart{.x = {"x"}, .y = {"y"}, .layers = {{Shape::dots, Kind::measured, "", {{{1, 5}, {3, 7}, {2, 6}}}}}};
  const auto window = numbers(to_svg(chart), "data-window");
  EXPECT_EQ(window[0], 1);
  EXPECT_EQ(window[1], 3);
  EXPECT_LT(window[2], 5);
  EXPECT_GT(window[3], 7);
  chart.x = {"x", 0, 6};
  chart.y = {"y", 0, 3};
  chart.equal = true;
  const auto area = numbers(to_svg(chart), "data-area");
  EXPECT_NEAR(area[2] / 6, area[3] / 3, 1e-2);
  EXPECT_NO_THROW(to_svg(Chart{.x = {"x"}, .y = {"y"}})) << "nothing is drawn";
}

TEST(Palette, HasItsStopsAndWhatLiesBetween) {
  for (const auto& stop : kFieldPalette)
    EXPECT_EQ(palette_colour(stop.share) >> 8, std::stoul(stop.colour + 1, nullptr, 16)) << stop.share;
  EXPECT_EQ(palette_colour(7), palette_colour(1)) << "beyond the largest";
  const auto red = [](double share) { return palette_colour(share) >> 24; };
  EXPECT_NEAR(red(0.25), (0xd6 + 0x8f) / 2.0, 1);
}

/// The next four bytes as a number.
std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

TEST(Png, HoldsThePixelsAndItsCheckSums) {
  std::vector<std::uint32_t> pixels;
  for (std::uint32_t n = 0; n < 7 * 5; ++n) pixels.push_back(n * 0x01234567u);
  const auto file = files::png(7, pixels);
  ASSERT_TRUE(file.starts_with("\x89PNG\r\n\x1a\n"));
  std::string packed;
  for (std::size_t at = 8; at < file.size(); at += 12 + number_at(file, at)) {
    const auto size = number_at(file, at);
    const std::string summed = file.substr(at + 4, 4 + size);
    EXPECT_EQ(number_at(file, at + 8 + size), ::crc32(0, reinterpret_cast<const Bytef*>(summed.data()), 4 + size));
    if (summed.starts_with("IHDR")) {
      EXPECT_EQ(number_at(summed, 4) * 100 + number_at(summed, 8), 705u);
    }
    if (summed.starts_with("IDAT")) packed = summed.substr(4);
  }
  std::string rows(5 * 29, '\0');
  uLongf size = rows.size();
  ASSERT_EQ(::uncompress(reinterpret_cast<Bytef*>(rows.data()), &size, reinterpret_cast<const Bytef*>(packed.data()),
                         packed.size()),
            Z_OK);
  ASSERT_EQ(size, rows.size());
  for (std::size_t n = 0; n < pixels.size(); ++n) EXPECT_EQ(number_at(rows, n / 7 * 29 + 1 + n % 7 * 4), pixels[n]);
}

TEST(FieldSlice, ShowsThreePanelsWithUnitsInOneFile) {
  map::OccupancyGrid grid({0, 0, 0}, 0.5, {8, 6, 4}, map::Cell::free);
  std::vector<FieldSample> samples;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 5; ++j) samples.push_back({grid.center({i, j, 1}), Variance{0.1 * i, 0, 0, 0.2, 0, 0.1 * j}});
  const auto charts = field_slice(grid, {2, 0.75}, samples);
  ASSERT_EQ(charts.size(), 3u);
  const double largest = std::sqrt(0.7);
  EXPECT_DOUBLE_EQ(charts[0].scale_to, largest);
  EXPECT_EQ(charts[0].rasters[0].rgba[7], palette_colour(1)) << "the lowest row, its last voxel";
  EXPECT_EQ(charts[2].rasters[0].rgba[8 * 3], palette_colour(std::sqrt(0.3) / largest));
  EXPECT_EQ(charts[1].rasters[0].rgba.back(), 0xb9b9b9ffu) << "no sample: not free";
  const auto svg = picture_file(charts, "slice.svg");
  for (const char* words : {"along x", "along y", "along z", "standard deviation, m/s²", "z = 0.75 m", "xmlns"})
    EXPECT_NE(svg.find(words), svg.npos) << words;
  const auto png = picture_file(charts, "slice.png");
  EXPECT_TRUE(png.starts_with("\x89PNG"));
  EXPECT_EQ(number_at(png, 16), 800u);
  EXPECT_EQ(number_at(png, 20), 3u * 600u);
}

TEST(SeenFromAbove, ShowsWhatIsAnywhereBetweenTheHeights) {
  map::OccupancyGrid grid({0, 0, 0}, 0.5, {4, 3, 4}, map::Cell::free);
  grid.set({1, 0, 2}, map::Cell::occupied);
  grid.set({1, 0, 1}, map::Cell::unknown);
  grid.set({2, 2, 1}, map::Cell::unknown);
  grid.set({3, 2, 3}, map::Cell::occupied);
  const auto pixels = seen_from_above(grid, {-9, -9, 0}, {9, 9, 0}, 0.6, 1.2).rasters[0].rgba;
  for (std::size_t n = 0; n < pixels.size(); ++n)
    EXPECT_EQ(pixels[n], n == 1 ? 0x3c3c42ffu : n == 10 ? 0xd5d5d5ffu : 0u) << n;
}

}  // namespace
}  // namespace backwash::report
