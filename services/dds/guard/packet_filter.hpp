// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace backwash::dds {

/// What a datagram of RTPS (the wire protocol of DDS) must be before the middleware parses it (docs/faults.md row 47).
/// libddsc 0.10.2 trusts parts of what strangers send: descriptions of types end the process with abort() if they are
/// malformed. Flight needs none of them: our types are final, generated without descriptions, and matched by name. So
/// every datagram that the process receives goes through here first (recvmsg() in dds.cpp), and
/// - parameters that describe types, and whatever belongs to the type lookup service, are made padding;
/// - submessages of plain discovery that are not well-formed, or come in fragments, are made padding;
/// - what follows a submessage that is longer than the datagram is cut off.
/// Works in place; returns how many bytes are left, at least the 20 of the header. A datagram of another protocol is
/// left as it is. Protected submessages of DDS Security pass: their content is authenticated before it is parsed. So do
/// its handshakes, which authenticate: they may come in fragments, but not as a key (a null pointer in libddsc).
/// Real-time: no allocation, O(bytes) for discovery and O(submessages) for the rest.
std::size_t filter_packet(std::span<std::uint8_t> datagram) noexcept;

/// Submessages and parameters made padding so far.
std::uint64_t filtered_parts() noexcept;

}  // namespace backwash::dds
