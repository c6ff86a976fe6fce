// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "services/backwashd/map/mapped.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// Puts the parts of a map together (docs/interfaces.md, "Maps in parts"), one map at a time, and says in receipts what
/// is here. It holds no more than the map's own size and a bit for each part. Pure: it has no clock of its own.
class MapParts {
 public:
  static constexpr std::int64_t kReceipt_ns = 100'000'000;  ///< between two receipts
  // A part that is here already is none of these: who repeats it holds no place by it.
  static constexpr std::int64_t kSilent_ns = 10'000'000'000;  ///< without a new part: the operator is told
  static constexpr std::int64_t kYield_ns = 2'000'000'000;    ///< without a new part: the map of another may begin
  static constexpr std::int64_t kForget_ns = 60'000'000'000;  ///< without a new part: what came of the map is let go

  static constexpr std::int64_t kOneIn_ns = 1'000'000'000;  ///< between two maps of one writer: each takes memory

  /// `most_bytes`: larger maps are refused. `frame`: the one that maps are in.
  MapParts(std::size_t most_bytes, std::string frame) : most_bytes_(most_bytes), frame_(std::move(frame)) {}

  /// What a part did. Error: why it was refused; that of the whole map goes into its receipts too.
  enum class Taken { begins, here, whole };
  tl::expected<Taken, std::string> take(const dds::MapPart& part, const WriterId& writer, std::int64_t now_ns);
  /// Refuses the map that this part belongs to, and says so in its receipts. One that is whole keeps its verdict.
  void refuse(const dds::MapPart& part, const WriterId& writer, const std::string& why, std::int64_t now_ns);
  /// The map, once after Taken::whole. `from.term` is the caller's.
  MapMessage message();
  /// Takes what the map worker made of it.
  void judge(const MapVerdict& verdict);
  /// Another map took the place of this one before the map worker looked at it: if it came in parts, that is what
  /// became of it. Null: none did.
  void displaced(const MapMessage* message);

  /// A receipt that is due; what it points to lives until the next call.
  std::optional<dds::MapReceipt> receipt(std::int64_t now_ns);
  /// One line for the operator, once: a map that began to arrive does not go on.
  std::optional<std::string> stalled(std::int64_t now_ns);
  /// The same, where the sender is among those that are gone. Another map may begin at once.
  std::optional<std::string> let_go(std::span<const WriterId> departed);
  /// "a map of 20.0 MiB in parts of writer X"
  std::string what() const;
  double age_s(std::int64_t now_ns) const noexcept { return seconds(now_ns - begun_ns_); }

 private:
  void begin(const dds::MapPart& part, const WriterId& writer, std::int64_t now_ns);
  std::optional<std::string> wrong(const dds::MapPart& part) const;
  bool is_of_this(const dds::MapPart& part) const noexcept;
  bool arriving() const noexcept { return transfer_ && state_ == backwash_msgs_msg_dds__MAPRECEIPT_ARRIVING; }
  bool judged() const noexcept { return transfer_ && state_ == backwash_msgs_msg_dds__MAPRECEIPT_WHOLE; }  ///< soon
  /// Its sender is still there: no other's may begin, or nobody would tell it what became of its map.
  bool alive(std::int64_t now_ns) const noexcept { return (arriving() || judged()) && now_ns - heard_ns_ < kYield_ns; }
  void end(std::uint8_t state, std::string reason);
  void forget();
  std::string came() const;

  std::size_t most_bytes_;
  std::string frame_;
  std::optional<std::uint64_t> transfer_;
  WriterId writer_{};
  std::string id_;
  bool binary_ = true;
  double resolution_ = 0;  // m
  std::uint64_t hash_ = 0, newest_ = 0;
  std::size_t size_ = 0;
  std::vector<std::int8_t> data_;
  std::vector<bool> here_;
  std::uint32_t held_ = 0, first_missing_ = 0;
  std::int64_t begun_ns_ = 0, heard_ns_ = 0, newest_ns_ = 0, told_ns_ = 0;
  bool owes_ = false, said_ = false;      // a receipt; that it does not go on
  std::optional<std::string> cut_short_;  // of a map in whose place another began
  std::uint8_t state_ = 0;
  std::string reason_;
  std::array<std::uint8_t, 256> beyond_{};
};

}  // namespace backwash::daemon
