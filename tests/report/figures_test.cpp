// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/figures.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <random>

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

TEST(Draw, ReturnsOneSvgWithoutProlog) {
  const auto figure = draw("plot sin(x) title 'sine'\n", Format::svg, 300, 200);
  ASSERT_TRUE(figure) << figure.error().message;
  EXPECT_TRUE(figure->starts_with("<svg"));
  EXPECT_NE(figure->find("sine"), std::string::npos);
  EXPECT_NE(figure->find("</svg>"), std::string::npos);
}

TEST(Draw, ReturnsPngBytes) {
  const auto figure = draw("plot sin(x)\n", Format::png, 300, 200);
  ASSERT_TRUE(figure) << figure.error().message;
  EXPECT_TRUE(figure->starts_with("\x89PNG"));
}

TEST(Draw, SaysWhatGnuplotComplainsAbout) {
  const auto figure = draw("plot 'no such file'\n", Format::svg, 300, 200);
  ASSERT_FALSE(figure);
  EXPECT_NE(figure.error().message.find("no such file"), std::string::npos) << figure.error().message;
  EXPECT_EQ(figure.error().message.find('\n'), std::string::npos);
}

TEST(Draw, SaysWhatToInstallWhereGnuplotIsMissing) {
  const std::string path = ::getenv("PATH");
  ::setenv("PATH", "/nonexistent", 1);
  const auto figure = draw("plot sin(x)\n", Format::svg, 300, 200);
  ::setenv("PATH", path.c_str(), 1);
  ASSERT_FALSE(figure);
  EXPECT_NE(figure.error().message.find("gnuplot-nox"), std::string::npos) << figure.error().message;
}

TEST(FieldSliceFigure, ShowsThreePanelsWithUnits) {
  map::OccupancyGrid grid({0, 0, 0}, 0.5, {8, 6, 4}, map::Cell::free);
  std::vector<FieldSample> samples;
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 6; ++j) samples.push_back({grid.center({i, j, 1}), Variance{0.1 * i, 0, 0, 0.2, 0, 0.1 * j}});
  }
  const auto figure = field_slice_figure(grid, {2, 0.75}, samples, Format::svg);
  ASSERT_TRUE(figure) << figure.error().message;
  for (const char* words : {"along x", "along y", "along z", "standard deviation", "z = 0.75 m"}) {
    EXPECT_NE(figure->find(words), std::string::npos) << words;
  }
}

}  // namespace
}  // namespace backwash::report
