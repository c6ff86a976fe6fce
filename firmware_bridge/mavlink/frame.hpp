// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware_bridge/mavlink/codec.hpp"

namespace backwash::mavlink {

inline constexpr std::uint8_t kMagicV2 = 0xFD;
inline constexpr std::uint8_t kMagicV1 = 0xFE;
inline constexpr std::uint8_t kIncompatSigned = 0x01;  ///< a signature block follows the checksum
inline constexpr std::size_t kHeaderV2 = 10, kHeaderV1 = 6, kChecksum = 2, kSignature = 13;
inline constexpr std::size_t kMaxFrame = kHeaderV2 + kMaxPayload + kChecksum + kSignature;

/// Who sends a frame, and its number in the sender's count.
struct Sender {
  std::uint8_t system = 0;
  std::uint8_t component = 0;
  std::uint8_t sequence = 0;
};

/// A received frame whose checksum is right. The spans point into the parser and hold until its next call.
struct Frame {
  std::uint8_t magic = kMagicV2;
  std::uint8_t incompat_flags = 0;
  Sender sender;
  std::uint32_t id = 0;
  std::span<const std::uint8_t> payload;
  std::span<const std::uint8_t> bytes;      ///< the whole frame, without the signature block that follows it in memory
  std::span<const std::uint8_t> signature;  ///< link id, time and hash; empty when unsigned. Signing judges it
};

/// What the parser saw since it was made. A byte is counted once: in an accepted frame, in a dropped one, or as
/// skipped.
struct ParserCounters {
  std::uint64_t bytes = 0;             ///< taken in
  std::uint64_t frames = 0;            ///< accepted
  std::uint64_t bad_crc = 0;           ///< headers of known messages whose checksum was wrong
  std::uint64_t unknown_id = 0;        ///< frames of messages not in KnownMessages, passed over whole
  std::uint64_t unknown_incompat = 0;  ///< frames with right checksum and flags that we must not ignore, dropped
  std::uint64_t skipped_bytes = 0;     ///< passed over one by one in search of a frame
};

/// Byte stream to frames, MAVLink 2 and 1.
///
/// After a wrong checksum only the false start byte is passed over and the bytes behind it are looked at again, so a
/// false or damaged frame never swallows a good one: every undamaged frame of a known message that does not begin
/// inside an accepted or passed-over frame is found. A message not in KnownMessages has no checksum that could be
/// tested: it is passed over whole only if it begins where the last frame ended, continues that frame's sender and
/// count, and is followed by a start byte; otherwise it is searched like noise.
///
/// Real-time: wait-free, no allocation; at most one frame (280 bytes) is held back.
class Parser {
 public:
  /// Takes all bytes and calls on_frame(const Frame&) for each frame completed by them.
  template <class OnFrame>
  void feed(std::span<const std::uint8_t> input, OnFrame&& on_frame) noexcept {
    while (!input.empty()) {
      input = input.subspan(take(input));
      while (const auto frame = next()) on_frame(*frame);
    }
  }
  const ParserCounters& counters() const noexcept { return counters_; }

 private:
  std::size_t take(std::span<const std::uint8_t> input) noexcept;
  std::optional<Frame> next() noexcept;

  std::array<std::uint8_t, 2 * kMaxFrame> buffer_{};
  std::size_t begin_ = 0, end_ = 0;  // bytes not yet judged
  bool in_step_ = false;             // begin_ is where the last frame ended
  Sender last_sender_;               // of that frame
  ParserCounters counters_;
};

/// A frame ready to send.
struct EncodedFrame {
  std::array<std::uint8_t, kMaxFrame> bytes{};
  std::size_t length = 0;
  std::span<const std::uint8_t> view() const noexcept { return {bytes.data(), length}; }
};

/// MAVLink 2 frame of a payload. With kIncompatSigned in the flags it is complete only once Signing::sign() has added
/// the signature. Real-time: wait-free, no allocation.
EncodedFrame encode_frame(const Sender& sender, std::uint32_t id, std::uint8_t crc_extra, const Payload& payload,
                          std::uint8_t incompat_flags = 0) noexcept;

/// MAVLink 2 frame of a message. Real-time: wait-free, no allocation.
template <class Message>
EncodedFrame encode_frame(const Sender& sender, const Message& message, std::uint8_t incompat_flags = 0) noexcept {
  constexpr MessageInfo m = info<Message>();
  return encode_frame(sender, m.id, m.crc_extra, encode(message), incompat_flags);
}

}  // namespace backwash::mavlink
