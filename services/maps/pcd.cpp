// SPDX-License-Identifier: BSD-3-Clause
#include <liblzf/lzf.h>

#include <algorithm>
#include <array>

#include "services/maps/geometry.hpp"
#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

/// What the header of a PCD says, words by key.
struct Header {
  std::vector<std::string> fields;
  std::vector<Scalar> types;
  std::vector<std::size_t> counts;
  std::size_t points = 0, lines = 0;
  std::string data, viewpoint;

  std::size_t stride() const {  // bytes of a point
    std::size_t sum = 0;
    for (std::size_t n = 0; n < fields.size(); ++n) sum += types[n].bytes * counts[n];
    return sum;
  }
};

std::vector<std::string> words_of(std::string_view line) {
  std::vector<std::string> words;
  for (auto word = take_word(line); !word.empty(); word = take_word(line)) words.emplace_back(word);
  return words;
}

/// TYPE and SIZE of the fields; what is wrong, or nothing.
std::string take_types(const std::vector<std::string>& types, const std::vector<std::string>& sizes, Header& header) {
  if (types.size() != header.fields.size() || sizes.size() != header.fields.size())
    return "SIZE, TYPE and FIELDS should name equally many fields";
  for (std::size_t n = 0; n < types.size(); ++n) {
    const auto bytes = count_of(sizes[n]).value_or(0);
    const auto kind = types[n] == "F"   ? Scalar::Kind::floating
                      : types[n] == "U" ? Scalar::Kind::is_unsigned
                                        : Scalar::Kind::is_signed;
    const bool known = types[n] == "F" || types[n] == "U" || types[n] == "I";
    const bool fits = bytes == 4 || bytes == 8 || (kind != Scalar::Kind::floating && (bytes == 1 || bytes == 2));
    if (!known || !fits)
      return "field " + shown(header.fields[n]) + " has the type " + shown(types[n] + sizes[n]) +
             "; known are F4, F8, I1 to I8 and U1 to U8";
    header.types.push_back({kind, bytes});
  }
  return "";
}

std::string take_counts(const std::vector<std::string>& counts, Header& header) {
  header.counts.assign(header.fields.size(), 1);
  if (counts.empty()) return "";
  if (counts.size() != header.fields.size()) return "COUNT and FIELDS should name equally many fields";
  for (std::size_t n = 0; n < counts.size(); ++n) {
    const auto count = count_of(counts[n]);
    if (!count || *count > 65536) return "COUNT " + shown(counts[n]) + " should be a whole number up to 65536";
    header.counts[n] = *count;
  }
  return "";
}

std::string check_header(const std::vector<std::string>& keys, Header& header) {
  for (const char* axis : {"x", "y", "z"})
    if (std::ranges::count(header.fields, axis) != 1) return std::string("FIELDS should name ") + axis + " once";
  const auto points = count_of(keys[2].empty() ? "" : keys[2]), width = count_of(keys[0]), height = count_of(keys[1]);
  if (!points && !(width && height)) return "the header has no line POINTS";
  if (width && height && *width > 0 && *height > kMostPoints * 16 / *width)
    return "WIDTH x HEIGHT is beyond what a file holds";
  header.points = points ? *points : *width * *height;
  if (width && height && *width * *height != header.points)
    return "POINTS " + keys[2] + " should be WIDTH " + keys[0] + " x HEIGHT " + keys[1];
  if (header.data != "ascii" && header.data != "binary" && header.data != "binary_compressed")
    return "DATA " + shown(header.data) + " should be ascii, binary or binary_compressed";
  return "";
}

/// Reads up to the line DATA; what is wrong, as LINE: what, or nothing.
std::string read_header(std::string_view& rest, Header& header) {
  std::vector<std::string> types, sizes, counts, keys(3);
  std::string wrong = "the header ends without a line DATA";
  while (!rest.empty() && header.data.empty() && header.lines < 1000) {
    auto line = take_line(rest);
    ++header.lines;
    const auto key = take_word(line);
    const auto words = words_of(line);
    const std::string first = words.empty() ? "" : words[0];
    if (key.empty() || key.starts_with('#') || key == "VERSION") continue;
    if (key == "FIELDS" || key == "COLUMNS")
      header.fields = words;
    else if (key == "SIZE")
      sizes = words;
    else if (key == "TYPE")
      types = words;
    else if (key == "COUNT")
      counts = words;
    else if (key == "WIDTH")
      keys[0] = first;
    else if (key == "HEIGHT")
      keys[1] = first;
    else if (key == "POINTS")
      keys[2] = first;
    else if (key == "VIEWPOINT")
      for (const auto& word : words) header.viewpoint += word + " ";
    else if (key == "DATA") {
      header.data = first.empty() ? "?" : first;
      wrong = "";
    } else
      return std::to_string(header.lines) + ": " + shown(key) + " is no line of a PCD header; the first is '# .PCD …'";
  }
  if (wrong.empty()) wrong = take_types(types, sizes, header);
  if (wrong.empty()) wrong = take_counts(counts, header);
  if (wrong.empty()) wrong = check_header(keys, header);
  return wrong.empty() ? "" : std::to_string(header.lines) + ": " + wrong;
}

/// Where x, y, z are in a point: which field, and the bytes or words before it.
struct Places {
  std::array<std::size_t, 3> field{}, bytes{}, words{};
};
Places places_of(const Header& header) {
  Places places;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t n = 0; header.fields[n] != std::string(1, static_cast<char>('x' + axis)); ++n) {
      places.bytes[axis] += header.types[n].bytes * header.counts[n];
      places.words[axis] += header.counts[n];
      places.field[axis] = n + 1;
    }
  }
  return places;
}

constexpr const char* kMore = ": holds more points than POINTS says; write it again";

std::string take_ascii(std::string_view rest, const Header& header, Geometry& geometry) {
  const auto places = places_of(header);
  std::size_t line_number = header.lines;
  while (geometry.points.size() < header.points) {
    if (rest.empty())
      return ":" + std::to_string(line_number) + ": ends after " + std::to_string(geometry.points.size()) + " of " +
             std::to_string(header.points) + " points";
    const auto line = take_line(rest);
    ++line_number;
    const auto words = words_of(line);
    if (words.empty()) continue;
    Vec3 p;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string word = places.words[axis] < words.size() ? words[places.words[axis]] : "";
      const auto value = number_of(word);
      if (!value)
        return ":" + std::to_string(line_number) + ": " + static_cast<char>('x' + axis) + " is " + shown(word) +
               ", which is no number";
      p[static_cast<int>(axis)] = *value;
    }
    geometry.points.push_back(p);
  }
  return rest.find_first_not_of(" \t\r\n") == rest.npos ? "" : kMore;
}

/// Points in their order in the file, or (`by_field`) one field of all points after the other.
std::string take_binary(std::string_view bytes, const Header& header, bool by_field, Geometry& geometry) {
  const auto places = places_of(header);
  const auto stride = header.stride();
  if (bytes.size() / stride < header.points)
    return ": ends after " + std::to_string(bytes.size() / stride) + " of " + std::to_string(header.points) +
           " points of " + std::to_string(stride) + " bytes";
  if (bytes.size() / stride > header.points) return kMore;
  for (std::size_t n = 0; n < header.points; ++n) {
    Vec3 p;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto type = header.types[places.field[axis]];
      const std::size_t one = type.bytes * header.counts[places.field[axis]];
      const auto at = by_field ? header.points * places.bytes[axis] + n * one : n * stride + places.bytes[axis];
      p[static_cast<int>(axis)] = value_of(type, bytes.substr(at, type.bytes), std::endian::little);
    }
    geometry.points.push_back(p);
  }
  return "";
}

/// Two lengths of four bytes, then what LZF made of all fields, one after the other.
std::string take_compressed(std::string_view rest, const Header& header, Geometry& geometry) {
  constexpr Scalar kLength{Scalar::Kind::is_unsigned, 4};
  if (rest.size() < 8) return ": ends before the lengths of its compressed points";
  const auto packed = static_cast<std::size_t>(value_of(kLength, rest.substr(0, 4), std::endian::little));
  const auto whole = static_cast<std::size_t>(value_of(kLength, rest.substr(4, 4), std::endian::little));
  rest.remove_prefix(8);
  if (rest.size() < packed)
    return ": ends after " + std::to_string(rest.size()) + " of " + std::to_string(packed) +
           " bytes of compressed points";
  if (whole != header.points * header.stride())
    return ": " + std::to_string(header.points) + " points of " + std::to_string(header.stride()) +
           " bytes are not the " + std::to_string(whole) + " bytes that it says it compresses";
  // LZF makes at most 264 bytes of 3.
  std::string bytes(whole <= 88 * packed ? whole : 0, '\0');
  if (bytes.empty() ||
      lzf_decompress(rest.data(), static_cast<unsigned>(packed), bytes.data(), static_cast<unsigned>(whole)) != whole)
    return ": its compressed points are damaged; write it again as DATA binary";
  return take_binary(bytes, header, true, geometry);
}

/// No turn and no way: the pose that says nothing.
bool says_nothing(const std::string& viewpoint) {
  const auto words = words_of(viewpoint);
  for (std::size_t n = 0; n < words.size(); ++n)
    if (number_of(words[n]).value_or(0) != (n == 3 ? 1 : 0)) return false;
  return true;
}

}  // namespace

Read read_pcd(const std::string& path, std::string_view content) {
  std::string_view rest = content;
  Header header;
  if (const auto wrong = read_header(rest, header); !wrong.empty()) return corrupt(path, ":" + wrong);
  if (header.points > kMostPoints) return too_large(path, header.points);
  Geometry geometry;
  const auto wrong = header.data == "ascii"    ? take_ascii(rest, header, geometry)
                     : header.data == "binary" ? take_binary(rest, header, false, geometry)
                                               : take_compressed(rest, header, geometry);
  if (!wrong.empty()) return corrupt(path, wrong);
  geometry.stated = header.points;
  geometry.taken = geometry.points.size();
  geometry.single = header.types[places_of(header).field[0]].bytes < 8;
  if (!says_nothing(header.viewpoint))
    geometry.notes.push_back("VIEWPOINT " + header.viewpoint + "is not applied: the points are taken as they stand");
  return geometry;
}

}  // namespace backwash::maps
