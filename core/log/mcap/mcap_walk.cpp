// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap/mcap_walk.hpp"

#include <zlib.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "core/log/mcap/mcap_writer.hpp"
#include "core/log/octets.hpp"
#include "core/types/formatted.hpp"

namespace backwash::log {
namespace {

using std::string_view_literals::operator""sv;

constexpr std::string_view kDataEnd = "\x0f\x04\0\0\0\0\0\0\0"sv;  // its kind and length
constexpr std::size_t kHead = 1 + 8;  // of every record: its kind and the length of what follows

bool fits(std::uint32_t crc, std::string_view bytes) {
  return crc == 0 || crc == ::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
}

class Walk {
 public:
  Walk(std::string_view file, const McapListener& listener) : file_(file), listener_(listener) {}

  McapEnd through() {
    if (listener_.over_damage) learn();
    std::uint64_t at = kMcapMagic.size();
    while (!end_.whole && end_.wrong.empty()) {
      damaged_ = false;
      const auto content = record(file_.substr(at));
      if (content && listener_.over_damage && !begins(at + kHead + content->size()))
        damage(at, "no record follows this one");
      else if (content)
        take(static_cast<McapOp>(file_[at]), *content, at);
      const auto next = (content && !damaged_) || !listener_.over_damage ? std::nullopt : sound_behind(at);
      if (next) {
        end_.places += 1;
        end_.skipped += *next - at;
        at = *next;
      } else if (!content || damaged_) {
        at = cut(at);
        break;
      } else {
        at += kHead + content->size();
      }
    }
    if (end_.messages == 0 && !first_.empty()) end_.wrong = first_;  // all of it is damaged, or packed unknown to us
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

  /// The channels and the count of messages that stand behind the data: damage may have taken the first telling.
  void learn() {
    for (auto at = file_.rfind(kDataEnd); at < file_.size();) {
      const auto content = record(file_.substr(at));
      const auto op = static_cast<McapOp>(file_[at]);
      if (!content || op == McapOp::footer) break;
      if (op == McapOp::schema) schema(*content, at);
      if (op == McapOp::channel) channel(*content, at);
      chunked_ = chunked_ || op == McapOp::chunk_index;
      if (op == McapOp::statistics) end_.counted = Octets(*content).number<std::uint64_t>();
      at += kHead + content->size();
    }
    end_.wrong.clear();
  }

  /// Whether a record may begin there, or the file ends.
  bool begins(std::uint64_t at) const {
    if (file_.size() < at + kHead) return true;
    const auto op = static_cast<std::uint8_t>(file_[at]);
    return op >= 1 && op <= static_cast<std::uint8_t>(McapOp::data_end) &&
           Octets(file_.substr(at + 1)).number<std::uint64_t>() < std::uint64_t{1} << 32;
  }

  /// Whether a chunk whose lengths agree is there, or, in a file without chunks, a message of a channel that is known.
  bool sound(std::uint64_t at) const {
    const auto op = static_cast<McapOp>(file_[at]);
    if (op != McapOp::chunk && (op != McapOp::message || chunked_)) return false;
    const auto content = record(file_.substr(at));
    if (!content || !begins(at + kHead + content->size())) return false;
    Octets fields(*content);
    if (op == McapOp::message) return channels_.contains(fields.number<std::uint16_t>()) && fields.good;
    fields.take(8 + 8 + 8 + 4);
    fields.text();
    const auto packed = fields.number<std::uint64_t>();
    return fields.good && fields.rest().size() == packed;
  }

  /// Where what is sound goes on behind a damaged place: at the latest where the data end.
  std::optional<std::uint64_t> sound_behind(std::uint64_t at) const {
    const auto end = std::min<std::uint64_t>(file_.rfind(kDataEnd), file_.size());
    for (auto next = at + 1; next < end; ++next)
      if (sound(next)) return next;
    return end < file_.size() && end > at ? std::optional(end) : std::nullopt;
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

  /// Of bytes that are none of what was written.
  void damage(std::uint64_t at, std::string what) {
    if (!listener_.over_damage) return fail(at, std::move(what));
    if (first_.empty()) first_ = std::move(what);
    damaged_ = true;
  }

  void take(McapOp op, std::string_view content, std::uint64_t at) {
    if (op == McapOp::chunk) chunk(content, at);
    if (op == McapOp::footer) damage(at, "the file's end comes before that of its data: it is damaged");
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
    const bool told = end_.places > 0 || (listener_.over_damage && end_.counted > 0);
    if (!fields.good || (!told && !fits(crc, file_.substr(0, at))))
      return fail(at, "the checksum of all before it does not fit: the file is damaged");
    end_.whole = true;
  }

  void chunk(std::string_view content, std::uint64_t at) {
    chunked_ = true;
    Octets fields(content);
    fields.take(8 + 8);  // its times
    const auto size = fields.number<std::uint64_t>();
    const auto crc = fields.number<std::uint32_t>();
    const auto compression = fields.text();
    const auto packed = fields.take(fields.number<std::uint64_t>());
    if (!fields.good) return damage(at, "is no whole chunk");
    if (compression.empty()) return records(packed, crc, at, true);
    if (!listener_.unpack)
      return fail(at, "this chunk is compressed; write the file without: mcap decompress FILE -o OTHER.mcap");
    const auto bytes = listener_.unpack(compression, packed, size);
    if (!bytes) return damage(at, bytes.error());
    records(*bytes, crc, at, false);
  }

  /// Of a chunk; `here`: its bytes are the file's.
  void records(std::string_view bytes, std::uint32_t crc, std::uint64_t at, bool here) {
    if (!fits(crc, bytes)) return damage(at, "the chunk's checksum does not fit: the file is damaged");
    while (end_.wrong.empty() && !bytes.empty()) {
      const std::uint64_t place = here ? place_of(bytes) : at;
      const auto content = record(bytes);
      if (!content) return damage(place, "is no whole record");
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
    if (channel == channels_.end()) return damage(at, "a message of a channel that is not told before it");
    end_.messages += 1;
    if (listener_.message) fail(at, listener_.message(channel->second, fields.rest(), at));
  }

  std::string_view file_;
  const McapListener& listener_;
  std::map<std::uint16_t, std::string> types_;
  std::map<std::uint16_t, McapChannel> channels_;
  McapEnd end_;
  bool chunked_ = false;
  bool damaged_ = false;  // the record that was taken last
  std::string first_;     // what was wrong with the first of them
};

}  // namespace

std::string McapEnd::loss(std::size_t bytes) const {
  if (places == 0 && counted <= messages) return "";
  const auto share = [](auto lost, auto all) {
    return formatted("%.2g %%", 100.0 * static_cast<double>(lost) / static_cast<double>(all));
  };
  return "it is damaged in " + std::to_string(places) + " places: " +
         (counted > messages ? share(counted - messages, counted) + " of its messages"
                             : share(skipped, bytes) + " of it") +
         " lost";
}

McapEnd walk_mcap(std::string_view file, const McapListener& listener) { return Walk(file, listener).through(); }

}  // namespace backwash::log
