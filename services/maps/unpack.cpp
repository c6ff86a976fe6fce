// SPDX-License-Identifier: BSD-3-Clause
#include "services/maps/unpack.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <memory>

#include "core/files/read_file.hpp"
#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

bool of_zstd(std::string_view packed, std::string& bytes) {
  return ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size()) == bytes.size();
}

/// One frame or several behind each other.
bool of_lz4(std::string_view packed, std::string& bytes) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(made,
                                                                                     &LZ4F_freeDecompressionContext);
  std::size_t done = 0, left = 0;
  while (!packed.empty()) {
    std::size_t out = bytes.size() - done, in = packed.size();
    left = LZ4F_decompress(context.get(), bytes.data() + done, &out, packed.data(), &in, nullptr);
    if (LZ4F_isError(left) || (in == 0 && out == 0)) return false;
    done += out;
    packed.remove_prefix(in);
  }
  return left == 0 && done == bytes.size();
}

}  // namespace

tl::expected<std::string, std::string> unpacked(std::string_view compression, std::string_view packed,
                                                std::uint64_t size) {
  const auto wrong = [](const std::string& what) { return tl::make_unexpected(what); };
  if (compression != "lz4" && compression != "zstd")
    return wrong("a chunk is compressed by " + shown(compression) +
                 "; lz4 and zstd are read; write it without: mcap decompress FILE -o OTHER.mcap");
  if (size > files::kLargestTable)
    return wrong("a chunk of " + std::to_string(size) + " bytes unpacked; " + std::to_string(files::kLargestTable) +
                 " at most are read");
  std::string bytes(size, '\0');
  if (!(compression == "lz4" ? of_lz4(packed, bytes) : of_zstd(packed, bytes)))
    return wrong("a chunk compressed by " + std::string(compression) + " is not " + std::to_string(size) +
                 " bytes unpacked: the file is damaged");
  return bytes;
}

}  // namespace backwash::maps
