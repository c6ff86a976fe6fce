// SPDX-License-Identifier: BSD-3-Clause
#include "services/maps/mcap.hpp"

#include <zlib.h>

#include <cstdint>
#include <map>

#include "core/log/mcap_writer.hpp"
#include "services/maps/octets.hpp"
#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

using log::McapOp;

constexpr std::size_t kHead = 1 + 8;  // of every record: its kind and the length of what follows

class Walk {
 public:
  Walk(std::string_view file, const Listener& listener) : file_(file), listener_(listener) {}

  /// The records of a file or of a chunk; what is left at the end is no whole record.
  std::string_view records(std::string_view bytes, bool in_chunk) {
    while (wrong.empty() && !ended && bytes.size() >= kHead) {
      const auto length = Octets(bytes.substr(1)).number<std::uint64_t>();
      if (length > bytes.size() - kHead) break;
      const std::string_view content = bytes.substr(kHead, length);
      const auto op = static_cast<McapOp>(bytes.front());
      if (op == McapOp::schema) schema(content);
      if (op == McapOp::channel) channel(content);
      if (op == McapOp::message) message(content);
      if (op == McapOp::chunk && !in_chunk) chunk(content);
      ended = op == McapOp::data_end;
      bytes.remove_prefix(kHead + length);
    }
    return bytes;
  }
  std::string at(std::string_view bytes) const {
    return ": byte " + std::to_string(bytes.data() - file_.data()) + ": ";
  }

  std::string wrong;
  bool ended = false;

 private:
  struct Channel {
    std::uint16_t schema;
    std::string_view topic, encoding;
  };

  void fail(std::string_view bytes, const std::string& what) {
    if (wrong.empty()) wrong = at(bytes) + what;
  }

  void chunk(std::string_view content) {
    Octets fields(content);
    fields.take(8 + 8 + 8);  // its times, its size
    const auto crc = fields.number<std::uint32_t>();
    const auto compression = fields.text();
    const auto packed = fields.take(fields.number<std::uint64_t>());
    if (!fields.good) return fail(content, "is no whole chunk");
    if (!compression.empty())
      return fail(content, "its chunks are compressed by " + shown(compression) +
                               ", which is not read; write them without: mcap decompress FILE -o OTHER.mcap");
    if (crc != 0 && crc != ::crc32_z(0, reinterpret_cast<const Bytef*>(packed.data()), packed.size()))
      return fail(content, "the chunk's checksum does not fit: the file is damaged");
    const auto left = records(packed, true);
    if (!left.empty()) fail(left, "is no whole record");
  }

  void schema(std::string_view content) {
    Octets fields(content);
    const auto number = fields.number<std::uint16_t>();
    const auto type = fields.text();
    if (!fields.good) return fail(content, "is no whole schema");
    types_[number] = type;
  }

  void channel(std::string_view content) {
    Octets fields(content);
    const auto number = fields.number<std::uint16_t>(), schema = fields.number<std::uint16_t>();
    const auto topic = fields.text(), encoding = fields.text();
    if (!fields.good) return fail(content, "is no whole channel");
    channels_[number] = {schema, topic, encoding};
  }

  void message(std::string_view content) {
    Octets fields(content);
    const auto number = fields.number<std::uint16_t>();
    fields.take(4 + 8 + 8);  // its own number, its times
    if (!fields.good) return fail(content, "is no whole message");
    const auto channel = channels_.find(number);
    if (channel == channels_.end()) return fail(content, "a message of a channel that is not told before it");
    const auto& [schema, topic, encoding] = channel->second;
    if (const auto why = listener_({topic, types_[schema], encoding, fields.rest()}); !why.empty())
      fail(content, std::string(topic) + ": " + why);
  }

  std::string_view file_;
  const Listener& listener_;
  std::map<std::uint16_t, std::string_view> types_;
  std::map<std::uint16_t, Channel> channels_;
};

}  // namespace

std::string each_message(std::string_view file, const Listener& listener, std::string& cut) {
  const std::string_view magic(reinterpret_cast<const char*>(log::kMcapMagic.data()), log::kMcapMagic.size());
  if (!file.starts_with(magic)) return ": does not begin as an MCAP file";
  Walk walk(file, listener);
  const auto left = walk.records(file.substr(magic.size()), false);
  if (walk.wrong.empty() && !walk.ended)
    cut = "it was cut short at" + walk.at(left).substr(1) + "what is before is used";
  return walk.wrong;
}

}  // namespace backwash::maps
