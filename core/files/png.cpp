// SPDX-License-Identifier: BSD-3-Clause
#include "core/files/png.hpp"

#include <zlib.h>

#include <vector>

namespace backwash::files {
namespace {

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(value >> shift & 0xffu);
  return bytes;
}

/// Its length, its name, what it holds, and the check sum of both.
std::string chunk(const std::string& name, const std::string& content) {
  const std::string summed = name + content;
  const auto sum = ::crc32(0, reinterpret_cast<const Bytef*>(summed.data()), static_cast<uInt>(summed.size()));
  return big_endian(static_cast<std::uint32_t>(content.size())) + summed + big_endian(static_cast<std::uint32_t>(sum));
}

}  // namespace

std::string png(std::size_t width, std::span<const std::uint32_t> rgba) {
  const std::size_t height = rgba.size() / width;
  std::string rows;
  for (std::size_t n = 0; n < width * height; ++n) {
    if (n % width == 0) rows += '\0';  // no filter
    rows += big_endian(rgba[n]);
  }
  uLongf size = ::compressBound(rows.size());
  std::string packed(size, '\0');
  ::compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(rows.data()), rows.size());
  packed.resize(size);
  const std::string head = big_endian(static_cast<std::uint32_t>(width)) +
                           big_endian(static_cast<std::uint32_t>(height)) + std::string("\x08\x06\0\0\0", 5);
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", head) + chunk("IDAT", packed) + chunk("IEND", "");
}

}  // namespace backwash::files
