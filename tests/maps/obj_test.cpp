// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <cmath>

#include "tests/maps/triangles_of.hpp"

namespace backwash::maps {
namespace {

class Obj : public MapFiles {};

/// The tetrahedron's faces in each way in which an OBJ may say them.
TEST_F(Obj, HasEveryFaceHoweverItIsWritten) {
  Geometry expected;
  expected.points.assign(std::begin(kCorners), std::end(kCorners));
  for (const auto& f : kFaces)
    expected.triangles.push_back(
        {static_cast<std::uint32_t>(f[0]), static_cast<std::uint32_t>(f[1]), static_cast<std::uint32_t>(f[2])});
  const std::string v = "v 0 0 0\nv 1 0 0 1\nv 0 2 0 0.5 0.5 0.5\nv 0 0 3\n", vn = "vn 0 0 1\nvn 0 1 0\n";
  const std::pair<const char*, std::string> ways[] = {
      {"no vt", v + vn + "f 1/1/1 3/3/1 2/2/1\nf 1/1/1 2/2/1 4/4/1\nf 1/1/1 4/4/1 3/3/1\nf 2/2/1 3/3/1 4/4/1\n"},
      {"vt later",
       v + vn + "o a\nf 1/1/1 3/3/1 2/2/1\nf 1/1 2/2 4/4\nvt 0 0\nvt 0 1\no b\nf 1//1 4//1 3//1\nf 2 3 4\n"},
      {"backwards", v + "f -4 -2 -3\nf -4/-1/-1 -3/-1 -1\nf 1 -1 3\nf 2 3 4\n"},
      {"comments", v + "f 1 3 2 # a floor\nf 1 2 4#wall\n#f 9 9 9\nf\t1 4 3 \n  f 2 3 4\n"},
      {"CRLF, continued",
       "v 0 0 0\r\nv 1 0 \\\r\n0\r\nv 0 2 0\r\nv 0 0 3\r\nf 1 \\\r\n3 2\r\nf 1 2 4\r\nf 1 4 3\r\nf 2 3 \\\r\n4"},
      {"CR alone", "# a\rv 0 0 0\rv 1 0 0\rv 0 2 0\rv 0 0 3\rf 1 3 2\rf 1 2 4\rf 1 4 3\rf 2 3 4\r"},
      {"vertices last", "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n" + v},
  };
  for (const auto& [what, content] : ways) {
    const auto got = read("a.OBJ", content);
    ASSERT_TRUE(got) << what << ": " << got.error().message;
    EXPECT_EQ(triangles_of(*got), triangles_of(expected)) << what;
    EXPECT_EQ(got->stated, 4u) << what;
  }
  const auto thin = read("b.obj", v + "f 1 2 3\nf 1 1 2\nl 1 2 4\np 3 4\n");
  ASSERT_TRUE(thin) << thin.error().message;
  EXPECT_EQ(thin->triangles.size(), 6u);
  EXPECT_EQ(thin->lines, (std::vector<std::uint32_t>{5, 6, 7, 7, 8, 8}));
  EXPECT_EQ(thin->notes.at(0), "5 triangles have no area: they are lines or points of the map");
  refused("c.obj", v + "f 1 2\n", ":5: f of 2 corners, at least 3");
  for (const std::string what : {"fo", "F", "face"})
    refused("c.obj", v + "f 1 2 3\n" + what + " 1 2 4\n", ":6: '" + what + "' is no statement");
  refused("c.obj", v + "f 1 2 0\n", ":5: '0' names none of 4 vertices");
  refused("c.obj", v + "f 1 2 -5\n", ":5: '-5' names none of 4 vertices");
  refused("c.obj", v + "f 1 2 x\n", ":5: 'x' names none of 4 vertices");
  refused("c.obj", "v 0 0 0 2\n", ":1: a vertex with a weight");
  refused("c.obj", "v 0 0\n", ":1: a vertex has x, y and z");
  refused("c.obj", v + "f 1 2 3\nsurf 0 1 0 1 1 2 3\n", ":6: 'surf' is not read");
}

/// Twice the area of all triangles in z = 0, with their turns and without.
std::pair<double, double> areas(const Geometry& geometry) {
  double turning = 0, whole = 0;
  for (const auto& t : geometry.triangles) {
    const Vec3 cross =
        (geometry.points[t[1]] - geometry.points[t[0]]).cross(geometry.points[t[2]] - geometry.points[t[0]]);
    turning += cross.z();
    whole += cross.norm();
  }
  return {turning, whole};
}

TEST_F(Obj, CutsAFaceOfManyCornersWithoutClosingItsDoors) {
  // A wall with a doorway, one with a window that a seam joins to its rim, and a plain one with a corner on its edge.
  const std::string door = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 3 2 0\nv 3 0 0\nv 5 0 0\nv 5 3 0\nv 0 3 0\n";
  const std::string window =
      "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nv 1 1 0\n";
  const std::string corner = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n";
  for (const auto& [v, faces, twice] : {std::tuple{door, "f 1 2 3 4 5 6 7 8\n", 26.0},
                                        {door, "f 8 7 6 5 4 3 2 1\n", -26.0},
                                        {door, "f 4 5 6 7 8 1 2 3\n", 26.0},
                                        {window, "f 1 2 3 4 5 6 7 8 9 10\n", 24.0},
                                        {corner, "f 1 2 3 4 5\n", 8.0}}) {
    const auto got = read("wall.obj", v + faces);
    ASSERT_TRUE(got) << got.error().message;
    const auto [turning, whole] = areas(*got);
    EXPECT_NEAR(turning, twice, 1e-12) << faces;
    EXPECT_NEAR(whole, std::abs(twice), 1e-12) << faces << "is covered more than once";
    EXPECT_EQ(got->fans, 0u) << faces;
  }
  const auto bow = read("bow.obj", "v 0 0 0\nv 2 2 0\nv 3 0 0\nv 0 3 0\nf 1 2 3 4\n");
  ASSERT_TRUE(bow);
  EXPECT_EQ(bow->triangles.size(), 2u);
  EXPECT_EQ(bow->fans, 1u);
}

TEST_F(Obj, CutsRandomStarsIntoTrianglesThatCoverThemOnce) {
  std::uint64_t state = 7;
  const auto draw = [&] { return static_cast<double>((state = state * 6364136223846793005u + 1) >> 40) / (1 << 24); };
  for (int round = 0; round < 200; ++round) {
    const int corners = 4 + round % 30;
    std::string text, face = "f";
    double twice = 0;
    std::vector<Vec3> ring;
    for (int n = 0; n < corners; ++n) {
      const double angle = 2 * M_PI * n / corners, r = 0.2 + 3 * draw();
      ring.emplace_back(r * std::cos(angle), r * std::sin(angle), 0);
      char line[99];
      std::snprintf(line, sizeof line, "v %.17g %.17g 0\n", ring.back().x(), ring.back().y());
      text += line;
      face += " " + std::to_string(n + 1);
    }
    for (int n = 0; n < corners; ++n) twice += ring[n].cross(ring[(n + 1) % corners]).z();
    const auto got = read("star.obj", text + face + "\n");
    ASSERT_TRUE(got) << got.error().message;
    EXPECT_EQ(got->fans, 0u) << round;
    EXPECT_NEAR(areas(*got).second, twice, 1e-9) << round;
  }
}

}  // namespace
}  // namespace backwash::maps
