// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "services/dds/guard/door.hpp"

/// What of a datagram the middleware may read, by who speaks (docs/faults.md row 26).
namespace backwash::dds {

/// A datagram's circumstances: where it came from, and when, ns by a clock that rises. `secured`: this process speaks
/// by DDS Security.
struct Heard {
  Door::Source from;
  std::int64_t now_ns;
  bool secured;
};

/// To be called with what filter_packet() left. Works in place, and returns how many bytes are left.
/// - Of participants whom the door does not know nothing is left but announcements that it lets in.
/// - Who announces speaks for itself alone: for the participant of the datagram, and for endpoints of that.
/// - A lease is cut to Door::kLease_s; an announcement without one does not pass, nor one of more than 4 KiB. None
/// makes
///   another participant's lease endless.
/// - Endpoints of topics that this process does not have, and those beyond the door's count, lose their topic's name,
/// by
///   which the middleware leaves them out.
/// - With DDS Security whoever names no identity is not let in, and plain discovery is announcements, handshakes and
///   signs of life; the rest comes protected. What is protected as a whole is not looked into.
/// Real-time: no allocation, never waits, O(bytes) for discovery and O(submessages) for the rest.
std::size_t let_in(Door& door, std::span<std::uint8_t> datagram, const Heard& heard) noexcept;

/// Submessages and parameters made padding by let_in() so far.
std::uint64_t kept_out_parts() noexcept;

}  // namespace backwash::dds
