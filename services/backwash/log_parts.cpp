// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/log_parts.hpp"

#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>

#include "core/log/raw_log.hpp"

namespace backwash::services {
namespace {

namespace fs = std::filesystem;

/// The first record of a raw log if it says which part the file is.
std::optional<log::PartRecord> part_of(const fs::path& path) {
  constexpr std::string_view kMagic = log::kRawLogMagic;
  std::array<char, kMagic.size() + sizeof(log::RecordHeader) + sizeof(log::PartRecord)> head{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(head.data(), head.size()) || std::string_view(head.data(), kMagic.size()) != kMagic)
    return std::nullopt;
  const auto record = log::raw_record(
      {reinterpret_cast<const std::uint8_t*>(head.data()) + kMagic.size(), head.size() - kMagic.size()});
  if (!record || record->header.kind != log::RecordKind::part) return std::nullopt;
  const auto* part = log::payload<log::PartRecord>(*record);
  return part ? std::optional(*part) : std::nullopt;
}

/// NAME and N of NAME-N; 1 of any other name.
std::pair<std::string, int> numbered(const std::string& stem) {
  const auto dash = stem.rfind('-');
  int number = 0;
  const char* end = stem.data() + stem.size();
  if (dash != stem.npos && std::from_chars(stem.data() + dash + 1, end, number).ptr == end && number > 1)
    return {stem.substr(0, dash), number};
  return {stem, 1};
}

}  // namespace

std::vector<std::string> with_later_parts(const std::vector<std::string>& logs) {
  if (logs.size() != 1) return logs;
  auto newest = part_of(logs.front());
  if (!newest) return logs;
  auto all = logs;
  const fs::path first = logs.front();
  auto [name, number] = numbered(first.stem().string());
  for (++number;; ++number) {
    fs::path next = first;
    next.replace_filename(name + "-" + std::to_string(number) + first.extension().string());
    std::error_code ignored;
    if (!fs::exists(next, ignored)) return all;
    const auto part = part_of(next);
    // Names of earlier starts may stand between.
    if (!part || part->log != newest->log || part->part != newest->part + 1) continue;
    newest = part;
    all.push_back(next.string());
  }
}

}  // namespace backwash::services
