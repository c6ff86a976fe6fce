// SPDX-License-Identifier: BSD-3-Clause
// assimp 5.2.5 lets faces with texture coordinates vanish where the file has none before them; places alone are read
// here.
#include <algorithm>
#include <array>
#include <span>

#include "services/maps/geometry.hpp"
#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

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

/// Takes a face, the parts of a line, or points in; what is wrong, or nothing. What each word names is the vertex
/// before its first slash: from 1 on, or back from the last of the `before` ones.
std::string take_element(char kind, std::string_view words, std::size_t before, std::size_t line, Geometry& geometry) {
  std::vector<std::uint32_t> corners;
  for (auto word = take_word(words); !word.empty(); word = take_word(words)) {
    const auto index = word.substr(0, word.find('/'));
    const bool back = index.starts_with('-');
    const auto number = count_of(index.substr(back)).value_or(0), most = back ? before : geometry.points.size();
    if (number == 0 || number > most) return shown(word) + " names none of " + std::to_string(most) + " vertices";
    corners.push_back(static_cast<std::uint32_t>(back ? before - number : number - 1));
  }
  const std::size_t count = corners.size(), least = kind == 'f' ? 3 : kind == 'l' ? 2 : 1;
  if (count < least || geometry.triangles.size() + count > kMostPoints)
    return std::string(1, kind) + " of " + std::to_string(count) + " corners, at least " + std::to_string(least);
  const std::size_t each = kind == 'f' ? count : least;
  for (std::size_t n = 0; n + each <= count; ++n) add_face(geometry, std::span(corners).subspan(n, each), line);
  geometry.taken += kind == 'f';
  return "";
}

/// Statements that are read, or hold no shape by themselves.
constexpr std::array<std::string_view, 31> kStatements{
    "v",      "vt",     "vn",     "vp",     "f",     "l",   "p",      "g",     "s",         "o",    "mg",
    "usemtl", "mtllib", "usemap", "maplib", "bevel", "lod", "cstype", "deg",   "bmat",      "step", "parm",
    "trim",   "hole",   "scrv",   "sp",     "end",   "con", "ctech",  "stech", "shadow_obj"};

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
  for (const bool places : {true, false}) {  // faces may be before their vertices
    std::size_t before = 0;
    for (Statements statements(text); statements.next();) {
      auto words = statements.words();
      const auto what = take_word(words);
      std::string why;
      before += what == "v";
      if (places && what == "v") why = take_place(words, geometry);
      if (!places && (what == "f" || what == "l" || what == "p"))
        why = take_element(what[0], words, before, statements.line(), geometry);
      if (what == "curv" || what == "surf" || what == "curv2" || what == "call")
        why = shown(what) + " is not read; export it as faces in one file";
      else if (!what.empty() && std::ranges::find(kStatements, what) == kStatements.end())
        why = shown(what) + " is no statement of an OBJ file that is known, and may hold faces; export faces as f";
      if (!why.empty()) return corrupt(path, ":" + std::to_string(statements.line()) + ": " + why);
      if (before > kMostPoints) return too_large(path, before);
    }
  }
  geometry.stated = faces_in(text);
  if (geometry.triangles.empty()) return corrupt(path, ": holds no face; a cloud is written as PLY");
  return geometry;
}

}  // namespace backwash::maps
