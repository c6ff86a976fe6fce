// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/site/field_volume.hpp"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <ostream>
#include <span>

#include "core/field/extension.hpp"
#include "core/field/whole_field.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/progress.hpp"

namespace backwash::services {
namespace {

static_assert(std::endian::native == std::endian::little);  // as ZIP is, and the arrays say

struct Array {
  std::string name, type, shape;
  std::span<const std::byte> content;
};

/// The head of a .npy file, version 1.0: a Python literal, padded to 64 bytes.
std::string npy_head(const Array& array) {
  std::string text = "{'descr': '" + array.type + "', 'fortran_order': False, 'shape': (" + array.shape + "), }";
  constexpr std::size_t kBefore = 10;
  text.append(63 - (kBefore + text.size()) % 64, ' ') += '\n';
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(text.size() & 255) +
         static_cast<char>(text.size() >> 8) + text;
}

template <class... Numbers>
std::string little_endian(Numbers... numbers) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&numbers), sizeof numbers), ...);
  return bytes;
}

std::uint32_t crc_of(const std::string& head, std::span<const std::byte> content) {
  const uLong begun = ::crc32_z(0, reinterpret_cast<const Bytef*>(head.data()), head.size());
  return static_cast<std::uint32_t>(::crc32_z(begun, reinterpret_cast<const Bytef*>(content.data()), content.size()));
}

using U16 = std::uint16_t;
using U32 = std::uint32_t;
using U64 = std::uint64_t;

/// A ZIP file of stored entries (PKWARE's APPNOTE 6.3, sections 4.3.7 to 4.3.16). Sizes and places are in the fields of
/// ZIP64: a building's field is larger than 4 GB.
void write_zip(std::ostream& out, std::span<const Array> arrays) {
  constexpr U16 kVersion = 45, kZip64 = 1, kNewYear1980 = 33;
  constexpr U32 kElsewhere = ~U32{0};
  std::string directory;
  U64 at = 0;
  for (const auto& array : arrays) {
    const std::string name = array.name + ".npy", head = npy_head(array);
    const U64 size = head.size() + array.content.size();
    const std::string common = little_endian(U16{0}, U16{0}, U16{0}, kNewYear1980, crc_of(head, array.content),
                                             kElsewhere, kElsewhere, static_cast<U16>(name.size()));
    const std::string local = little_endian(U32{0x04034b50}, kVersion) + common + little_endian(U16{20}) + name +
                              little_endian(kZip64, U16{16}, size, size);
    directory += little_endian(U32{0x02014b50}, kVersion, kVersion) + common +
                 little_endian(U16{28}, U16{0}, U16{0}, U16{0}, U32{0}, kElsewhere) + name +
                 little_endian(kZip64, U16{24}, size, size, at);
    out << local << head;
    out.write(reinterpret_cast<const char*>(array.content.data()), static_cast<std::streamsize>(array.content.size()));
    at += local.size() + size;
  }
  const U64 length = directory.size(), count = arrays.size();
  const auto entries = static_cast<U16>(count);
  out << directory
      << little_endian(U32{0x06064b50}, U64{44}, kVersion, kVersion, U32{0}, U32{0}, count, count, length, at)
      << little_endian(U32{0x07064b50}, U32{0}, at + length, U32{1})
      << little_endian(U32{0x06054b50}, U16{0}, U16{0}, entries, entries, static_cast<U32>(length), kElsewhere, U16{0});
}

}  // namespace

std::vector<float> field_volume(const map::OccupancyGrid& grid, const Model& model) {
  std::vector<std::size_t> free;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == map::Cell::free) free.push_back(n);
  field::Extension extension(grid, model);
  extension.fill(grid, free);
  const double everywhere = extension.moving(Vec3::Zero()).ln_variance;
  std::vector<float> sigma(6 * grid.cell_count(), std::numeric_limits<float>::quiet_NaN());
  const field::WholeField whole(grid, model, free);
  run_shown(whole.block_count(), [&](std::size_t begin, std::size_t end) {
    whole.evaluate(begin, end, [&](std::size_t n, const Variance& hovering) {
      const Variance s = std::exp(everywhere + extension.at(grid.voxel(n)).ln_variance) * hovering;
      std::ranges::transform(std::array{s.xx, s.xy, s.xz, s.yy, s.yz, s.zz}, &sigma[6 * n],
                             [](double entry) { return static_cast<float>(entry); });
    });
  });
  return sigma;
}

void write_npz(const std::string& path, bool force, const map::OccupancyGrid& grid, const std::vector<float>& sigma) {
  const Index3& size = grid.size();
  const std::string shape =
      std::to_string(size.z()) + ", " + std::to_string(size.y()) + ", " + std::to_string(size.x());
  const double resolution = grid.resolution();
  const Array arrays[] = {{"sigma", "<f4", shape + ", 6", std::as_bytes(std::span(sigma))},
                          {"cells", "|u1", shape, std::as_bytes(grid.cells())},
                          {"origin", "<f8", "3,", std::as_bytes(std::span(grid.origin().data(), 3))},
                          {"resolution", "<f8", "", std::as_bytes(std::span(&resolution, 1))}};
  write_stream(path, force, [&](std::ostream& out) { write_zip(out, arrays); });
}

}  // namespace backwash::services
