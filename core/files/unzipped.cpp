// SPDX-License-Identifier: BSD-3-Clause
#include <zlib.h>

#include <algorithm>
#include <memory>
#include <string_view>

#include "core/files/read_file.hpp"

namespace backwash::files {
namespace {

constexpr int kGzip = 16 + MAX_WBITS;                 // gzip's header and checksum, the largest window
constexpr std::size_t kPiece = std::size_t{1} << 20;  // bytes unpacked at a time

/// The number of N bytes at a place, least significant first; 0 behind the end.
template <std::size_t N>
std::size_t number(std::string_view content, std::size_t at) {
  std::size_t value = 0;
  for (std::size_t k = N; k-- > 0 && at + N <= content.size();)
    value = value << 8 | static_cast<unsigned char>(content[at + k]);
  return value;
}

/// The one file in a ZIP archive (PKWARE APPNOTE 6.3, without ZIP64 and encryption), by its central directory.
tl::expected<std::string, std::string> of_zip(std::string_view zip, std::size_t most_bytes) {
  const auto error = [](const std::string& what) {
    return tl::make_unexpected("zip: " + what + "; unpack it, and give one file");
  };
  const auto end = zip.rfind("PK\x05\x06");
  if (end == zip.npos) return error("is cut short");
  std::size_t entry = 0, files = 0;
  for (std::size_t k = number<2>(zip, end + 10), at = number<4>(zip, end + 16); k > 0; --k) {
    if (at >= zip.size() || zip.substr(at, 4) != "PK\x01\x02") return error("is damaged");
    const std::size_t name = number<2>(zip, at + 28);
    const auto called = zip.substr(at + 46, name);
    if (!called.ends_with('/') && !called.starts_with("__MACOSX")) {
      ++files;
      entry = at;
    }
    at += 46 + name + number<2>(zip, at + 30) + number<2>(zip, at + 32);
  }
  if (files != 1) return error("holds " + std::to_string(files) + " files");
  const std::size_t packed = number<4>(zip, entry + 20), size = number<4>(zip, entry + 24),
                    at = number<4>(zip, entry + 42);
  const std::size_t data = at + 30 + number<2>(zip, at + 26) + number<2>(zip, at + 28),
                    method = number<2>(zip, entry + 10);
  if (size > most_bytes) return error("unpacks to more than the cap of " + std::to_string(most_bytes >> 20) + " MiB");
  if (data > zip.size() || packed > zip.size() - data) return error("is cut short");
  if (method == 0) return std::string(zip.substr(data, packed));
  std::string plain(size, '\0');
  z_stream stream{};
  if (method != Z_DEFLATED || (number<2>(zip, entry + 8) & 1) != 0 || inflateInit2(&stream, -MAX_WBITS) != Z_OK)
    return error("is packed in a way that is not known");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> ended(&stream, inflateEnd);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(zip.data() + data));
  stream.avail_in = static_cast<uInt>(packed);
  stream.next_out = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_out = static_cast<uInt>(size);
  const bool whole =
      inflate(&stream, Z_FINISH) == Z_STREAM_END && stream.total_out == size &&
      crc32(0, reinterpret_cast<const Bytef*>(plain.data()), static_cast<uInt>(size)) == number<4>(zip, entry + 16);
  if (!whole) return error("is damaged");
  return plain;
}

}  // namespace

tl::expected<std::string, std::string> unzipped(std::string content, std::size_t most_bytes) {
  if (content.starts_with("PK\x03\x04")) return of_zip(content, most_bytes);
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
