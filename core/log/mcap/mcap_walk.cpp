// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap/mcap_walk.hpp"

#include <zlib.h>

#include <map>
#include <optional>
#include <utility>

#include "core/log/mcap/mcap_writer.hpp"
#include "core/log/octets.hpp"

namespace backwash::log {
namespace {

constexpr std::size_t kHead = 1 + 8;  // of every record: its kind and the length of what follows

bool fits(std::uint32_t crc, std::string_view bytes) {
  return crc == 0 || crc == ::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
}

class Walk {
 public:
  Walk(std::string_view file, const McapListener& listener) : file_(file), listener_(listener) {}

  McapEnd through() {
    std::uint64_t at = kMcapMagic.size();
    while (!end_.whole && end_.wrong.empty()) {
      const auto content = record(file_.substr(at));
      if (!content) {
        at = cut(at);
        break;
      }
      take(static_cast<McapOp>(file_[at]), *content, at);
      at += kHead + content->size();
    }
    if (end_.wrong.empty()) end_.at = at;
    return std::move(end_);
  }

 private:
  /// The content of the record that begins these bytes; nothing: it is not whole.
  static std::optional<std::string_view> record(std::string_view bytes) {
    if (bytes.size() < kHead) return std::nullopt;
    const auto length = Octets(bytes.substr(1)).number<std::uint64_t>();
    if (length > bytes.size() - kHead) return std::nullopt;
    return bytes.substr(kHead, length);
  }

  /// Of a record that is cut short, where it begins. Of a chunk that is not compressed, the messages that are whole are
  /// taken, and where they end.
  std::uint64_t cut(std::uint64_t at) {
    const std::string_view begun = file_.substr(at);
    if (begun.size() < kHead || static_cast<McapOp>(begun.front()) != McapOp::chunk) return at;
    Octets fields(begun.substr(kHead));
    fields.take(8 + 8 + 8 + 4);  // its times, size and checksum
    const auto compression = fields.text();
    fields.take(8);
    if (!fields.good || !compression.empty()) return at;
    std::string_view messages = fields.rest();
    while (const auto content = record(messages)) {
      in_chunk(static_cast<McapOp>(messages.front()), *content, place_of(messages));
      messages.remove_prefix(kHead + content->size());
    }
    return place_of(messages);
  }

  std::uint64_t place_of(std::string_view bytes) const {
    return static_cast<std::uint64_t>(bytes.data() - file_.data());
  }

  void fail(std::uint64_t at, std::string what) {
    if (end_.wrong.empty() && !what.empty()) {
      end_.wrong = std::move(what);
      end_.at = at;
    }
  }

  void take(McapOp op, std::string_view content, std::uint64_t at) {
    if (op == McapOp::chunk) chunk(content, at);
    if (op == McapOp::footer) fail(at, "the file's end comes before that of its data: it is damaged");
    if (op == McapOp::data_end) data_end(content, at);
    in_chunk(op, content, at);
  }

  void in_chunk(McapOp op, std::string_view content, std::uint64_t at) {
    if (op == McapOp::schema) schema(content, at);
    if (op == McapOp::channel) channel(content, at);
    if (op == McapOp::message) message(content, at);
  }

  void data_end(std::string_view content, std::uint64_t at) {
    Octets fields(content);
    const auto crc = fields.number<std::uint32_t>();
    if (!fields.good || !fits(crc, file_.substr(0, at)))
      return fail(at, "the checksum of all before it does not fit: the file is damaged");
    end_.whole = true;
  }

  void chunk(std::string_view content, std::uint64_t at) {
    Octets fields(content);
    fields.take(8 + 8);  // its times
    const auto size = fields.number<std::uint64_t>();
    const auto crc = fields.number<std::uint32_t>();
    const auto compression = fields.text();
    const auto packed = fields.take(fields.number<std::uint64_t>());
    if (!fields.good) return fail(at, "is no whole chunk");
    if (compression.empty()) return records(packed, crc, at, true);
    if (!listener_.unpack)
      return fail(at, "this chunk is compressed; write the file without: mcap decompress FILE -o OTHER.mcap");
    const auto bytes = listener_.unpack(compression, packed, size);
    if (!bytes) return fail(at, bytes.error());
    records(*bytes, crc, at, false);
  }

  /// Of a chunk; `here`: its bytes are the file's.
  void records(std::string_view bytes, std::uint32_t crc, std::uint64_t at, bool here) {
    if (!fits(crc, bytes)) return fail(at, "the chunk's checksum does not fit: the file is damaged");
    while (end_.wrong.empty() && !bytes.empty()) {
      const std::uint64_t place = here ? place_of(bytes) : at;
      const auto content = record(bytes);
      if (!content) return fail(place, "is no whole record");
      in_chunk(static_cast<McapOp>(bytes.front()), *content, place);
      bytes.remove_prefix(kHead + content->size());
    }
  }

  void schema(std::string_view content, std::uint64_t at) {
    Octets fields(content);
    const auto number = fields.number<std::uint16_t>();
    const auto type = fields.text();
    if (!fields.good) return fail(at, "is no whole schema");
    types_[number] = type;
  }

  void channel(std::string_view content, std::uint64_t at) {
    Octets fields(content);
    const auto number = fields.number<std::uint16_t>(), schema = fields.number<std::uint16_t>();
    const auto topic = fields.text(), encoding = fields.text();
    if (!fields.good) return fail(at, "is no whole channel");
    const auto& told = channels_[number] = {std::string(topic), types_[schema], std::string(encoding)};
    if (listener_.channel) fail(at, listener_.channel(told));
  }

  void message(std::string_view content, std::uint64_t at) {
    Octets fields(content);
    const auto number = fields.number<std::uint16_t>();
    fields.take(4 + 8 + 8);  // its own number, its times
    if (!fields.good) return fail(at, "is no whole message");
    const auto channel = channels_.find(number);
    if (channel == channels_.end()) return fail(at, "a message of a channel that is not told before it");
    if (listener_.message) fail(at, listener_.message(channel->second, fields.rest(), at));
  }

  std::string_view file_;
  const McapListener& listener_;
  std::map<std::uint16_t, std::string> types_;
  std::map<std::uint16_t, McapChannel> channels_;
  McapEnd end_;
};

}  // namespace

McapEnd walk_mcap(std::string_view file, const McapListener& listener) { return Walk(file, listener).through(); }

}  // namespace backwash::log
