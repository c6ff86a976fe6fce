// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/raw_log.hpp"

#include <cstring>
#include <fstream>

namespace backwash::study {

tl::expected<RawLog, LogError> read_raw_log(const std::string& path) {
  constexpr std::uint32_t kLargest = 1u << 30;
  std::ifstream in(path, std::ios::binary);
  if (!in) return tl::unexpected(LogError{LogError::Kind::not_found, path + ": cannot be read; needs a raw log"});
  char magic[sizeof kRawLogMagic - 1];
  if (!in.read(magic, sizeof magic) || std::memcmp(magic, kRawLogMagic, sizeof magic) != 0)
    return tl::unexpected(LogError{LogError::Kind::bad_data,
                                   path + ": byte 0: does not begin as a raw log of this version of backwashd"});

  in.seekg(0, std::ios::end);
  const auto file_size = static_cast<std::uint64_t>(in.tellg());
  in.seekg(sizeof magic);
  RawLog log;
  std::uint64_t offset = sizeof magic;
  while (offset < file_size) {
    RawRecord record{{}, {}, offset};
    if (!in.read(reinterpret_cast<char*>(&record.header), sizeof record.header)) break;
    const auto kind = static_cast<std::uint32_t>(record.header.kind);
    if (kind < 1 || kind > static_cast<std::uint32_t>(kLastKind) || record.header.size > kLargest)
      return tl::unexpected(LogError{LogError::Kind::bad_data,
                                     path + ": byte " + std::to_string(offset) + ": is not the head of a record"});
    if (record.header.size > file_size - offset - sizeof record.header) break;
    record.bytes.resize(record.header.size);
    if (!in.read(reinterpret_cast<char*>(record.bytes.data()), record.header.size)) break;
    offset += sizeof record.header + record.header.size;
    log.records.push_back(std::move(record));
  }
  if (offset < file_size) log.cut_at = offset;
  return log;
}

}  // namespace backwash::study
