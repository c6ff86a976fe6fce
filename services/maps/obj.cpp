// SPDX-License-Identifier: BSD-3-Clause
// assimp 5.2.5 lets faces with texture coordinates vanish where the file has none before them; places alone are read
// here.
#include <algorithm>

#include "services/maps/faces.hpp"
#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

constexpr std::size_t kMostCorners = 1 << 20;  // of a face

/// A statement's line, of which a backslash at its end makes one with the next; without its comment.
class Statements {
 public:
  explicit Statements(std::string_view text) : text_(text) {}
  bool next() {
    if (text_.empty()) return false;
    first_ = ++line_;
    whole_ = take_line(text_);
    while (whole_.ends_with('\\') && !text_.empty()) {
      whole_.back() = ' ';
      whole_ += take_line(text_);
      ++line_;
    }
    whole_.resize(std::min(whole_.find('#'), whole_.size()));
    return true;
  }
  std::string_view words() const { return whole_; }
  std::size_t line() const { return first_; }

 private:
  std::string_view text_;
  std::string whole_;
  std::size_t line_ = 0, first_ = 0;
};

/// Takes `v x y z [w]` or `v x y z r g b` in; what is wrong, or nothing.
std::string take_place(std::string_view words, Geometry& geometry) {
  std::vector<double> numbers;
  for (auto word = take_word(words); !word.empty(); word = take_word(words)) {
    const auto value = number_of(word);
    if (!value) return shown(word) + " is no number";
    numbers.push_back(*value);
  }
  if (numbers.size() < 3) return "a vertex has x, y and z";
  if (numbers.size() == 4 && numbers[3] != 1) return "a vertex with a weight other than 1 is of curves; export faces";
  geometry.points.emplace_back(numbers[0], numbers[1], numbers[2]);
  return "";
}

/// What a face names is the vertex before the first slash: from 1 on, or back from the last one before it. The corners,
/// or what is wrong.
tl::expected<std::vector<std::int64_t>, std::string> corners_of(std::string_view words, std::size_t before) {
  std::vector<std::int64_t> corners;
  for (auto word = take_word(words); !word.empty(); word = take_word(words)) {
    const auto index = word.substr(0, word.find('/'));
    const bool back = index.starts_with('-');
    const auto number = count_of(index.substr(back));
    if (!number || *number == 0 || *number > (back ? before : kMostPoints))
      return tl::make_unexpected(shown(word) + " names no vertex; " + std::to_string(before) + " are before it");
    const auto place = static_cast<std::int64_t>(*number);
    corners.push_back(back ? static_cast<std::int64_t>(before) - place : place - 1);
    if (corners.size() > kMostCorners) return tl::make_unexpected("a face of too many corners");
  }
  return corners;
}

/// Faces wait for vertices that come behind them.
struct Waiting {
  std::vector<std::int64_t> corners;
  std::vector<std::pair<std::size_t, std::size_t>> ends;  // of each, with its line
};

/// What is wrong with a face, a line or points, or nothing.
std::string take_element(char kind, std::string_view words, std::size_t line, const Geometry& geometry,
                         Waiting& waiting) {
  const auto corners = corners_of(words, geometry.points.size());
  if (!corners) return corners.error();
  const std::size_t count = corners->size(), least = kind == 'f' ? 3 : kind == 'l' ? 2 : 1;
  if (count < least)
    return std::string(1, kind) + " of " + std::to_string(count) + " corners, of which it has " + std::to_string(least);
  const std::size_t each = kind == 'f' ? count : kind == 'l' ? 2 : 1;  // a line is its parts
  for (std::size_t n = 0; n + each <= count; ++n) {
    waiting.corners.insert(waiting.corners.end(), corners->begin() + static_cast<std::ptrdiff_t>(n),
                           corners->begin() + static_cast<std::ptrdiff_t>(n + each));
    waiting.ends.emplace_back(waiting.corners.size(), line);
  }
  return waiting.corners.size() > kMostPoints ? "too many corners of faces" : "";
}

/// Faces that the text says, by the first words of its lines alone.
std::size_t faces_in(std::string_view text) {
  std::size_t count = 0;
  for (bool goes_on = false; !text.empty();) {
    const auto line = take_line(text);
    auto words = line;
    count += !goes_on && take_word(words) == "f";
    goes_on = line.ends_with('\\');
  }
  return count;
}

}  // namespace

Read read_obj(const std::string& path, std::string_view text) {
  Geometry geometry;
  Waiting waiting;
  Statements statements(text);
  const auto wrong = [&](std::size_t line, const std::string& what) {
    return corrupt(path, ":" + std::to_string(line) + ": " + what);
  };
  while (statements.next()) {
    auto words = statements.words();
    const auto what = take_word(words);
    std::string why;
    if (what == "v") why = take_place(words, geometry);
    if (what == "f" || what == "l" || what == "p")
      why = take_element(what[0], words, statements.line(), geometry, waiting);
    if (what == "curv" || what == "surf" || what == "curv2" || what == "call")
      why = shown(what) + " is not read; export it as faces in one file";
    if (!why.empty()) return wrong(statements.line(), why);
    if (geometry.points.size() > kMostPoints) return too_large(path, geometry.points.size());
  }
  std::size_t begin = 0;
  std::vector<std::uint32_t> face;
  for (const auto& [end, line] : waiting.ends) {
    face.clear();
    for (; begin < end; ++begin) {
      if (static_cast<std::size_t>(waiting.corners[begin]) >= geometry.points.size())
        return wrong(line, "names vertex " + std::to_string(waiting.corners[begin] + 1) + " of " +
                               std::to_string(geometry.points.size()));
      face.push_back(static_cast<std::uint32_t>(waiting.corners[begin]));
    }
    add_face(geometry, face, line);
    geometry.taken += face.size() > 2;
  }
  geometry.stated = faces_in(text);
  if (geometry.triangles.empty()) return corrupt(path, ": holds no face; a cloud is written as PLY");
  return geometry;
}

}  // namespace backwash::maps
