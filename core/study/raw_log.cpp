// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/raw_log.hpp"

#include <cstring>
#include <fstream>

namespace backwash::study {

tl::expected<std::vector<RawRecord>, LogError> read_raw_log(const std::string& path) {
  constexpr std::uint32_t kLargest = 1u << 30;
  std::ifstream in(path, std::ios::binary);
  if (!in) return tl::unexpected(LogError{LogError::Kind::not_found, path + ": cannot be read; needs a raw log"});
  char magic[sizeof kRawLogMagic - 1];
  if (!in.read(magic, sizeof magic) || std::memcmp(magic, kRawLogMagic, sizeof magic) != 0)
    return tl::unexpected(LogError{LogError::Kind::bad_data, path + ":0: is not a backwash raw log"});

  in.seekg(0, std::ios::end);
  const auto file_size = static_cast<std::uint64_t>(in.tellg());
  in.seekg(sizeof magic);
  std::vector<RawRecord> records;
  std::uint64_t offset = sizeof magic;
  RecordHeader header;
  while (in.read(reinterpret_cast<char*>(&header), sizeof header)) {
    const auto kind = static_cast<std::uint32_t>(header.kind);
    if (kind < 1 || kind > 9 || header.size > kLargest)
      return tl::unexpected(LogError{LogError::Kind::bad_data,
                                     path + ": byte " + std::to_string(offset) + ": is not the head of a record"});
    if (header.size > file_size - offset - sizeof header) break;  // cut short by a crash
    RawRecord record{header, std::vector<std::uint8_t>(header.size)};
    if (!in.read(reinterpret_cast<char*>(record.bytes.data()), header.size)) break;
    offset += sizeof header + header.size;
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace backwash::study
