// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/raw_log.hpp"

#include <cstring>
#include <string_view>

#include "core/log/log_file.hpp"

namespace backwash::log {

tl::expected<RawLog, LogError> read_raw_log(const std::string& path) {
  constexpr std::uint32_t kLargest = 1u << 30;
  constexpr std::string_view kMagic(kRawLogMagic);
  const auto content = read_log_file(path, files::kLargestLog, "a raw log");
  if (!content) return tl::unexpected(content.error());
  if (!content->starts_with(kMagic))
    return tl::unexpected(LogError{LogError::Kind::bad_data,
                                   path + ": byte 0: does not begin as a raw log of this version of backwashd"});

  RawLog log;
  std::uint64_t offset = kMagic.size();
  while (content->size() - offset >= sizeof(RecordHeader)) {
    RawRecord record{{}, {}, offset};
    std::memcpy(&record.header, content->data() + offset, sizeof record.header);
    const auto kind = static_cast<std::uint32_t>(record.header.kind);
    if (kind < 1 || kind > static_cast<std::uint32_t>(kLastKind) || record.header.size > kLargest)
      return tl::unexpected(LogError{LogError::Kind::bad_data,
                                     path + ": byte " + std::to_string(offset) + ": is not the head of a record"});
    const auto body = offset + sizeof record.header;
    if (record.header.size > content->size() - body) break;
    record.bytes.assign(content->begin() + static_cast<std::ptrdiff_t>(body),
                        content->begin() + static_cast<std::ptrdiff_t>(body + record.header.size));
    offset = body + record.header.size;
    log.records.push_back(std::move(record));
  }
  if (offset < content->size()) log.cut_at = offset;
  return log;
}

}  // namespace backwash::log
