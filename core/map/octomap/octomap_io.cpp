// SPDX-License-Identifier: BSD-3-Clause
#include <charconv>
#include <optional>
#include <string_view>

#include "core/files/read_file.hpp"
#include "core/map/load_map.hpp"
#include "core/map/octomap/octomap_message.hpp"
#include "core/map/octomap/octomap_tree.hpp"

namespace backwash::map {
namespace {

constexpr std::string_view kBinaryMagic = "# Octomap OcTree binary file";
constexpr std::string_view kFullMagic = "# Octomap OcTree file";

tl::unexpected<MapError> error(MapError::Kind kind, const std::string& path, const std::string& what) {
  return tl::make_unexpected(MapError{kind, path + ": " + what});
}

tl::expected<std::string, MapError> content_of(const std::string& path, std::size_t max_bytes) {
  using Kind = MapError::Kind;
  auto content = files::read_file(path, max_bytes, "an OctoMap file");
  if (content) return std::move(*content);
  const bool too_large = content.error().kind == files::FileError::Kind::too_large;
  return error(too_large ? Kind::too_large : Kind::not_found, path, content.error().message);
}

/// A number that fills the whole text, or nothing.
template <class T>
std::optional<T> number(std::string_view text) {
  T value{};
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

struct Header {
  std::string id;
  std::optional<std::size_t> nodes;
  std::optional<double> resolution;
  std::optional<std::string_view> data;  // everything after the line `data`
};

/// Lines `# comment`, `id NAME`, `size NODES`, `res METRES` up to `data`; an incomplete header leaves its fields empty.
Header parse_header(std::string_view text) {
  Header header;
  while (!header.data) {
    const auto end = text.find('\n');
    if (end == std::string_view::npos) break;
    const auto line = text.substr(0, end);
    text.remove_prefix(end + 1);
    if (line.starts_with("id ")) header.id = line.substr(3);
    if (line.starts_with("size ")) header.nodes = number<std::size_t>(line.substr(5));
    if (line.starts_with("res ")) header.resolution = number<double>(line.substr(4));
    if (line == "data") header.data = text;
  }
  return header;
}

}  // namespace

tl::expected<OccupancyGrid, MapError> load_octomap(const std::string& path, std::size_t max_bytes) {
  using Kind = MapError::Kind;
  const auto content = content_of(path, max_bytes);
  if (!content) return tl::make_unexpected(content.error());
  const bool binary = content->starts_with(kBinaryMagic);
  if (!binary && !content->starts_with(kFullMagic)) {
    return error(Kind::corrupt, path,
                 "not an OctoMap file: the first line should be '" + std::string(kBinaryMagic) + "' or '" +
                     std::string(kFullMagic) + "'");
  }
  const Header header = parse_header(*content);
  if (!header.data) return error(Kind::corrupt, path, "the header has no line 'data'");
  if (!header.resolution) return error(Kind::corrupt, path, "the header has no line 'res METRES'");
  if (!header.nodes) return error(Kind::corrupt, path, "the header has no line 'size NODES'");

  const std::span data(reinterpret_cast<const std::int8_t*>(header.data->data()), header.data->size());
  auto grid = decode_octomap(data, *header.resolution, binary, header.id, max_bytes);
  if (!grid) return error(grid.error().kind, path, grid.error().message);
  const auto nodes =
      octomap_tree::walk(data, binary, *octomap_tree::bytes_beside(header.id), [](const Index3&, int, Cell) {}).nodes;
  if (nodes != *header.nodes) {
    return error(
        Kind::corrupt, path,
        "the header says size " + std::to_string(*header.nodes) + ", the tree has " + std::to_string(nodes) + " nodes");
  }
  return grid;
}

}  // namespace backwash::map
