// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap_reader.hpp"

#include <zlib.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "core/log/little_endian.hpp"
#include "core/log/mcap_export.hpp"
#include "core/log/mcap_writer.hpp"
#include "core/log/ros_messages.hpp"

namespace backwash::log {
namespace {

using Octets = std::span<const std::uint8_t>;

constexpr std::size_t kHead = 1 + 8;  // of every record: its kind and the length of what follows

std::uint32_t crc_of(Octets bytes) { return static_cast<std::uint32_t>(::crc32_z(0, bytes.data(), bytes.size())); }

/// Takes a record's content apart; `good` is false once something was asked for that is not there.
class Fields {
 public:
  explicit Fields(Octets left) : left_(left) {}
  bool good = true;
  template <typename T>
  T number() {
    const Octets bytes = take(sizeof(T));
    return good ? little<T>(bytes.data()) : T{};
  }
  std::string_view text() {
    const Octets bytes = take(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  Octets take(std::uint64_t size) {
    good = good && size <= left_.size();
    if (!good) return {};
    const Octets bytes = left_.first(size);
    left_ = left_.subspan(size);
    return bytes;
  }
  Octets rest() const { return left_; }

 private:
  Octets left_;
};

/// Goes through the records of a file.
class McapReader {
 public:
  McapReader(const std::string& path, Octets file) : path_(path), file_(file) {}

  tl::expected<RawLog, LogError> read() {
    std::uint64_t at = kMcapMagic.size();
    bool ended = false;
    while (!ended && !wrong_ && file_.size() - at >= kHead) {
      const auto length = little<std::uint64_t>(file_.data() + at + 1);
      if (length > file_.size() - at - kHead) break;
      ended = take(static_cast<McapOp>(file_[at]), file_.subspan(at + kHead, length), at);
      at += kHead + length;
    }
    if (!wrong_ && !channel_)
      fail(at, "no channel " + std::string(kRawTopic) + " before it: not of backwash export; give the raw log");
    if (wrong_) return tl::unexpected(*wrong_);
    if (!ended) log_.cut_at = at;
    return std::move(log_);
  }

 private:
  void fail(std::uint64_t at, const std::string& what) {
    if (!wrong_) wrong_ = {LogError::Kind::bad_data, path_ + ": byte " + std::to_string(at) + ": " + what};
  }

  /// Whether the data ends with this record.
  bool take(McapOp op, Octets content, std::uint64_t at) {
    if (op == McapOp::chunk) take_chunk(content, at);
    if (op == McapOp::channel) take_channel(content, at);
    if (op == McapOp::message) take_message(content, at);
    if (op == McapOp::footer) fail(at, "the file's end comes before that of its data: it is damaged");
    if (op != McapOp::data_end) return false;
    Fields fields(content);
    const auto crc = fields.number<std::uint32_t>();
    if (!fields.good || (crc != 0 && crc != crc_of(file_.first(at))))
      fail(at, "the checksum of all before it does not fit: the file is damaged");
    return true;
  }

  void take_chunk(Octets content, std::uint64_t at) {
    Fields fields(content);
    fields.take(8 + 8 + 8);  // its times, its size
    const auto crc = fields.number<std::uint32_t>();
    const auto compression = fields.text();
    const Octets records = fields.take(fields.number<std::uint64_t>());
    if (!fields.good) return fail(at, "is no whole chunk");
    if (!compression.empty()) return fail(at, "this chunk is compressed; write the file again without compression");
    if (crc != 0 && crc != crc_of(records)) return fail(at, "the chunk's checksum does not fit: the file is damaged");
    std::uint64_t offset = 0;
    while (!wrong_ && offset < records.size()) {
      const std::uint64_t here = static_cast<std::uint64_t>(records.data() - file_.data()) + offset;
      const std::uint64_t left = records.size() - offset;
      const auto length = left < kHead ? left : little<std::uint64_t>(records.data() + offset + 1);
      if (left < kHead || length > left - kHead) return fail(here, "is no whole record");
      const auto op = static_cast<McapOp>(records[offset]);
      if (op == McapOp::channel) take_channel(records.subspan(offset + kHead, length), here);
      if (op == McapOp::message) take_message(records.subspan(offset + kHead, length), here);
      offset += kHead + length;
    }
  }

  void take_channel(Octets content, std::uint64_t at) {
    Fields fields(content);
    const auto number = fields.number<std::uint16_t>();
    fields.number<std::uint16_t>();  // its schema
    const auto topic = fields.text(), encoding = fields.text();
    if (!fields.good) return fail(at, "is no whole channel");
    if (topic != kRawTopic) return;
    if (encoding != "cdr") return fail(at, "the channel's encoding is not cdr");
    channel_ = number;
  }

  void take_message(Octets content, std::uint64_t at) {
    Fields fields(content);
    const auto number = fields.number<std::uint16_t>();
    fields.take(4 + 8 + 8);  // its own number, its times
    if (!fields.good) return fail(at, "is no whole message");
    if (number != channel_) return;
    const auto octets = ros::octets_of(fields.rest());
    const auto record = octets ? raw_record(*octets) : std::nullopt;
    if (!record || sizeof record->header + record->bytes.size() != octets->size())
      return fail(at, "this message holds no record of a raw log");
    log_.records.push_back(*record);
    log_.records.back().offset = static_cast<std::uint64_t>(octets->data() - file_.data());
  }

  const std::string& path_;
  const Octets file_;
  RawLog log_;
  std::optional<std::uint16_t> channel_;
  std::optional<LogError> wrong_;
};

}  // namespace

bool is_mcap(Octets bytes) noexcept {
  return bytes.size() >= kMcapMagic.size() && std::equal(kMcapMagic.begin(), kMcapMagic.end(), bytes.begin());
}

tl::expected<RawLog, LogError> raw_log_of_mcap(const std::string& path, Octets bytes) {
  return McapReader(path, bytes).read();
}

}  // namespace backwash::log
