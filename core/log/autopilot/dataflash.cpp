// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/dataflash.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <tuple>

#include "core/log/little_endian.hpp"

namespace backwash::log {
namespace {

constexpr std::uint8_t kHead[] = {0xA3, 0x95}, kFormat = 0x80;
constexpr std::size_t kMessageHeader = 3, kFormatSize = 89;
constexpr std::size_t kNameAt = 5, kTypesAt = 9, kLabelsAt = 25;  // in a format message: 4, 16 and 64 characters

/// Bytes of a field; 0: no such type.
std::size_t size_of(char type) {
  switch (type) {
    case 'b':
    case 'B':
    case 'M':
      return 1;
    case 'h':
    case 'H':
    case 'c':
    case 'C':
    case 'g':
      return 2;
    case 'i':
    case 'I':
    case 'e':
    case 'E':
    case 'L':
    case 'f':
    case 'n':
      return 4;
    case 'd':
    case 'q':
    case 'Q':
      return 8;
    case 'N':
      return 16;
    case 'Z':
    case 'a':
      return 64;
    default:
      return 0;
  }
}

/// Nothing: a text, an array or a half float.
std::optional<double> value_of(char type, const std::uint8_t* p) {
  switch (type) {
    case 'M':
      return little<std::uint8_t>(p);
    case 'c':
      return 0.01 * little<std::int16_t>(p);
    case 'C':
      return 0.01 * little<std::uint16_t>(p);
    case 'e':
      return 0.01 * little<std::int32_t>(p);
    case 'E':
      return 0.01 * little<std::uint32_t>(p);
    case 'L':
      return 1e-7 * little<std::int32_t>(p);
    default:
      return number_at(p, type);
  }
}

/// What a message of one type holds.
struct Format {
  std::string name, types;
  std::vector<std::string> labels;
  std::size_t size = 0;                 ///< with its header; 0: not known
  bool timed = false, counted = false;  ///< begins with TimeUS; its second field is an instance
};

std::string text(const std::uint8_t* p, std::size_t most) {
  return {reinterpret_cast<const char*>(p), static_cast<std::size_t>(std::find(p, p + most, 0) - p)};
}

Format format_of(const std::uint8_t* p) {
  Format f{text(p + kNameAt, 4), text(p + kTypesAt, 16), {}, p[4]};
  std::istringstream labels(text(p + kLabelsAt, 64));
  for (std::string label; std::getline(labels, label, ',');) f.labels.push_back(label);
  std::size_t size = kMessageHeader;
  for (const char type : f.types) size += size_of(type);
  const bool whole = size == f.size && f.labels.size() == f.types.size();
  f.timed = whole && f.types.starts_with('Q') && f.labels.front() == "TimeUS";
  f.counted = f.timed && f.types.starts_with("QB") &&
              std::ranges::count(std::array{"I", "C", "Inst", "Instance"}, f.labels[1]) == 1;
  return f;
}

class DataflashDecoder {
 public:
  tl::expected<TopicLog, std::string> run(std::span<const std::uint8_t> bytes) {
    bool formats = false, damaged = false;
    for (std::size_t at = 0; at + kMessageHeader <= bytes.size();) {
      const std::uint8_t* p = bytes.data() + at;
      const std::uint8_t type = p[2];
      const bool is_format = type == kFormat;
      const std::size_t size = is_format ? kFormatSize : formats_[type].size;
      if (p[0] != kHead[0] || p[1] != kHead[1] || size < kMessageHeader) {
        if (!damaged) log_.dropouts += 1;
        damaged = true;
        at += 1;
        continue;
      }
      if (at + size > bytes.size()) break;  // cut short
      if (is_format) {
        formats_[p[3]] = format_of(p);
        formats = true;
      } else if (formats_[type].timed)
        data(formats_[type], p + kMessageHeader);
      damaged = false;
      at += size;
    }
    if (!formats) return tl::unexpected<std::string>("no format message (FMT); give a .bin file of ArduPilot");
    return std::move(log_);
  }

 private:
  void data(const Format& format, const std::uint8_t* p) {
    const unsigned instance = format.counted ? p[8] : 0;
    auto [found, is_new] = topics_.try_emplace({format.name, instance}, log_.topics.size());
    if (is_new) log_.topics.push_back({format.name, instance, {}, {}});
    auto& topic = log_.topics[found->second];
    const double t = 1e-6 * *value_of('Q', p);
    if (!topic.t_s.empty() && t < topic.t_s.back())
      return void(log_.dropouts += 1);  // damage that looks like a message
    topic.t_s.push_back(t);
    for (std::size_t k = 0; k < format.types.size(); ++k) {
      if (const auto value = value_of(format.types[k], p); value && k > 0) {
        auto& column = topic.columns[format.labels[k]];
        column.resize(topic.t_s.size() - 1, std::nan(""));
        column.push_back(*value);
      }
      p += size_of(format.types[k]);
    }
  }

  std::array<Format, 256> formats_;
  std::map<std::pair<std::string, unsigned>, std::size_t> topics_;
  TopicLog log_;
};

}  // namespace

tl::expected<TopicLog, std::string> decode_dataflash(std::span<const std::uint8_t> bytes) {
  return DataflashDecoder().run(bytes);
}

}  // namespace backwash::log
