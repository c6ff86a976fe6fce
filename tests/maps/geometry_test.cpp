// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "services/maps/in_child.hpp"
#include "tests/maps/triangles_of.hpp"

namespace backwash::maps {
namespace {

class Geometries : public MapFiles {};

std::string obj() {
  std::string out = "mtllib nowhere.mtl\n";
  for (const Vec3& p : kCorners)
    out += "v " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
  for (const auto& f : kFaces)
    out += "f " + std::to_string(f[0] + 1) + " " + std::to_string(f[1] + 1) + " " + std::to_string(f[2] + 1) + "\n";
  return out;
}

std::string stl() {
  std::string out(80, ' ');
  out += bytes_of<std::uint32_t>(4);
  for (const auto& f : kFaces) {
    for (int n = 0; n < 3; ++n) out += bytes_of(n == 2 ? 1.f : 0.f);
    for (const int corner : f)
      for (int axis = 0; axis < 3; ++axis) out += bytes_of(static_cast<float>(kCorners[corner][axis]));
    out += std::string(2, '\0');
  }
  return out;
}

std::string ascii_stl() {
  std::string out = "solid a tetrahedron\r\n";
  for (const auto& f : kFaces) {
    out += "  facet normal 0 0 1\n outer loop\n";
    for (const int corner : f)
      for (int axis = 0; axis < 3; ++axis)
        out += (axis == 0 ? "vertex " : " ") + std::to_string(kCorners[corner][axis]) + (axis == 2 ? "\n" : "");
    out += "endloop\nendfacet\n";
  }
  return out + "endsolid\n";
}

/// Binary glTF, its mesh moved by its node to (10, 0, 0).
std::string glb() {
  std::string bin;
  for (const Vec3& p : kCorners)
    for (int axis = 0; axis < 3; ++axis) bin += bytes_of(static_cast<float>(p[axis]));
  for (const auto& f : kFaces)
    for (const int corner : f) bin += bytes_of(static_cast<std::uint16_t>(corner));
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[10,0,0]}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[{"bufferView":0,)"
      R"("componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,2,3]},{"bufferView":1,"componentType":5123,)"
      R"("count":12,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,)"
      R"("byteLength":24}],"buffers":[{"byteLength":72}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto chunk = [](const std::string& data, const std::string& type) {
    return bytes_of(static_cast<std::uint32_t>(data.size())) + type + data;
  };
  const std::string body = chunk(json, "JSON") + chunk(bin, std::string("BIN\0", 4));
  return "glTF" + bytes_of<std::uint32_t>(2) + bytes_of(static_cast<std::uint32_t>(12 + body.size())) + body;
}

TEST_F(Geometries, AreTheSameTetrahedronByEveryMeshFormat) {
  Geometry expected;
  expected.points.assign(std::begin(kCorners), std::end(kCorners));
  for (const auto& f : kFaces)
    expected.triangles.push_back(
        {static_cast<std::uint32_t>(f[0]), static_cast<std::uint32_t>(f[1]), static_cast<std::uint32_t>(f[2])});
  for (const auto& [name, content] : {std::pair{"a.obj", obj()}, {"a.stl", stl()}, {"b.stl", ascii_stl()}}) {
    const auto got = read(name, content);
    ASSERT_TRUE(got) << got.error().message;
    EXPECT_EQ(triangles_of(*got), triangles_of(expected)) << name;
    EXPECT_EQ(got->up, "z");
  }
  for (Vec3& p : expected.points) p.x() += 10;
  const auto got = read("a.glb", glb());
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(triangles_of(*got), triangles_of(expected));
  EXPECT_EQ(got->up, "y");
}

TEST_F(Geometries, AreKnownByTheirContentWhateverTheirNames) {
  const std::string packed = "gzip -kf " + folder_;
  for (const auto& [name, content] : {std::pair{"a.obj", obj()},
                                      {"a.STL", stl()},
                                      {"b.stl", ascii_stl()},
                                      {"a.CSV", std::string("x,y,z\n1,2,3\n")}}) {
    const auto plain = read(name, content);
    ASSERT_TRUE(plain) << plain.error().message;
    ASSERT_EQ(std::system((packed + name).c_str()), 0);
    const auto zipped = read_geometry(folder_ + name + ".gz");
    ASSERT_TRUE(zipped) << zipped.error().message;
    EXPECT_EQ(triangles_of(*zipped), triangles_of(*plain));
    EXPECT_EQ(zipped->points, plain->points);
  }
  EXPECT_EQ(triangles_of(read("b.stl", ascii_stl()).value()), triangles_of(read("b.stl", stl()).value()));
  const auto mesh = read("mesh.txt", glb());
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->up, "y");
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 "
      "3\n";
  EXPECT_EQ(read("cloud.obj", ply)->points, (std::vector<Vec3>{{1, 2, 3}}));
  refused("more.ply", ply + "\n4 5 6\n", "behind the last element that its header counts");
  refused("flight.mcap", "#ROSBAG V2.0\n", "rosbags-convert --src " + folder_ + "flight.bag");
  refused("bag.mcap", std::string("SQLite format 3\0", 16), "ros2 bag convert");
  refused("room.ply", "version https://git-lfs.github.com/spec/v1\n", "git lfs pull");
  refused("room.obj.xz",
          "\xfd"
          "7zXZ",
          "xz -dk " + folder_ + "room.obj.xz");
  std::ofstream(folder_ + "cut.obj.gz", std::ios::binary) << "\x1f\x8b\x08";
  EXPECT_FALSE(read_geometry(folder_ + "cut.obj.gz"));
}

TEST_F(Geometries, OfAGltfAreAsManyAsItsNodesShow) {
  const auto gltf = [](const std::string& more, const std::string& nodes) {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" + nodes + more +
           R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0}},{"attributes":{"POSITION":0},"mode":5}]}],)"
           R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],)"
           R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/)"
           R"(octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
  };
  const auto two = read("a.gltf", gltf("", R"([{"mesh":0,"children":[1]},{"mesh":0,"translation":[5,0,0]}])"));
  ASSERT_TRUE(two) << two.error().message;
  EXPECT_EQ(two->triangles.size(), 4u);
  EXPECT_EQ(two->stated, 4u);
  refused("b.gltf", gltf(R"(,"extensionsUsed":["EXT_meshopt_compression"])", R"([{"mesh":0}])"),
          "EXT_meshopt_compression is not read");
  refused("c.gltf", gltf(R"(,"extensionsUsed":["EXT_mesh_gpu_instancing"])", R"([{"mesh":0}])"), "export it without");
  refused("d.gltf", gltf("", R"([{"children":[0]}])"), "lead in a circle");
}

TEST_F(Geometries, RefuseMeshesThatAreDamagedOrEmpty) {
  refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", ":4: '9' names none of 3 vertices");
  refused("b.obj", "", "holds no face");
  refused("c.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "holds no face");
  refused("d.stl", stl().substr(0, 200), "its head says 4 facets, and it has 200 bytes");
  refused("d.stl", stl() + stl().substr(84, 50), "and it has 334 bytes");
  refused("d.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n", "");
  refused("d.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n",
          "1 'facet', 0 'endfacet' and 3 'vertex'");
  const std::string corners = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n";
  refused("d.stl", "solid a\nfacet\n" + corners + "vertex 1 1 0\nendfacet\nendsolid\n", "and 4 'vertex'");
  const std::string loop = " normal 0 0 1\nouter loop\n" + corners + "endloop\n";
  const auto loud = read("d.stl", "SOLID a\nFACET" + loop + "ENDFACET\nfacet" + loop + "endfacet\nendsolid\n");
  ASSERT_TRUE(loud) << loud.error().message;
  EXPECT_EQ(loud->triangles.size(), 2u);
  refused("e.glb", glb().substr(0, 300), "export it again");
  refused("f.gltf", "{", "export it again");
  refused("g.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "no finite place");
}

TEST_F(Geometries, EndInAnAnswerWhateverBytesOfAMeshAreDamaged) {
  std::uint64_t state = 88172645463325252u;
  const auto draw = [&](std::size_t below) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<std::size_t>(state % below);
  };
  int refusals = 0;
  for (const auto& [name, whole] : {std::pair{"x.obj", obj()}, {"x.stl", stl()}, {"x.glb", glb()}}) {
    for (int n = 0; n < 40; ++n) {
      std::string content = whole;
      for (int k = 0; k < 3; ++k) content[draw(content.size())] ^= static_cast<char>(1 << draw(8));
      const auto got = read(name, content);
      refusals += !got;
      if (!got) {
        EXPECT_EQ(got.error().message.find(folder_ + name), 0u);
      }
    }
  }
  EXPECT_GT(refusals, 10);
}

TEST_F(Geometries, TakePointsAndTheirSensorsFromATable) {
  const auto got =
      read("a.csv",
           "label,x_m,y_m,z_m,sensor_x_m,sensor_y_m,sensor_z_m\nchair,1,2,3,0,0,1\n,nan,0,0,0,0,1\nwall,4,5,6,0,1,1\n");
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(got->points, (std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(got->sensors, (std::vector<Vec3>{{0, 0, 1}, {0, 1, 1}}));
  EXPECT_EQ(got->not_finite, 1u);
  EXPECT_EQ(read("b.csv", "X,Y,Z\n1,2,3\n")->points.size(), 1u);
  EXPECT_EQ(read("b.csv", "x;y;z\r1;2;3\r4;5;6\r")->points, (std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(read("b.csv", "x\ty\tz\n1\t2\t3\n")->points, (std::vector<Vec3>{{1, 2, 3}}));
  refused("b.csv", "x;y;z\n1,5;2;3\n", "b.csv:2:");
  refused("c.csv", "x_m,y_m\n1,2\n", ":1: no columns x_m,y_m,z_m");
  refused("d.csv", "x_m,y_m,z_m\n1,2,three\n", "d.csv:2:");
  refused("e.csv", "x,y,z,sensor_x_m,sensor_y_m,sensor_z_m\n1,2,3,,,\n",
          "e.csv:2: a point without the place of its sensor");
  refused("f.csv", "x,y,z\n", "holds no point");
}

TEST_F(Geometries, TellHowToConvertWhatIsNotRead) {
  refused("room.las", "LASF", "pdal translate " + folder_ + "room.las " + folder_ + "room.ply");
  refused("room.E57", "ASTM-E57", "pdal translate ");
  refused("room.mcap", "", "room.mcap: does not begin as an MCAP file");
  refused("room.dwg", "", "ends in .dwg; known are .bt");
  refused("room", "", "ends in nothing");
}

TEST_F(Geometries, WaitForNoFifoAndNameAFileThatIsNotThere) {
  for (const char* name : {"a.ply", "a.pcd", "a.csv", "a.obj"}) {
    const auto got = read_geometry(folder_ + name);
    ASSERT_FALSE(got);
    EXPECT_EQ(got.error().kind, map::MapError::Kind::not_found) << name;
  }
  std::filesystem::create_directory(folder_ + "folder.ply");
  EXPECT_NE(read_geometry(folder_ + "folder.ply")
                .error()
                .message.find("is a directory; needs a mesh, a cloud or a recording"),
            std::string::npos);
}

TEST(InChild, ReturnsAllThatWasSaidAndTellsHowAChildEnded) {
  constexpr std::size_t kMemory = std::size_t{1} << 30;
  const std::string said(3u << 20, 'x');
  EXPECT_EQ(in_child([&](const Sink& sink) { sink(said.data(), said.size()); }, 5, kMemory), said);
  const auto crashed = in_child([](const Sink&) { ::raise(SIGSEGV); }, 5, kMemory);
  ASSERT_FALSE(crashed);
  EXPECT_EQ(crashed.error(), "ended with signal 11");
  const auto threw = in_child([](const Sink&) { throw std::bad_alloc(); }, 5, kMemory);
  ASSERT_FALSE(threw);
  const auto endless = in_child(
      [](const Sink&) {
        for (volatile int n = 0;;) n = n + 1;
      },
      1, kMemory);
  ASSERT_FALSE(endless);
  EXPECT_NE(endless.error().find("was ended after 1 s"), std::string::npos) << endless.error();
}

}  // namespace
}  // namespace backwash::maps
