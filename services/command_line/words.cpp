// SPDX-License-Identifier: BSD-3-Clause
#include "services/command_line/words.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstring>
#include <numeric>
#include <vector>

namespace backwash::services {
namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// Levenshtein's distance, case aside.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t before = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = before + (lower(a[i]) != lower(b[j]));
      before = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// Bytes of the well-formed UTF-8 sequence (RFC 3629) that the text begins with; 0: there is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t n) { return n < text.size() ? static_cast<unsigned char>(text[n]) : 0u; };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xc2 && first < 0xe0 ? 2 : first >= 0xe0 && first < 0xf0 ? 3 : 4;
  if (first < 0xc2 || first > 0xf4) return 0;
  for (std::size_t n = 1; n < length; ++n)
    if ((byte(n) & 0xc0) != 0x80) return 0;
  const unsigned second = byte(1);
  const bool too_long = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
  const bool no_character = (first == 0xed && second >= 0xa0) || (first == 0xf4 && second >= 0x90);
  return too_long || no_character ? 0 : length;
}

}  // namespace

std::string nearest(const std::string& said, std::span<const std::string> known) {
  const std::size_t letters = said.size() - std::min(said.find_first_not_of('-'), said.size());
  std::string best;
  std::size_t least = (letters + 2) / 3 + 1;
  for (const auto& name : known)
    if (const std::size_t d = distance(said, name); d < least) {
      least = d;
      best = name;
    }
  return best;
}

std::string in_plain_words(const std::string& message) {
  const std::string name = message.substr(0, message.find_first_of(": "));
  const auto says = [&](const char* words) { return message.find(words) != message.npos; };
  unsigned wanted = 0, given = 0;
  for (const char* count : {": At Most ", ": At Least ", ": At least "}) {
    const auto at = message.find(count);
    if (at == message.npos) continue;
    if (std::sscanf(message.c_str() + at + std::strlen(count), "%u required but received %u", &wanted, &given) != 2)
      continue;
    const std::string number = std::to_string(given);
    if (wanted == 1 && given > 1) return name + " is given " + number + " times; give it once";
    return name + " has " + number + (given == 1 ? " value" : " values") + "; it takes " + std::to_string(wanted);
  }
  if (says(" required ") && message.ends_with(" missing")) return name + " needs a value";
  if (says(" disallowed flag override")) return (name.starts_with('-') ? "" : "--") + name + " takes no value";
  const auto other = message.find(" excludes ");
  if (other != message.npos)
    return name + " and " + message.substr(other + std::strlen(" excludes ")) + " exclude each other; give one";
  return message;
}

std::string printable(const std::string& text) {
  constexpr char kHex[] = "0123456789abcdef";
  std::string safe;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(std::string_view(text).substr(at));
    const auto byte = static_cast<unsigned char>(text[at]);
    if (text[at] == '\n') {
      safe += ' ';
    } else if (length == 0 || byte < 0x20 || byte == 0x7f) {
      for (const char c : {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]}) safe += c;
    } else {
      safe.append(text, at, length);
    }
    at += std::max<std::size_t>(length, 1);
  }
  return safe;
}

void say_error(const std::string& who, const std::string& what) {
  std::fprintf(stderr, "%s: %s\n", who.c_str(), printable(what).c_str());
}

}  // namespace backwash::services
