// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/raw/raw_log.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string_view>

#include "core/log/little_endian.hpp"
#include "core/log/mcap/mcap_reader.hpp"
#include "core/log/mcap/mcap_writer.hpp"
#include "core/log/raw/log_file.hpp"

namespace backwash::log {

namespace {

constexpr std::string_view kMagic(kRawLogMagic);

std::optional<RecordHeader> header_at(std::span<const std::uint8_t> bytes) {
  constexpr std::uint32_t kLargest = 1u << 30;
  if (bytes.size() < sizeof(RecordHeader)) return std::nullopt;
  const auto header = little<RecordHeader>(bytes.data());
  const auto kind = static_cast<std::uint32_t>(header.kind);
  if (kind < 1 || kind > static_cast<std::uint32_t>(kLastKind) || header.size > kLargest) return std::nullopt;
  return header;
}

}  // namespace

std::optional<RawRecord> raw_record(std::span<const std::uint8_t> bytes) {
  const auto header = header_at(bytes);
  if (!header || header->size > bytes.size() - sizeof *header) return std::nullopt;
  const auto body = bytes.subspan(sizeof *header, header->size);
  return RawRecord{*header, {body.begin(), body.end()}};
}

namespace {

tl::expected<RawLog, LogError> raw_log_of(const std::string& path, const std::string& content) {
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(content.data()), content.size());
  if (is_mcap(bytes)) return raw_log_of_mcap(path, bytes);
  const std::string_view mcap(reinterpret_cast<const char*>(kMcapMagic.data()), kMcapMagic.size());
  if (content != kMagic && (kMagic.starts_with(content) || mcap.starts_with(content))) return RawLog{{}, 0};
  if (!content.starts_with(kMagic))
    return tl::unexpected(
        LogError{LogError::Kind::bad_data, path + ": byte 0: does not begin as a raw log: as MCAP, or as before"});

  RawLog log;
  std::uint64_t offset = kMagic.size();
  while (content.size() - offset >= sizeof(RecordHeader)) {
    const auto here = bytes.subspan(offset);
    if (!header_at(here))
      return tl::unexpected(LogError{LogError::Kind::bad_data,
                                     path + ": byte " + std::to_string(offset) + ": is not the head of a record"});
    auto record = raw_record(here);
    if (!record) break;
    record->offset = offset;
    offset += sizeof record->header + record->bytes.size();
    log.records.push_back(*std::move(record));
  }
  if (offset < content.size()) log.cut_at = offset;
  return log;
}

}  // namespace

tl::expected<RawLog, LogError> read_raw_log(const std::string& path) {
  auto content = read_log_file(path, files::kLargestLog, "a raw log");
  if (!content) return tl::unexpected(content.error());
  const auto plain = files::unzipped(std::move(*content), files::kLargestLog);
  return plain ? raw_log_of(path, *plain)
               : tl::unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + plain.error()});
}

std::optional<PartRecord> part_of(const std::string& path) {
  std::string begin(std::size_t{64} << 10, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  auto log = raw_log_of(path, begin);
  if (!log || log->records.empty()) return std::nullopt;
  log->records.resize(1);
  return last_part(*log);
}

std::optional<PartRecord> last_part(const RawLog& log) {
  for (auto record = log.records.rbegin(); record != log.records.rend(); ++record)
    if (const auto* part = record->header.kind == RecordKind::part ? payload<PartRecord>(*record) : nullptr)
      return *part;
  return std::nullopt;
}

tl::expected<RawLog, LogError> read_raw_logs(std::span<const std::string> paths) {
  const auto bad = [](const std::string& path, const std::string& what) {
    return tl::unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + what});
  };
  RawLog whole;
  std::optional<PartRecord> before;
  for (const auto& path : paths) {
    auto log = read_raw_log(path);
    if (!log) return log;
    if (paths.size() == 1) return log;
    const auto first = log->records.empty() ? std::nullopt : last_part({{log->records.front()}, {}});
    if (!first) return bad(path, "does not say which part of a log it is; give it alone");
    if (before && (first->log != before->log || first->part != before->part + 1))
      return bad(path, "is part " + std::to_string(first->part) + (first->log == before->log ? "" : " of another log") +
                           "; needs part " + std::to_string(before->part + 1) + " of the one before it");
    if (whole.cut_at) return bad(path, "the part before it is cut short; give those from here on apart");
    const std::size_t repeated = before ? std::min<std::size_t>(first->repeated, log->records.size() - 1) : 0;
    log->records.erase(log->records.begin() + 1, log->records.begin() + 1 + static_cast<std::ptrdiff_t>(repeated));
    before = last_part(*log);
    whole.cut_at = log->cut_at;
    std::ranges::move(log->records, std::back_inserter(whole.records));
  }
  return whole;
}

}  // namespace backwash::log
