// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cstring>
#include <nlohmann/json.hpp>

#include "services/maps/geometry.hpp"
#include "services/maps/in_child.hpp"
#include "services/maps/scalars.hpp"

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

/// A glTF that is a text may name files beside it.
void import(const std::string& path, std::string_view content, bool gltf, const Sink& sink) {
  constexpr unsigned kFlags = aiProcess_PreTransformVertices | aiProcess_Triangulate;
  Assimp::Importer importer;
  const char* const kind = !gltf ? "stl" : content.starts_with("glTF") ? "glb" : nullptr;
  const aiScene* const scene = kind ? importer.ReadFileFromMemory(content.data(), content.size(), kFlags, kind)
                                    : importer.ReadFile(path, kFlags);
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

/// Triangles, lines and points of a primitive of `corners` corners, by its mode.
std::size_t faces_of(std::size_t corners, int mode) {
  constexpr int kPoints = 0, kLines = 1, kLoop = 2, kTriangles = 4;
  if (mode == kPoints || mode == kLoop) return corners;
  if (mode == kLines || mode == kTriangles) return corners / (mode == kLines ? 2 : 3);
  const std::size_t before = mode < kTriangles ? 1 : 2;  // of a strip or a fan
  return corners - std::min(corners, before);
}

bool is_stl_text(std::string_view content) {
  return content.size() > 5 && std::ranges::equal(content.substr(0, 5), std::string_view("solid"),
                                                  [](unsigned char a, char b) { return std::tolower(a) == b; });
}

/// The facets of an STL: by its head, which its size must bear out, or by its words.
tl::expected<std::size_t, std::string> facets_of(std::string_view content) {
  constexpr std::size_t kHead = 84, kFacet = 50, kShown = 80;  // bytes: before the facets, of each, before their count
  std::uint32_t said = 0;
  if (content.size() >= kHead) std::memcpy(&said, content.data() + kShown, sizeof said);
  if (content.size() == kHead + kFacet * said) return said;
  std::size_t opened = 0, closed = 0, corners = 0;
  for (auto rest = content; is_stl_text(content) && !rest.empty();) {
    auto line = take_line(rest);
    const auto word = take_word(line);
    const auto is = [&](std::string_view other) {
      return std::ranges::equal(word, other, [](unsigned char a, char b) { return std::tolower(a) == b; });
    };
    opened += is("facet");
    closed += is("endfacet");
    corners += is("vertex");
  }
  if (closed > 0 && opened == closed && corners == 3 * closed) return opened;
  return tl::make_unexpected("STL: its head says " + std::to_string(said) + " facets, and it has " +
                             std::to_string(content.size()) + " bytes, " + std::to_string(opened) + " 'facet', " +
                             std::to_string(closed) + " 'endfacet' and " + std::to_string(corners) + " 'vertex'");
}

/// The faces that a scene's nodes show, by the counts of its accessors (glTF 2.0, 3.7.2): each mesh as often as a node
/// has it. Error: what is wrong.
tl::expected<std::size_t, std::string> faces_shown(std::string_view content) try {
  using nlohmann::json;
  constexpr std::size_t kHead = 20, kMostNodes = 1 << 20;  // of a binary file: its own head and that of its JSON
  if (content.starts_with("glTF")) {
    std::uint32_t length = 0;
    std::uint32_t all = 0;
    if (content.size() >= kHead) std::memcpy(&length, content.data() + 12, sizeof length);
    if (content.size() >= kHead) std::memcpy(&all, content.data() + 8, sizeof all);
    if (all != content.size())
      return tl::make_unexpected("has " + std::to_string(content.size()) + " bytes, and its head says " +
                                 std::to_string(all));
    if (length == 0 || content.size() - kHead < length) return tl::make_unexpected("is cut short");
    content = content.substr(kHead, length);
  }
  const json all = json::parse(content);
  for (const auto& name : all.value("extensionsUsed", json::array()))
    for (const char* other : {"EXT_meshopt_compression", "EXT_mesh_gpu_instancing"})
      if (name == other) return tl::make_unexpected(std::string(other) + " is not read; export it without");
  const auto& scene = all.at("scenes").at(all.value("scene", std::size_t{0}));
  std::vector<std::size_t> nodes = scene.value("nodes", std::vector<std::size_t>());
  std::size_t faces = 0;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const auto& node = all.at("nodes").at(nodes[n]);
    for (const auto child : node.value("children", std::vector<std::size_t>())) nodes.push_back(child);
    if (nodes.size() > kMostNodes) return tl::make_unexpected("its nodes lead in a circle");
    if (!node.contains("mesh")) continue;
    for (const auto& part : all.at("meshes").at(node["mesh"].get<std::size_t>()).at("primitives")) {
      const auto& corners = part.contains("indices") ? part["indices"] : part.at("attributes").at("POSITION");
      const auto& accessor = all.at("accessors").at(corners.get<std::size_t>());
      faces += faces_of(accessor.at("count").get<std::size_t>(), part.value("mode", 4));
    }
  }
  return faces;
} catch (const nlohmann::json::exception& error) {
  return tl::make_unexpected("glTF: " + one_line(error.what()));
}

}  // namespace

Read read_mesh(const std::string& path, std::string_view content, bool gltf) {
  const auto stated = gltf ? faces_shown(content) : facets_of(content);
  if (!stated) return corrupt(path, ": " + stated.error() + "; export it again");
  const std::size_t bytes = content.size();
  std::string lower;  // assimp knows an STL's words so alone
  if (!gltf && is_stl_text(content)) {
    lower.resize(bytes);
    std::ranges::transform(content, lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (const auto words = facets_of(lower); lower.find('\0') == lower.npos && words) content = lower;
  }
  // A slow text format takes a second for 1 MiB.
  const std::size_t seconds = 20 + (bytes >> 20), most_bytes = (std::size_t{2} << 30) + 40 * bytes;
  const auto said = in_child([&](const Sink& sink) { import(path, content, gltf, sink); }, seconds, most_bytes);
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
  if (gltf) geometry.up = "y";
  geometry.stated = *stated;
  geometry.taken = geometry.triangles.size();
  return geometry;
}

}  // namespace backwash::maps
