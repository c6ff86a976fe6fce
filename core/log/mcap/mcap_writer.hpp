// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
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
  metadata = 0x0C,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

/// Times of a message, ns of one clock.
struct McapTimes {
  std::uint64_t log_ns = 0;      ///< recorded
  std::uint64_t publish_ns = 0;  ///< said
};

/// Puts bytes at that place of the file: at its end, or over as many that stand there. False: it could not, and the
/// file ends where it did.
using McapSink = std::function<bool(std::uint64_t at, std::span<const std::uint8_t> bytes)>;

/// Writes an MCAP file of ROS 2 messages (profile ros2: encoding cdr, schemas ros2msg), in batches that are in it whole
/// or not at all. After each batch it is a file that others read: the messages lie in it one by one, behind a record of
/// as many bytes as the head of a chunk has. Once they are a chunk of 1 MiB, its head is put over that record: without
/// compression, with its CRC; the index of its messages follows. What it holds in memory is a batch, and an index of
/// the chunks and of the newest one's messages.
class McapWriter {
 public:
  static constexpr std::size_t kChunk = 1u << 20;  ///< bytes at which a chunk is ended

  /// `library`: who writes it.
  explicit McapWriter(std::string_view library);

  /// Adds a channel and gives its number. `type`: of its messages, as std_msgs/msg/String; `schema`: the text of its
  /// definition, which is one for all channels of that type. Precondition: no message was written yet.
  std::uint16_t add_channel(std::string_view topic, std::string_view type, std::string_view schema);
  /// Adds a message to the batch, on a channel that was added: `cdr` with its encapsulation, and what follows it.
  void write(std::uint16_t channel, McapTimes times, std::span<const std::uint8_t> cdr,
             std::span<const std::uint8_t> more = {});
  /// Bytes of the batch's messages. As many as kChunk end the chunk that they are put into.
  std::size_t waiting() const noexcept { return batch_.size() - begin_; }
  /// Puts the batch into the file. False: it is not there, and waits still.
  bool flush(const McapSink& sink);
  /// Leaves the batch out of the file.
  void drop();
  /// Puts the batch into the file, and ends it with a summary, by which readers seek; nothing may be written after it.
  /// False: not all of it is there; what is can be read.
  bool finish(const McapSink& sink);
  /// Messages in the file, of each channel: the first has number 1.
  const std::vector<std::uint64_t>& messages() const noexcept { return messages_; }

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Span {
    std::uint64_t first_ns = 0, last_ns = 0, messages = 0;
    void add(std::uint64_t t_ns);
  };
  struct Place {
    std::uint16_t channel;
    std::uint64_t t_ns, offset;
  };
  struct Chunk {
    std::uint64_t at, size = 0;  ///< byte of the file where it begins; bytes of its messages
    std::uint32_t crc = 0;
    Span span{};
    std::uint64_t index_length = 0;
    std::map<std::uint16_t, std::uint64_t> index_at{};
  };

  Bytes head_of(const Chunk& chunk) const;
  bool end_chunk(const McapSink& sink);
  Bytes statistics() const;
  Bytes end_of_file() const;

  std::uint64_t at_ = 0;                                       ///< bytes in the file
  std::uint32_t crc_ = 0;                                      ///< of those before the open chunk
  std::map<std::string, std::uint16_t, std::less<>> schemas_;  ///< type → number
  Bytes schema_records_, channel_records_;                     ///< whole records, for the summary
  std::vector<std::uint64_t> messages_, numbered_;             ///< in the file, of each channel; those of the batch too
  Span span_;
  Bytes before_;           ///< what the next chunk comes behind: the file's beginning, the index of the chunk before
  Bytes batch_;            ///< messages, behind what a chunk begins with if none is open
  std::size_t begin_ = 0;  ///< bytes of that
  std::vector<Place> places_;  ///< of the messages in the batch
  std::optional<Chunk> open_;
  std::map<std::uint16_t, Bytes> index_;  ///< of the open chunk by channel: times and places
  std::vector<Chunk> chunks_;
};

}  // namespace backwash::log
