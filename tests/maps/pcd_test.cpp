// SPDX-License-Identifier: BSD-3-Clause
#include <liblzf/lzf.h>

#include "tests/maps/files.hpp"

namespace backwash::maps {
namespace {

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
