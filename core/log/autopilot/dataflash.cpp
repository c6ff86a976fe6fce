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
  explicit DataflashDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  tl::expected<TopicLog, std::string> run() {
    for (std::size_t at = 0; at < bytes_.size();) {
      if (!stands(at)) {
        at = past_damage(at);
        continue;
      }
      const std::uint8_t* p = bytes_.data() + at;
      const std::size_t size = size_at(at);
      const Format& format = formats_[p[2]];
      if (p[2] == kFormat) formats_[p[3]] = format_of(p);
      if (p[2] == kFormat || !format.timed)
        log_.loss.read(size);
      else
        believed(at) ? data(format, p) : log_.loss.skip(size);
      at += size;
    }
    if (std::ranges::none_of(formats_, [](const Format& f) { return f.size > 0; }))
      return tl::unexpected<std::string>("no format message (FMT); give a .bin file of ArduPilot");
    log_.drop_misplaced();
    return std::move(log_);
  }

 private:
  /// Of the message whose header is at a byte; 0: none is, or its type has no format.
  std::size_t size_at(std::size_t at) const {
    if (at + kMessageHeader > bytes_.size() || bytes_[at] != kHead[0] || bytes_[at + 1] != kHead[1]) return 0;
    return bytes_[at + 2] == kFormat ? kFormatSize : formats_[bytes_[at + 2]].size;
  }

  /// Whether a message is wholly there and another one begins where it ends, or the file ends there. Where bytes were
  /// lost within it, what follows it is none: the format has no checksum.
  bool stands(std::size_t at) const {
    const std::size_t size = size_at(at), end = at + size;
    if (size == 0 || end > bytes_.size()) return false;
    if (bytes_[at + 2] == kFormat) {
      const Format format = format_of(bytes_.data() + at);
      const std::size_t known = formats_[bytes_[at + 3]].size;  // a second format of a type that is another is damage
      if (format.name.empty() || format.size < kMessageHeader || (known > 0 && known != format.size)) return false;
    }
    const auto left = std::min(bytes_.size() - end, sizeof kHead);
    return std::ranges::equal(bytes_.subspan(end, left), std::span(kHead).first(left));
  }

  /// Skips to the next message that stands; a last one that is cut short is told as such.
  std::size_t past_damage(std::size_t at) {
    std::size_t next = at + 1;
    while (next < bytes_.size() && !stands(next)) ++next;
    const bool cut = next == bytes_.size() && (next - at < kMessageHeader || at + size_at(at) > next);
    cut ? log_.loss.cut(next - at) : log_.loss.skip(next - at);
    return next;
  }

  double time_of(std::size_t at) const { return 1e-6 * *value_of('Q', bytes_.data() + at + kMessageHeader); }

  /// Whether the time of a message is one of its neighbours'.
  bool believed(std::size_t at) const {
    const double t = time_of(at);
    if (newest_s_ && t - *newest_s_ < kNeighbours_s) return true;
    int looked_at = 0;
    for (std::size_t next = at + size_at(at); next < bytes_.size() && looked_at < kNeighbours && stands(next);
         next += size_at(next))
      if (formats_[bytes_[next + 2]].timed) {
        if (std::abs(t - time_of(next)) < kNeighbours_s) return true;
        ++looked_at;
      }
    return !newest_s_;
  }

  void data(const Format& format, const std::uint8_t* p) {
    const unsigned instance = format.counted ? p[kMessageHeader + 8] : 0;
    auto [found, is_new] = topics_.try_emplace({format.name, instance}, log_.topics.size());
    if (is_new) log_.topics.push_back({format.name, instance, {}, {}});
    auto& topic = log_.topics[found->second];
    const double t = time_of(static_cast<std::size_t>(p - bytes_.data()));
    newest_s_ = std::max(newest_s_.value_or(0), t);
    log_.loss.read(format.size, t);
    topic.t_s.push_back(t);
    std::string name;
    p += kMessageHeader;
    for (std::size_t k = 0; k < format.types.size(); ++k) {
      if (const auto value = value_of(format.types[k], p); value && k > 0) {
        auto& column = topic.columns[format.labels[k]];
        column.resize(topic.t_s.size() - 1, std::nan(""));
        column.push_back(*value);
        if (format.name == "PARM" && format.labels[k] == "Value") log_.parameters[name] = *value;
      }
      if (format.types[k] == 'N') name = text(p, size_of('N'));
      if (format.name == "MSG" && format.types[k] == 'Z') log_.texts.push_back(text(p, size_of('Z')));
      p += size_of(format.types[k]);
    }
  }

  std::span<const std::uint8_t> bytes_;
  std::optional<double> newest_s_;
  std::array<Format, 256> formats_;
  std::map<std::pair<std::string, unsigned>, std::size_t> topics_;
  TopicLog log_;
};

}  // namespace

tl::expected<TopicLog, std::string> decode_dataflash(std::span<const std::uint8_t> bytes) {
  return DataflashDecoder(bytes).run();
}

}  // namespace backwash::log
