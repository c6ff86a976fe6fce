// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>

#include "core/files/read_file.hpp"
#include "services/maps/geometry.hpp"

namespace backwash::maps {
namespace {

using Kind = map::MapError::Kind;

tl::expected<std::string, map::MapError> content_of(const std::string& path) {
  auto content = files::read_file(path, files::kLargestTable, "a mesh, a cloud or a recording");
  if (content) return std::move(*content);
  const bool large = content.error().kind == files::FileError::Kind::too_large;
  return tl::make_unexpected(
      map::MapError{large ? Kind::too_large : Kind::not_found, path + ": " + content.error().message});
}

Read of_recording(const std::string& path, std::string_view content) { return read_recording(path, content, "", 0); }
Read read_gltf(const std::string& path, std::string_view content) { return read_mesh(path, content, true); }
Read read_stl(const std::string& path, std::string_view content) { return read_mesh(path, content, false); }

constexpr struct {
  const char *ending, *begins;  // `begins`: what no other kind begins with, or empty
  Read (*read)(const std::string& path, std::string_view content);
} kReaders[] = {
    {".ply", "ply\n", read_ply},  {".ply", "ply\r\n", read_ply},
    {".pcd", "# .PCD", read_pcd}, {".glb", "glTF", read_gltf},
    {".csv", "", read_point_csv}, {".obj", "", read_obj},
    {".gltf", "", read_gltf},     {".stl", "", read_stl},
    {".pcd", "", read_pcd},       {".mcap", "\x89MCAP", of_recording},
};

/// What others read, and what makes a file for us of it: `A` stands for the file's name without its ending.
constexpr struct {
  const char *ending, *begins, *what, *command;
} kConverters[] = {
    {".las", "LASF", "a LAS cloud", "pdal translate A.las A.ply (pdal.io)"},
    {".laz", "LASF", "a LAZ cloud", "pdal translate A.laz A.ply (pdal.io)"},
    {".e57", "ASTM-E57", "an E57 cloud", "pdal translate A.e57 A.ply (pdal.io)"},
    {".fbx", "Kaydara FBX", "an FBX scene", "assimp export A.fbx A.glb (package assimp-utils)"},
    {".dae", "", "a Collada scene", "assimp export A.dae A.glb (package assimp-utils)"},
    {".bag", "#ROSBAG", "a bag of ROS 1", "rosbags-convert --src A.bag --dst A.ros2"},
    {".db3", "SQLite format 3", "a bag of SQLite",
     "ros2 bag convert -i A.db3 -o OUT.yaml, which names storage_id mcap"},
    {".zip", "PK\x03\x04", "an archive", "unzip A.zip"},
    {".xz",
     "\xfd"
     "7zXZ",
     "compressed by xz", "xz -dk A.xz"},
    {".zst", "\x28\xb5\x2f\xfd", "compressed by zstd", "zstd -dk A.zst"},
    {".bz2", "BZh", "compressed by bzip2", "bzip2 -dk A.bz2"},
    {".lfs", "version https://git-lfs", "a pointer of Git LFS", "git lfs pull"},
};

std::string ending_of(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

std::string converter(const std::string& command, const std::string& path) {
  const std::string stem = std::filesystem::path(path).replace_extension().string();
  std::string told;
  for (std::size_t n = 0; n < command.size(); ++n) {
    const bool name = command[n] == 'A' && n + 1 < command.size() && command[n + 1] == '.';
    told += name ? stem : std::string(1, command[n]);
  }
  return told;
}

/// What a mesh or cloud must be before it is placed; points that are no place leave a cloud.
Read checked(Geometry geometry, const std::string& path) {
  if (geometry.stated != geometry.taken)
    return corrupt(path, ": says " + std::to_string(geometry.stated) + " faces or points, of which " +
                             std::to_string(geometry.taken) + " were read; what is lost would be flown through");
  auto& points = geometry.points;
  const auto zeros = geometry.triangles.empty() ? std::ranges::count(points, Vec3::Zero().eval()) : 0;
  const auto bad = [&](const Vec3& p) { return !p.allFinite() || (zeros > 1 && p.isZero(0)); };
  for (std::size_t n = 0; n < geometry.triangles.size(); ++n)
    for (const auto corner : geometry.triangles[n])
      if (bad(points[corner]))
        return corrupt(path, ": corner " + std::to_string(corner + 1) + ", of triangle " + std::to_string(n + 1) +
                                 ", is no finite place; a surface with a hole would be read as none: mend the mesh");
  if (geometry.triangles.empty()) {
    std::size_t kept = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (bad(points[n])) {
        if (points[n].isZero(0))
          ++geometry.no_returns;
        else if (geometry.not_finite++ == 0)
          geometry.first_not_finite = n + 1;
        continue;
      }
      points[kept] = points[n];
      if (!geometry.sensors.empty()) geometry.sensors[kept] = geometry.sensors[n];
      ++kept;
    }
    points.resize(kept);
    if (!geometry.sensors.empty()) geometry.sensors.resize(kept);
  }
  if (points.empty())
    return corrupt(path, geometry.not_finite == 0 ? ": holds no point"
                                                  : ": none of its " + std::to_string(geometry.not_finite) +
                                                        " points has finite coordinates");
  const auto flat = std::ranges::count_if(geometry.triangles, [&](const auto& t) {
    return (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).isZero(0);
  });
  const auto note = [&](auto count, const char* what) {
    if (count > 0) geometry.notes.push_back(std::to_string(count) + what);
  };
  note(flat, " triangles have no area: they are lines or points of the map");
  note(geometry.fans, " faces cross themselves or have no plane: what their corners span around the first is occupied");
  note(geometry.no_returns, " points at (0, 0, 0) are no returns and were left out");
  return geometry;
}

}  // namespace

tl::unexpected<map::MapError> corrupt(const std::string& path, const std::string& what) {
  return tl::make_unexpected(map::MapError{Kind::corrupt, path + what});
}

tl::unexpected<map::MapError> too_large(const std::string& path, std::size_t points) {
  return tl::make_unexpected(map::MapError{Kind::too_large, path + ": " + std::to_string(points) +
                                                                " points or faces, " + std::to_string(kMostPoints) +
                                                                " are the most: thin it to one point a voxel"});
}

bool is_octomap(const std::string& path) {
  constexpr std::string_view kBegins = "# Octomap OcTree";
  std::string begins(kBegins.size(), ' ');
  std::error_code unknown;
  return std::filesystem::is_regular_file(path, unknown) &&
         std::ifstream(path).read(begins.data(), static_cast<std::streamsize>(begins.size())) && begins == kBegins;
}

Read read_geometry(const std::string& path, const std::string& topic, double body_radius) {
  auto content = content_of(path);
  if (!content) return tl::make_unexpected(content.error());
  const bool zipped = content->starts_with("\x1f\x8b");
  auto whole = files::unzipped(std::move(*content), files::kLargestTable);
  if (!whole) return corrupt(path, ": " + whole.error());
  const auto has = [&](char c) { return whole->find(c) != whole->npos; };
  if (has('\r') && !has('\n') && !has('\0')) std::ranges::replace(*whole, '\r', '\n');  // lines of old programs
  auto ending = ending_of(path);
  if (zipped && ending == ".gz") ending = ending_of(std::filesystem::path(path).stem().string());
  const auto begins = [&](const auto& kind) { return *kind.begins && whole->starts_with(kind.begins); };
  const auto ends = [&](const auto& kind) { return ending == kind.ending; };
  const auto both = [&](const auto& kind) { return begins(kind) && ends(kind); };
  const auto* reader = std::ranges::find_if(kReaders, begins);
  const auto* other = std::ranges::find_if(kConverters, both);
  if (other == std::end(kConverters)) other = std::ranges::find_if(kConverters, begins);
  const bool told = reader != std::end(kReaders) || other != std::end(kConverters);
  if (!told) reader = std::ranges::find_if(kReaders, ends);
  if (!told && reader == std::end(kReaders)) other = std::ranges::find_if(kConverters, ends);
  if (reader != std::end(kReaders)) {
    if (zipped && reader->read == read_gltf && !whole->starts_with("glTF"))
      return corrupt(path, ": is compressed by gzip; unpack it: gunzip -k " + path);
    if ((!topic.empty() || body_radius > 0) && reader->read != of_recording)
      return corrupt(path, ": --topic, --body-radius and --vehicle are of recordings, and it is none");
    auto geometry =
        reader->read == of_recording ? read_recording(path, *whole, topic, body_radius) : reader->read(path, *whole);
    return geometry ? checked(std::move(*geometry), path) : geometry;
  }
  const std::string known = "known are .bt, .ot, .ply, .pcd, .csv, .mcap, .obj, .gltf, .glb and .stl";
  return tl::make_unexpected(
      map::MapError{Kind::unknown_name,
                    path + ": " +
                        (other == std::end(kConverters)
                             ? "ends in " + (ending.empty() ? "nothing" : ending) + "; " + known
                             : other->what + (" is not read; make one that is: " + converter(other->command, path)))});
}

}  // namespace backwash::maps
