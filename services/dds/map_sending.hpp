// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "services/dds/topics.hpp"

/// A map over a line on which one large sample does not arrive (docs/interfaces.md, "Maps in parts").
namespace backwash::dds {

constexpr std::size_t kPartBytes = 1152;      ///< of data in one part: with DDS Security around it still one datagram
constexpr std::uint32_t kPartsBeyond = 2048;  ///< that a receipt tells of, from the first missing one on

/// Parts of a map of so many bytes.
constexpr std::uint32_t parts_of(std::size_t bytes) noexcept {
  return static_cast<std::uint32_t>((bytes + kPartBytes - 1) / kPartBytes);
}

/// Which part is sent when. Loss is no sign of a full line here, delay is: the rate rises while parts come as quickly
/// as the quickest did, and falls when they wait in a queue, so that commands on the same line wait for less than
/// kQueue_ns. It rises to 1.75 times what arrives at most, so that a line without a queue loses less than half to it.
/// A part is sent again when one that was sent kReorder_ns after it has come, and otherwise after a time-out: once for
/// each loss, and never what is here. Pure: times are ns by any clock that rises.
class MapSending {
 public:
  static constexpr std::int64_t kQueue_ns = 150'000'000, kReorder_ns = 100'000'000, kSilence_ns = 1'000'000'000,
                                kAsk_ns = 300'000'000;
  /// Bytes that a part takes on the line at least: its data, and the heads of message, RTPS, UDP and IP.
  static constexpr double kOnLine = kPartBytes + 160;

  /// `bytes`: of the map, at least 1. `most`: rate in byte/s that is never exceeded, at least kLeast.
  MapSending(std::size_t bytes, double most, std::int64_t now_ns);
  /// The part to send now, which counts as sent from then on; nothing: later. Once all are here, one goes out now and
  /// then: what became of the map is in the receipt that it calls for.
  std::optional<std::uint32_t> next(std::int64_t now_ns);
  /// Takes what a receipt of this transfer says. One that no daemon can have meant changes nothing.
  void hear(const MapReceipt& receipt, std::int64_t now_ns);

  std::uint32_t count() const noexcept { return static_cast<std::uint32_t>(parts_.size()); }
  std::uint32_t held() const noexcept { return held_; }
  std::uint32_t first_missing() const noexcept { return first_missing_; }
  std::uint64_t sent() const noexcept { return sent_; }  ///< parts, each as often as it was
  double rate() const noexcept { return rate_; }         ///< byte/s on the line
  /// When a part was last told of that was not before; the start before the first.
  std::int64_t progress_ns() const noexcept { return progress_ns_; }
  /// When a receipt came last.
  std::int64_t heard_ns() const noexcept { return heard_ns_; }

  static constexpr double kLeast = 8e3;  ///< byte/s

 private:
  struct Part {
    std::int64_t sent_ns = -1;  // last; −1: never
    bool held = false;
  };
  void hold(std::uint32_t number, std::int64_t now_ns);
  void begin_anew(const MapReceipt& receipt);
  bool is_lost(const Part& part, std::int64_t now_ns) const noexcept;
  void steer(std::int64_t now_ns);

  std::vector<Part> parts_;
  double most_, rate_, credit_ = kOnLine;  // byte
  std::int64_t credit_ns_, progress_ns_, heard_ns_, steered_ns_;
  std::int64_t newest_ns_ = -1;                         // when the newest part was sent that is known to have come
  std::int64_t way_ns_ = 0, least_way_ns_ = INT64_MAX;  // there and back, of the newest receipt and of the quickest
  std::int64_t step_way_ns_ = INT64_MAX;                // of the quickest since the last step of the rate
  double queue_ns_ = 0;                                 // in the line's queue, at the last step
  std::uint32_t held_ = 0, first_missing_ = 0, fresh_ = 0, looked_at_ = 0, steered_held_ = 0;
  std::uint64_t sent_ = 0;
  bool filled_ = false;  // the line's queue, once
  double arrives_ = 0;   // byte/s, the most lately
};

}  // namespace backwash::dds
