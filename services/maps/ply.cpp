// SPDX-License-Identifier: BSD-3-Clause
// assimp reads PLY too, but takes one that is cut short as whole (corners that it never read), and doubles as floats.
#include <algorithm>
#include <cstdio>
#include <map>

#include "services/maps/geometry.hpp"
#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

struct Property {
  std::string name;
  Scalar type;
  std::optional<Scalar> count;  // of a list: the type of its length
};
struct Element {
  std::string name;
  std::size_t count;
  std::vector<Property> properties;
};
enum class Body { none, ascii, little, big };
struct Header {
  Body body = Body::none;
  std::vector<Element> elements;
  std::size_t lines = 0;
};

std::optional<Scalar> type_of(std::string_view name) {
  using Kind = Scalar::Kind;
  static const std::map<std::string_view, Scalar> types = {
      {"char", {Kind::is_signed, 1}},     {"int8", {Kind::is_signed, 1}},     {"uchar", {Kind::is_unsigned, 1}},
      {"uint8", {Kind::is_unsigned, 1}},  {"short", {Kind::is_signed, 2}},    {"int16", {Kind::is_signed, 2}},
      {"ushort", {Kind::is_unsigned, 2}}, {"uint16", {Kind::is_unsigned, 2}}, {"int", {Kind::is_signed, 4}},
      {"int32", {Kind::is_signed, 4}},    {"uint", {Kind::is_unsigned, 4}},   {"uint32", {Kind::is_unsigned, 4}},
      {"float", {Kind::floating, 4}},     {"float32", {Kind::floating, 4}},   {"double", {Kind::floating, 8}},
      {"float64", {Kind::floating, 8}}};
  const auto found = types.find(name);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

/// `property TYPE NAME` or `property list COUNT TYPE NAME`, after its first word.
std::optional<Property> property_of(std::string_view line) {
  Property property;
  auto word = take_word(line);
  if (word == "list") {
    property.count = type_of(take_word(line));
    if (!property.count || property.count->kind == Scalar::Kind::floating) return std::nullopt;
    word = take_word(line);
  }
  const auto type = type_of(word);
  property.name = take_word(line);
  if (!type || property.name.empty()) return std::nullopt;
  property.type = *type;
  return property;
}

/// One line of the header; what is wrong with it, or nothing.
std::string header_line(std::string_view line, Header& header) {
  const auto word = take_word(line);
  if (word == "format") {
    const auto format = take_word(line);
    header.body = format == "ascii"                  ? Body::ascii
                  : format == "binary_little_endian" ? Body::little
                  : format == "binary_big_endian"    ? Body::big
                                                     : Body::none;
    return header.body != Body::none
               ? ""
               : "format " + shown(format) + " should be ascii, binary_little_endian or binary_big_endian";
  }
  if (word == "element") {
    const std::string name(take_word(line));
    const auto text = take_word(line);
    const auto count = count_of(text);
    if (!count) return "element " + shown(name) + " has the count " + shown(text) + ", which should be a whole number";
    header.elements.push_back({name, *count, {}});
    return "";
  }
  if (word == "property") {
    if (header.elements.empty()) return "a property comes before the first element";
    const auto property = property_of(line);
    if (!property)
      return "property" + std::string(line.substr(0, 60)) + ": should be TYPE NAME, or list COUNT TYPE NAME";
    header.elements.back().properties.push_back(*property);
    return "";
  }
  return word == "comment" || word == "obj_info" || word.empty() ? "" : "the header has a line " + shown(word);
}

tl::expected<Header, std::string> header_of(std::string_view& text) {
  Header header;
  while (!text.empty()) {
    const auto line = take_line(text);
    ++header.lines;
    if (line == "end_header") {
      if (header.body == Body::none) return tl::make_unexpected("1: the header has no line 'format'");
      return header;
    }
    const auto wrong = header.lines > 1 ? header_line(line, header)
                       : line == "ply"  ? ""
                                        : "the first line should be 'ply'";
    if (!wrong.empty()) return tl::make_unexpected(std::to_string(header.lines) + ": " + wrong);
  }
  return tl::make_unexpected(std::to_string(header.lines) + ": the header ends without a line 'end_header'");
}

/// The numbers after the header, one by one.
class Numbers {
 public:
  Numbers(std::string_view rest, std::size_t bytes, const Header& header)
      : rest_(rest), whole_(bytes), body_(header.body), line_(header.lines) {}

  /// An element begins: in ascii, on a line of its own.
  void begin() {
    if (body_ != Body::ascii) return;
    do {
      ++line_;
      text_ = take_line(rest_);
    } while (text_.find_first_not_of(" \t") == text_.npos && !rest_.empty());
  }
  /// The next number; nothing at the end, or where there is none: `wrong` says so.
  std::optional<double> next(Scalar type) {
    if (body_ == Body::ascii) return next_word();
    if (rest_.size() < type.bytes) {
      wrong_ = ": ends at byte " + std::to_string(whole_) + " in the middle of ";
      return std::nullopt;
    }
    const double value =
        value_of(type, rest_.substr(0, type.bytes), body_ == Body::big ? std::endian::big : std::endian::little);
    rest_.remove_prefix(type.bytes);
    return value;
  }
  const std::string& wrong() const { return wrong_; }
  std::size_t line() const { return body_ == Body::ascii ? line_ : 0; }
  std::size_t left() const { return rest_.find_first_not_of(" \t\r\n") == rest_.npos ? 0 : rest_.size(); }

 private:
  std::optional<double> next_word() {
    const auto word = take_word(text_);
    const auto value = number_of(word);
    if (!value)
      wrong_ = ":" + std::to_string(line_) + ": " +
               (word.empty() ? std::string("ends too early") : shown(word) + " is no number") + " in ";
    return value;
  }

  std::string_view rest_, text_;
  std::size_t whole_;
  Body body_;
  std::size_t line_;
  std::string wrong_;
};

bool is_corners(const Property& property) { return property.count && property.name.starts_with("vertex_ind"); }

std::string plain(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

std::size_t vertices_in(const Header& header) {
  std::size_t count = 0;
  for (const auto& element : header.elements)
    if (element.name == "vertex") count += element.count;
  return count;
}

/// Takes elements in: corners of faces as triangles around their first one, vertices as points.
class Taker {
 public:
  Taker(Geometry& geometry, const Header& header) : geometry_(geometry), vertices_(vertices_in(header)) {}
  /// Reads one element; empty, or what is wrong.
  std::string take(const Element& element, std::size_t number, Numbers& numbers) {
    numbers.begin();
    const std::string which = element.name + " " + std::to_string(number + 1) + " of " + std::to_string(element.count);
    Vec3 p = Vec3::Zero();
    for (const auto& property : element.properties) {
      const auto value = numbers.next(property.count.value_or(property.type));
      if (!value) return numbers.wrong() + which;
      if (property.count) {
        if (auto wrong = list(element, property, *value, numbers); !wrong.empty())
          return wrong.starts_with('@') ? ": " + which + wrong.substr(1) : wrong + which;
      } else if (element.name == "vertex" && property.name.size() == 1 && property.name[0] >= 'x' &&
                 property.name[0] <= 'z') {
        p[property.name[0] - 'x'] = *value;
      }
    }
    if (element.name == "vertex") geometry_.points.push_back(p);
    return "";
  }

 private:
  /// What is wrong: '@' and what follows the element's name, or what comes before it.
  std::string list(const Element& element, const Property& property, double length, Numbers& numbers) {
    if (!(length >= 0 && length <= static_cast<double>(kMostPoints)))
      return "@: a list of " + plain(length) + " numbers is no list";
    const bool face = element.name == "face" && is_corners(property);
    std::vector<std::uint32_t> corners;
    for (std::size_t n = 0; n < static_cast<std::size_t>(length); ++n) {
      const auto value = numbers.next(property.type);
      if (!value) return numbers.wrong();
      if (!face) continue;
      if (!(*value >= 0 && *value < static_cast<double>(vertices_)))
        return "@: names vertex " + plain(*value) + ", and there are 0 to " + plain(static_cast<double>(vertices_) - 1);
      corners.push_back(static_cast<std::uint32_t>(*value));
    }
    if (!face) return "";
    if (corners.empty()) return "@: has no corner";
    if (geometry_.points.size() < vertices_) return "@: comes before the vertices; write them first";
    add_face(geometry_, corners, numbers.line());
    ++geometry_.taken;
    return "";
  }

  Geometry& geometry_;
  std::size_t vertices_;
};

/// What the header says that cannot be read here; empty: nothing.
std::string unfit(const Header& header) {
  const auto has = [](const Element& element, const auto& what) {
    return std::ranges::any_of(element.properties, what);
  };
  bool vertices = false;
  for (const auto& element : header.elements) {
    const auto& name = element.name;
    if ((name == "tristrips" || name == "edge") && element.count > 0)
      return "has " + name + ", which are not read; export it with faces of three corners";
    if (name == "face" && element.count > 0 && !has(element, is_corners))
      return "element face has no list vertex_indices";
    if (name != "vertex") continue;
    vertices = true;
    for (const char* axis : {"x", "y", "z"})
      if (!has(element, [&](const Property& p) { return p.name == axis && !p.count; }))
        return std::string("element vertex has no property ") + axis;
  }
  return vertices ? "" : "the header has no element vertex";
}

}  // namespace

Read read_ply(const std::string& path, std::string_view content) {
  std::string_view rest = content;
  const auto header = header_of(rest);
  if (!header) return corrupt(path, ":" + header.error());
  if (const auto wrong = unfit(*header); !wrong.empty()) return corrupt(path, ": " + wrong);
  Geometry geometry;
  Numbers numbers(rest, content.size(), *header);
  Taker taker(geometry, *header);
  for (const auto& element : header->elements) {
    if (element.properties.empty() && element.count > 0)
      return corrupt(path, ": element " + shown(element.name) + " has no property");
    if ((element.name == "vertex" || element.name == "face") && element.count > kMostPoints)
      return too_large(path, element.count);
    for (const auto& property : element.properties)
      if (element.name == "vertex" && property.name == "x") geometry.single = property.type.bytes < 8;
    if (element.name == "face") geometry.stated += element.count;
    for (std::size_t n = 0; n < element.count; ++n)
      if (const auto wrong = taker.take(element, n, numbers); !wrong.empty()) return corrupt(path, wrong);
  }
  if (geometry.triangles.empty()) {
    geometry.stated = vertices_in(*header);
    geometry.taken = geometry.points.size();
  }
  if (numbers.left() > 0)
    return corrupt(path, ": holds " + std::to_string(numbers.left()) +
                             " bytes behind the last element that its header counts; mend the counts");
  return geometry;
}

}  // namespace backwash::maps
