// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>
#include <filesystem>

#include "core/files/read_file.hpp"
#include "services/maps/content.hpp"
#include "services/maps/geometry.hpp"

namespace backwash::maps {
namespace {

using Kind = map::MapError::Kind;

constexpr struct {
  const char* ending;
  Read (*read)(const std::string& path);
} kReaders[] = {
    {".ply", read_ply},   {".pcd", read_pcd},  {".csv", read_point_csv}, {".obj", read_mesh},
    {".gltf", read_mesh}, {".glb", read_mesh}, {".stl", read_mesh},
};

/// What others read, and what makes a file for us of it: `A` stands for the file's name without its ending.
constexpr struct {
  const char *ending, *what, *command;
} kConverters[] = {
    {".las", "a LAS cloud", "pdal translate A.las A.ply (pdal.io)"},
    {".laz", "a LAZ cloud", "pdal translate A.laz A.ply (pdal.io)"},
    {".e57", "an E57 cloud", "pdal translate A.e57 A.ply (pdal.io)"},
    {".fbx", "an FBX scene", "assimp export A.fbx A.glb (package assimp-utils)"},
    {".dae", "a Collada scene", "assimp export A.dae A.glb (package assimp-utils)"},
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
  auto& points = geometry.points;
  const auto bad = [](const Vec3& p) { return !p.allFinite(); };
  for (std::size_t n = 0; n < geometry.triangles.size(); ++n)
    for (const auto corner : geometry.triangles[n])
      if (bad(points[corner]))
        return corrupt(path, ": corner " + std::to_string(corner + 1) + ", of triangle " + std::to_string(n + 1) +
                                 ", is no finite place; a surface with a hole would be read as none: mend the mesh");
  if (geometry.triangles.empty()) {
    std::size_t kept = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (bad(points[n])) {
        if (geometry.not_finite++ == 0) geometry.first_not_finite = n + 1;
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

tl::expected<std::string, map::MapError> content_of(const std::string& path, const std::string& wanted) {
  auto content = files::read_file(path, files::kLargestTable, wanted);
  if (content) return std::move(*content);
  const bool large = content.error().kind == files::FileError::Kind::too_large;
  return tl::make_unexpected(
      map::MapError{large ? Kind::too_large : Kind::not_found, path + ": " + content.error().message});
}

Read read_geometry(const std::string& path, const std::string& topic) {
  const auto ending = ending_of(path);
  if (ending == ".mcap") {
    auto geometry = read_recording(path, topic);
    return geometry ? checked(std::move(*geometry), path) : geometry;
  }
  for (const auto& reader : kReaders) {
    if (ending != reader.ending) continue;
    auto geometry = reader.read(path);
    if (!geometry) return geometry;
    if (ending == ".gltf" || ending == ".glb") geometry->up = "y";
    return checked(std::move(*geometry), path);
  }
  std::string message = path + ": ";
  for (const auto& other : kConverters)
    if (ending == other.ending)
      return tl::make_unexpected(
          map::MapError{Kind::unknown_name,
                        message + other.what + " is not read; make one that is: " + converter(other.command, path)});
  return tl::make_unexpected(map::MapError{
      Kind::unknown_name, message + "ends in " + (ending.empty() ? "nothing" : ending) +
                              "; known are .bt, .ot, .ply, .pcd, .csv, .mcap, .obj, .gltf, .glb and .stl"});
}

}  // namespace backwash::maps
