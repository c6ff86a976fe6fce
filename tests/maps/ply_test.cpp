// SPDX-License-Identifier: BSD-3-Clause
#include <liblzf/lzf.h>

#include "tests/maps/files.hpp"

namespace backwash::maps {
namespace {

class Ply : public MapFiles {
 protected:
  /// Two cameras (a foreign element), four vertices with a colour between y and z, a triangle and a square.
  static std::string header(const std::string& format, const std::string& real) {
    return "ply\nformat " + format +
           " 1.0\ncomment by hand\nelement camera 2\nproperty list uchar short view\nelement vertex 4\nproperty " +
           real + " x\nproperty " + real + " y\nproperty uchar red\nproperty " + real +
           " z\nelement face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";
  }
  static constexpr const char* kAscii =
      "2 -7 300\n0\n0 0 255 -0.5\n1 0 255 0.25\n\n1 2 0 1e1\n0 2 0 +3\n7 3 0 1 2\n0 4 0 1 2 3\n";
  template <typename Real>
  static std::string binary(bool turned) {
    std::string out =
        bytes_of<std::uint8_t>(2) + bytes_of<std::int16_t>(-7, turned) + bytes_of<std::int16_t>(300, turned) + '\0';
    const double v[4][3] = {{0, 0, -0.5}, {1, 0, 0.25}, {1, 2, 10}, {0, 2, 3}};
    for (const auto& p : v)
      out += bytes_of(static_cast<Real>(p[0]), turned) + bytes_of(static_cast<Real>(p[1]), turned) + '\xff' +
             bytes_of(static_cast<Real>(p[2]), turned);
    for (const std::vector<std::int32_t>& face : {std::vector{0, 1, 2}, {0, 1, 2, 3}}) {
      out += '\7' + bytes_of(static_cast<std::uint8_t>(face.size()));
      for (const auto corner : face) out += bytes_of(corner, turned);
    }
    return out;
  }
  static void expect_scene(const Read& got) {
    ASSERT_TRUE(got) << got.error().message;
    const std::vector<Vec3> points = {{0, 0, -0.5}, {1, 0, 0.25}, {1, 2, 10}, {0, 2, 3}};
    EXPECT_EQ(got->points, points);
    const std::vector<std::array<std::uint32_t, 3>> triangles = {{0, 1, 2}, {0, 1, 2}, {0, 2, 3}};
    EXPECT_EQ(got->triangles, triangles);
  }
};

TEST_F(Ply, IsTheSameSceneInAsciiAndBothByteOrders) {
  expect_scene(read("a.ply", header("ascii", "float") + kAscii));
  expect_scene(read("b.ply", header("binary_little_endian", "float32") + binary<float>(false)));
  expect_scene(read("c.PLY", header("binary_big_endian", "double") + binary<double>(true)));
}

TEST_F(Ply, KeepsTheDigitsOfDoublesFarFromTheOrigin) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
  const auto got = read("utm.ply", head + "500000.123 5600000.456 101.5\n");
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(got->points[0], Vec3(500000.123, 5600000.456, 101.5));
  EXPECT_FALSE(got->single);
}

TEST_F(Ply, IsRefusedCutShortAtAnyByteOfABinaryBody) {
  const std::string head = header("binary_little_endian", "float"), body = binary<float>(false);
  for (std::size_t n = 0; n < body.size(); ++n)
    refused("cut.ply", head + body.substr(0, n),
            "ends at byte " + std::to_string(head.size() + n) + " in the middle of ");
}

TEST_F(Ply, IsRefusedCutShortInAsciiByTheLine) {
  const std::string head = header("ascii", "float"), body = kAscii;
  refused("cut.ply", head + body.substr(0, body.find("1 2 0 1e1")), "ends too early in vertex 3 of 4");
  refused("cut.ply", head + body.substr(0, body.find("1 2 3")), "cut.ply:23: ends too early in face 2 of 2");
}

TEST_F(Ply, NamesTheElementAndTheValueThatIsWrong) {
  const std::string head = header("ascii", "float");
  refused("a.ply", head + "0\n0\n0 0 1 2\n0 zero 1 2\n", "a.ply:18: 'zero' is no number in vertex 2 of 4");
  refused("b.ply", head + "0\n0\n0 0 1 2\n0 0 1 2\n0 0 1 2\n0 0 1 2\n0 3 0 1 4\n",
          "face 1 of 2: names vertex 4, and there are 0 to 3");
  refused("c.ply", head + "99999999999 1\n", "camera 1 of 2: a list of 99999999999 numbers is no list");
  refused("d.ply", "plyx\n", ":1: the first line should be 'ply'");
  refused("e.ply", "ply\nformat xml 1.0\n", ":2: format 'xml' should be ascii");
  refused("f.ply", "ply\nformat ascii 1.0\nelement vertex -3\n", ":3: element 'vertex' has the count '-3'");
  refused("g.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\n",
          ":4: property quad x: should be TYPE NAME");
  refused("h.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n",
          "element vertex has no property y");
  refused("i.ply",
          "ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nproperty float y\nproperty float "
          "z\nend_header\n",
          "are the most");
  refused("j.ply", "ply\nformat ascii 1.0\n", "the header ends without a line 'end_header'");
}

TEST_F(Ply, LosesNotFinitePointsOfACloudWithACountAndRefusesThemInAMesh) {
  const std::string cloud =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  const auto got = read("cloud.ply", cloud + "1 2 3\nnan 0 0\n0 inf 1\n");
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(got->points.size(), 1u);
  EXPECT_EQ(got->not_finite, 2u);
  EXPECT_EQ(got->first_not_finite, 2u);
  refused("none.ply", cloud + "nan 0 0\nnan 0 0\n0 inf 1\n", "none of its 3 points has finite coordinates");
  refused("mesh.ply", header("ascii", "float") + "0\n0\n0 0 0 1\n1 0 0 nan\n1 1 0 0\n0 1 0 0\n0 3 0 2 3\n0 3 0 1 2\n",
          "corner 2, of triangle 2, is no finite place");
}

TEST_F(Ply, RefusesFacesThatItWouldLose) {
  const std::string vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string begin = "ply\nformat ascii 1.0\n", end = "end_header\n", xyz = "0 0 0\n1 0 0\n0 1 0\n";
  refused("a.ply",
          begin + vertices + "element tristrips 1\nproperty list int int vertex_indices\n" + end + xyz + "3 0 1 2\n",
          "has tristrips, which are not read");
  refused("b.ply", begin + vertices + "element face 1\nproperty list uchar int corners\n" + end + xyz + "3 0 1 2\n",
          "element face has no list vertex_indices");
  refused("c.ply",
          begin + "element face 1\nproperty list uchar int vertex_index\n" + vertices + end + "3 0 1 2\n" + xyz,
          "face 1 of 1: comes before the vertices");
  refused("d.ply", begin + vertices + "element face 1\nproperty list uchar int vertex_index\n" + end + xyz + "0\n",
          "face 1 of 1: has no corner");
  const auto thin = read("e.ply", begin + vertices + "element face 2\nproperty list uchar int vertex_index\n" + end +
                                      xyz + "2 0 1\n3 0 1 2\n");
  ASSERT_TRUE(thin) << thin.error().message;
  EXPECT_EQ(thin->triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 1}, {0, 1, 2}}));
  EXPECT_EQ(thin->notes.at(0), "1 triangles have no area: they are lines or points of the map");
}

TEST_F(Ply, LeavesOutWhatAScannerWritesWhereNothingCameBack) {
  const std::string cloud =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  const auto got = read("cloud.ply", cloud + "0 0 0\n1 2 3\nnan nan nan\n0 -0 0\n");
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(got->points, (std::vector<Vec3>{{1, 2, 3}}));
  EXPECT_EQ(got->not_finite, 1u);
  EXPECT_EQ(got->notes.at(0), "2 points at (0, 0, 0) are no returns and were left out");
  EXPECT_EQ(read("one.ply", cloud + "0 0 0\n1 2 3\n1 1 1\n2 2 2\n")->points.size(), 4u) << "one may be a place";
}

class Pcd : public MapFiles {
 protected:
  static constexpr std::size_t kPoints = 50;
  static Vec3 point(std::size_t n) { return {0.5 * static_cast<double>(n % 7), -0.25, 0.125 * static_cast<double>(n)}; }
  /// Fields before, between and after the three, one of them of three numbers.
  static std::string header(const std::string& data, const std::string& viewpoint = "0 0 0 1 0 0 0") {
    return "# .PCD v0.7\nVERSION 0.7\nFIELDS ring x normal y z\nSIZE 2 4 4 8 4\nTYPE U F F F F\nCOUNT 1 1 3 1 1\nWIDTH "
           "25\nHEIGHT 2\nVIEWPOINT " +
           viewpoint + "\nPOINTS 50\nDATA " + data + "\n";
  }
  static std::string ascii() {
    std::string out;
    for (std::size_t n = 0; n < kPoints; ++n) {
      const Vec3 p = point(n);
      out += std::to_string(n) + " " + std::to_string(p.x()) + " 0 0 1 " + std::to_string(p.y()) + "  " +
             std::to_string(p.z()) + "\n";
    }
    return out;
  }
  static std::string binary(bool by_field) {
    std::string fields[5], out;
    for (std::size_t n = 0; n < kPoints; ++n) {
      const Vec3 p = point(n);
      const std::string bytes[] = {bytes_of(static_cast<std::uint16_t>(n)), bytes_of(static_cast<float>(p.x())),
                                   bytes_of(0.f) + bytes_of(0.f) + bytes_of(1.f), bytes_of(p.y()),
                                   bytes_of(static_cast<float>(p.z()))};
      for (int f = 0; f < 5; ++f) (by_field ? fields[f] : out) += bytes[f];
    }
    for (const auto& field : fields) out += field;
    return out;
  }
  static std::string compressed() {
    const std::string plain = binary(true);
    std::string packed(plain.size(), '\0');
    packed.resize(lzf_compress(plain.data(), static_cast<unsigned>(plain.size()), packed.data(),
                               static_cast<unsigned>(packed.size())));
    return bytes_of(static_cast<std::uint32_t>(packed.size())) + bytes_of(static_cast<std::uint32_t>(plain.size())) +
           packed;
  }
};

TEST_F(Pcd, IsTheSameCloudInAllThreeForms) {
  for (const auto& content :
       {header("ascii") + ascii(), header("binary") + binary(false), header("binary_compressed") + compressed()}) {
    const auto got = read("a.pcd", content);
    ASSERT_TRUE(got) << got.error().message;
    ASSERT_EQ(got->points.size(), kPoints);
    for (std::size_t n = 0; n < kPoints; ++n) EXPECT_EQ(got->points[n], point(n));
    EXPECT_TRUE(got->triangles.empty() && got->notes.empty());
  }
}

TEST_F(Pcd, TellsAViewpointThatIsNotApplied) {
  const auto got = read("a.pcd", header("ascii", "1 2 3 1 0 0 0") + ascii());
  ASSERT_TRUE(got) << got.error().message;
  ASSERT_EQ(got->notes.size(), 1u);
  EXPECT_NE(got->notes[0].find("VIEWPOINT 1 2 3 1 0 0 0 is not applied"), std::string::npos);
}

TEST_F(Pcd, IsRefusedCutShortInAllThreeForms) {
  const auto text = ascii(), plain = binary(false), packed = compressed();
  refused("a.pcd", header("ascii") + text.substr(0, text.find("\n20 ") + 1), "a.pcd:31: ends after 20 of 50 points");
  refused("b.pcd", header("binary") + plain.substr(0, plain.size() - 1), "ends after 49 of 50 points of 30 bytes");
  refused("c.pcd", header("binary_compressed") + packed.substr(0, packed.size() - 1), "bytes of compressed points");
  refused("d.pcd", header("binary_compressed") + "abc", "ends before the lengths");
  const std::string more = "holds more points than POINTS says";
  refused("e.pcd", header("ascii") + text + text, more);
  refused("f.pcd", header("binary") + plain + plain.substr(0, 30), more);
}

TEST_F(Pcd, NamesTheLineAndTheValueThatIsWrong) {
  const auto head = [](const std::string& from, const std::string& to) {
    std::string text = header("ascii");
    return text.replace(text.find(from), from.size(), to);
  };
  refused("a.pcd", head("FIELDS ring x", "FIELDS ring u"), "FIELDS should name x once");
  refused("b.pcd", head("TYPE U", "TYPE Q"), "field 'ring' has the type 'Q2'");
  refused("c.pcd", head("HEIGHT 2", "HEIGHT 3"), "POINTS 50 should be WIDTH 25 x HEIGHT 3");
  refused("d.pcd", head("COUNT 1 1 3 1 1", "COUNT 1 1 3 1"), "COUNT and FIELDS should name equally many");
  refused("e.pcd", head("DATA ascii", "DATA zip"), ":11: DATA 'zip' should be ascii, binary or binary_compressed");
  refused("f.pcd", head("DATA ascii", "WIDTH 25"), "the header ends without a line DATA");
  refused("g.pcd", "solid\n", ":1: 'solid' is no line of a PCD header");
  refused("h.pcd", header("ascii") + "0 one 0 0 1 2 3\n", "h.pcd:12: x is 'one', which is no number");
  refused("i.pcd", header("ascii") + "0 1 0 0 1\n", "i.pcd:12: y is '', which is no number");
}

TEST_F(Pcd, IsRefusedWhereItsCompressedPointsAreDamaged) {
  std::string content = compressed();
  for (std::size_t n = 8; n < 40; ++n) content[n] = '\xff';
  refused("a.pcd", header("binary_compressed") + content, "its compressed points are damaged");
  content = compressed();
  content[4] = 1;
  refused("b.pcd", header("binary_compressed") + content, "50 points of 30 bytes are not the");
  std::string lie = header("binary_compressed");
  lie.replace(lie.find("WIDTH 25\nHEIGHT 2"), 17, "WIDTH 60000000\nHEIGHT 1")
      .replace(lie.find("POINTS 50"), 9, "POINTS 60000000");
  refused("c.pcd", lie + bytes_of<std::uint32_t>(3) + bytes_of<std::uint32_t>(1800000000) + "abc",
          "its compressed points are damaged");
}

}  // namespace
}  // namespace backwash::maps
