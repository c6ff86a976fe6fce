// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "firmware_bridge/mavlink/frame.hpp"

namespace backwash::mavlink {

using SigningKey = std::array<std::uint8_t, 32>;

/// Time of a signature: 10 µs since 2015-01-01 00:00 UTC, 48 bits on the wire.
using SigningTime = std::uint64_t;
inline constexpr SigningTime kLastSigningTime = (SigningTime{1} << 48) - 1;
inline constexpr SigningTime kSigningSecond = 100'000;
inline constexpr SigningTime kOldestNewStream = 60 * kSigningSecond;  ///< behind our own time

/// What a frame's signature is worth.
enum class SignatureVerdict : std::uint8_t {
  good,
  not_signed,       ///< no signature; MAVLink 1 has none
  wrong_signature,  ///< made with another key, or the frame was changed
  replayed,         ///< right, but not newer than the last of its stream
  old,              ///< right, the first of its stream and more than a minute behind our own time
  no_room,          ///< right, but of one more stream than are kept
};

struct SigningCounters {
  std::uint64_t good = 0, unsigned_frames = 0, wrong_signature = 0, replayed = 0, old = 0, no_room = 0;
  std::uint64_t refused() const noexcept { return unsigned_frames + wrong_signature + replayed + old + no_room; }
};

/// MAVLink 2 message signing of one link (MAVLink guide, "Message Signing"): the first 48 bits of SHA-256 over key,
/// frame, link id and time. A stream is a sender's (system, component, link id). Its time must rise from frame to
/// frame, and our own time follows the newest that anybody who holds the key has used.
/// Real-time: wait-free, no allocation; one SHA-256 of a frame a call.
class Signing {
 public:
  static constexpr std::size_t kStreams = 16;

  /// `now`: not before any time that this system has signed with under this key, also in earlier runs.
  Signing(const SigningKey& key, std::uint8_t link_id, SigningTime now) noexcept
      : key_(key), link_id_(link_id), time_(now) {}

  /// Our own time never goes back.
  void advance_to(SigningTime now) noexcept;
  /// Of the newest signature, ours or a good one of others.
  SigningTime time() const noexcept { return time_; }

  /// Appends the signature, with a time later than any before. Precondition: the frame was encoded for it
  /// (encode_frame with kIncompatSigned). False at the end of time, in 2104: it is left unsigned.
  bool sign(EncodedFrame& frame) noexcept;

  /// Judges a received frame and counts it. Only a good one changes what is known of its stream and our own time.
  SignatureVerdict judge(const Frame& frame) noexcept;
  const SigningCounters& counters() const noexcept { return counters_; }

 private:
  struct Stream {
    std::uint8_t system, component, link_id;
    SigningTime time;
  };
  using Hash = std::array<std::uint8_t, 6>;
  Hash hash(std::span<const std::uint8_t> frame, std::span<const std::uint8_t> link_and_time) const noexcept;
  SignatureVerdict judge_stream(const Stream& now) noexcept;

  SigningKey key_;
  std::uint8_t link_id_;
  SigningTime time_;
  std::array<std::optional<Stream>, kStreams> streams_;
  SigningCounters counters_;
};

}  // namespace backwash::mavlink
