// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace backwash::log {

/// The first and the last bytes of an MCAP file (https://mcap.dev/spec).
inline constexpr std::array<std::uint8_t, 8> kMcapMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

/// Kinds of records of an MCAP file, as far as they are written here.
enum class McapOp : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

/// Times of a message, ns of one clock.
struct McapTimes {
  std::uint64_t log_ns = 0;      ///< recorded
  std::uint64_t publish_ns = 0;  ///< said
};

/// Writes an MCAP file of ROS 2 messages (profile ros2: encoding cdr, schemas ros2msg) onto a stream: chunks without
/// compression, each with its CRC and the index of its messages, then a summary. What it holds in memory is a chunk and
/// the index of the chunks. Whether the stream took everything is the stream's to tell.
class McapWriter {
 public:
  /// Begins the file. `library`: who wrote it.
  McapWriter(std::ostream& out, std::string_view library);
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Adds a channel and gives its number. `type`: of its messages, as std_msgs/msg/String; `schema`: the text of its
  /// definition, which is one for all channels of that type.
  std::uint16_t add_channel(std::string_view topic, std::string_view type, std::string_view schema);
  /// One message on a channel that was added; `cdr` with its encapsulation.
  void write(std::uint16_t channel, McapTimes times, std::span<const std::uint8_t> cdr);
  /// Ends the file; nothing may be written after it.
  void finish();

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Span {
    std::uint64_t first_ns = 0, last_ns = 0, messages = 0;
    void add(std::uint64_t t_ns);
  };
  struct Place {
    std::uint64_t t_ns, offset;
  };
  struct Chunk {
    Span span;
    std::uint64_t at, length, index_length, size;
    std::map<std::uint16_t, std::uint64_t> index_at;
  };

  void put(std::span<const std::uint8_t> bytes);
  void put_record(McapOp op, std::span<const std::uint8_t> content);
  void end_chunk();
  void put_message_index(Chunk& chunk);
  std::uint64_t put_summary();  ///< where its offsets began
  Bytes statistics() const;

  std::ostream& out_;
  std::uint64_t at_ = 0;                                       ///< bytes written
  std::uint32_t crc_ = 0;                                      ///< of those since the file or the summary began
  std::map<std::string, std::uint16_t, std::less<>> schemas_;  ///< type → number
  Bytes schema_records_, channel_records_;                     ///< whole records, for the summary
  std::vector<std::uint64_t> messages_;                        ///< of each channel, the first has number 1
  Span span_;
  Bytes chunk_;
  Span chunk_span_;
  std::map<std::uint16_t, std::vector<Place>> places_;  ///< of the messages in the chunk by channel
  std::vector<Chunk> chunks_;
};

}  // namespace backwash::log
