// SPDX-License-Identifier: BSD-3-Clause
#include "services/maps/scalars.hpp"

#include <algorithm>
#include <charconv>

namespace backwash::maps {
namespace {

constexpr std::string_view kBlank = " \t\r";

template <typename T>
std::optional<T> whole(std::string_view text) noexcept {
  T value{};
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

double value_of(Scalar scalar, std::string_view bytes, std::endian order) noexcept {
  std::uint64_t raw = 0;
  for (std::size_t n = 0; n < bytes.size(); ++n)
    raw = raw << 8 | static_cast<std::uint8_t>(bytes[order == std::endian::big ? n : bytes.size() - 1 - n]);
  if (scalar.kind == Scalar::Kind::floating)
    return scalar.bytes == 8 ? std::bit_cast<double>(raw) : std::bit_cast<float>(static_cast<std::uint32_t>(raw));
  if (scalar.kind == Scalar::Kind::is_unsigned) return static_cast<double>(raw);
  const auto unused = 64 - 8 * scalar.bytes;
  return static_cast<double>(static_cast<std::int64_t>(raw << unused) >> unused);
}

std::optional<double> number_of(std::string_view text) noexcept {
  if (text.starts_with('+')) text.remove_prefix(1);
  return whole<double>(text);
}
std::optional<std::size_t> count_of(std::string_view text) noexcept { return whole<std::size_t>(text); }

std::string_view take_line(std::string_view& text) noexcept {
  const auto end = std::min(text.find('\n'), text.size());
  auto line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string_view take_word(std::string_view& line) noexcept {
  line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
  const auto word = line.substr(0, line.find_first_of(kBlank));
  line.remove_prefix(word.size());
  return word;
}

std::string shown(std::string_view text) {
  std::string told(text.substr(0, 40));
  std::ranges::replace_if(
      told, [](unsigned char c) { return c < ' ' || c > '~'; }, '?');
  return "'" + told + (text.size() > 40 ? "…'" : "'");
}

}  // namespace backwash::maps
