// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cstring>

#include "services/maps/content.hpp"
#include "services/maps/geometry.hpp"
#include "services/maps/in_child.hpp"

namespace backwash::maps {
namespace {

/// What the child says: whether it read the file, then the error's text, or the counts, corners and triangles.
template <typename T>
void put(const Sink& sink, const T* values, std::size_t count) {
  sink(reinterpret_cast<const char*>(values), count * sizeof(T));
}

void put_error(const Sink& sink, const std::string& what) {
  sink("E", 1);
  sink(what.data(), what.size());
}

/// Faces as triangles: a line is one without width. What assimp calls a point is a place of its own.
struct Faces {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> points;
};

/// Empty, or what is wrong with the mesh's faces.
std::string take_faces(const aiMesh& mesh, std::uint32_t before, Faces& faces) {
  for (unsigned n = 0; n < mesh.mNumFaces; ++n) {
    const aiFace& face = mesh.mFaces[n];
    for (unsigned k = 0; k < face.mNumIndices; ++k)
      if (face.mIndices[k] >= mesh.mNumVertices)
        return "face " + std::to_string(n + 1) + " of " + std::to_string(mesh.mNumFaces) + " names vertex " +
               std::to_string(face.mIndices[k]) + " of " + std::to_string(mesh.mNumVertices);
    const auto corner = [&](unsigned k) { return before + face.mIndices[std::min(k, face.mNumIndices - 1)]; };
    if (face.mNumIndices == 1) faces.points.push_back(corner(0));
    for (unsigned k = 2; k < std::max(face.mNumIndices, 3u) && face.mNumIndices > 1; ++k)
      faces.triangles.push_back({corner(0), corner(k - 1), corner(k)});
  }
  return "";
}

void import(const std::string& path, const Sink& sink) {
  Assimp::Importer importer;
  const aiScene* const scene = importer.ReadFile(path, aiProcess_PreTransformVertices | aiProcess_Triangulate);
  if (!scene) return put_error(sink, importer.GetErrorString());
  if (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) return put_error(sink, "the scene is incomplete");
  std::uint64_t corners = 0;
  Faces faces;
  for (unsigned n = 0; n < scene->mNumMeshes; ++n) {
    const aiMesh& mesh = *scene->mMeshes[n];
    if (corners + mesh.mNumVertices > kMostPoints || faces.triangles.size() > kMostPoints)
      return put_error(sink, "more than " + std::to_string(kMostPoints) + " corners or faces");
    if (const auto wrong = take_faces(mesh, static_cast<std::uint32_t>(corners), faces); !wrong.empty())
      return put_error(sink, wrong);
    corners += mesh.mNumVertices;
  }
  for (const auto point : faces.points) faces.triangles.push_back({point, point, point});
  const std::uint64_t counts[] = {corners, faces.triangles.size()};
  sink("G", 1);
  put(sink, counts, 2);
  for (unsigned n = 0; n < scene->mNumMeshes; ++n)
    put(sink, scene->mMeshes[n]->mVertices, scene->mMeshes[n]->mNumVertices);
  put(sink, faces.triangles.data(), faces.triangles.size());
}

/// The numbers of `said` from `at` on, which moves behind them; false if it ends before.
template <typename T>
bool take(const std::string& said, std::size_t& at, T* values, std::size_t count) {
  if (said.size() - at < count * sizeof(T)) return false;
  std::memcpy(static_cast<void*>(values), said.data() + at, count * sizeof(T));
  at += count * sizeof(T);
  return true;
}

std::string one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  return text.substr(0, 300);
}

}  // namespace

Read read_mesh(const std::string& path) {
  std::size_t bytes = 0;
  if (const auto content = content_of(path, "a mesh"); content)
    bytes = content->size();
  else
    return tl::make_unexpected(content.error());
  // A slow text format takes a second for 1 MiB; an OBJ takes up to 20 bytes of memory for each of its own.
  const std::size_t seconds = 20 + (bytes >> 20), most_bytes = (std::size_t{2} << 30) + 40 * bytes;
  const auto said = in_child([&](const Sink& sink) { import(path, sink); }, seconds, most_bytes);
  if (!said) return corrupt(path, ": its reader " + said.error() + ": it is damaged; export it again");
  if (said->starts_with('E')) return corrupt(path, ": " + one_line(said->substr(1)) + "; export it again");
  std::size_t at = 1;
  std::uint64_t counts[2] = {};
  take(*said, at, counts, 2);
  std::vector<Eigen::Vector3f> corners(std::min<std::size_t>(counts[0], said->size()));
  Geometry geometry;
  geometry.triangles.resize(std::min<std::size_t>(counts[1], said->size()));
  if (!take(*said, at, corners.data(), corners.size()) ||
      !take(*said, at, geometry.triangles.data(), geometry.triangles.size()))
    return corrupt(path, ": its reader ended early: it is damaged; export it again");
  if (geometry.triangles.empty()) return corrupt(path, ": holds no face");
  geometry.points.reserve(corners.size());
  for (const auto& corner : corners) geometry.points.push_back(corner.cast<double>());
  geometry.single = true;
  return geometry;
}

}  // namespace backwash::maps
