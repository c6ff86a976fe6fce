// SPDX-License-Identifier: BSD-3-Clause
#include <zlib.h>

#include <algorithm>
#include <memory>

#include "core/files/read_file.hpp"

namespace backwash::files {
namespace {

constexpr int kGzip = 16 + MAX_WBITS;                 // gzip's header and checksum, the largest window
constexpr std::size_t kPiece = std::size_t{1} << 20;  // bytes unpacked at a time

}  // namespace

tl::expected<std::string, std::string> unzipped(std::string content, std::size_t most_bytes) {
  if (!content.starts_with("\x1f\x8b")) return content;
  const auto error = [](const std::string& what) { return tl::make_unexpected(what + "; give a whole gzip file"); };
  z_stream stream{};
  if (inflateInit2(&stream, kGzip) != Z_OK) return error("zlib cannot be started");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> ended(&stream, inflateEnd);
  std::string plain;
  std::size_t taken = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END || taken < content.size()) {
    if (state == Z_STREAM_END) inflateReset(&stream);  // gzip files may follow one another
    const std::size_t given = std::min(content.size() - taken, kPiece), held = plain.size();
    plain.resize(held + kPiece);
    stream.next_in = reinterpret_cast<Bytef*>(content.data() + taken);
    stream.avail_in = static_cast<uInt>(given);
    stream.next_out = reinterpret_cast<Bytef*>(plain.data() + held);
    stream.avail_out = static_cast<uInt>(kPiece);
    state = inflate(&stream, Z_NO_FLUSH);
    taken += given - stream.avail_in;
    plain.resize(held + kPiece - stream.avail_out);
    if (plain.size() > most_bytes)
      return error("unpacks to more than the cap of " + std::to_string(most_bytes >> 20) + " MiB");
    if (state == Z_STREAM_END) continue;
    if (state != Z_OK)
      return error(given == 0 ? "is cut short" : "is damaged after " + std::to_string(taken) + " bytes");
  }
  return plain;
}

}  // namespace backwash::files
