// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bit>

#include "core/log/raw/tick_decisions.hpp"

namespace backwash::log {

/// Compares what a list has of a tick, and mixes what was replayed into the hash.
template <typename List, typename Record>
std::optional<Difference> compare(const List& list, const Record& logged, const Record& replayed, std::uint64_t& hash) {
  std::optional<Difference> first;
  const auto number = [&](const char* name, auto a, auto b) {
    using Bits = std::array<std::uint8_t, sizeof b>;
    const auto bytes = std::bit_cast<Bits>(b);
    for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001b3u;
    if (std::bit_cast<Bits>(a) != bytes && !first)  // bit for bit
      first = Difference{logged.tick, 0, name, static_cast<double>(a), static_cast<double>(b)};
  };
  each_decision(list, [&](const auto& decision) {
    const auto &a = logged.*decision.member, &b = replayed.*decision.member;
    if constexpr (std::is_array_v<std::remove_cvref_t<decltype(a)>>)
      for (std::size_t i = 0; i < std::size(a); ++i) number(decision.name, a[i], b[i]);
    else
      number(decision.name, a, b);
  });
  return first;
}

/// The air's part of a replay: what is learnt, and the records that the next tick is compared with.
class ReplayedAir {
 public:
  /// Takes a record of the air, which outlives this. Says what is wrong with it.
  std::optional<std::string> take(const RawRecord& record);
  /// The air of a tick that the log has no input of is not replayed; what was asked in it is done as the log says.
  void skip() noexcept;
  /// The tick's orders, then what it added, again; where it differs first. Mixes what was replayed into the hash.
  std::optional<Difference> step(const track::TickInput& in, const track::FlightTick& flight,
                                 const track::TickOutput& out, std::uint64_t tick, std::uint64_t& hash);

 private:
  std::optional<Difference> carry_out_orders(const track::TickInput& in, std::uint64_t& hash);

  struct Order {
    const AirOrderRecord* logged;
    std::uint64_t offset;
  };
  std::optional<adapt::InFlight> air_;
  std::vector<Order> orders_;
  const AirRecord* next_ = nullptr;
  std::uint64_t offset_ = 0;
};

}  // namespace backwash::log
