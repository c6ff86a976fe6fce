// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <span>

#include "services/dds/guard/door.hpp"

/// What `dds.interface = "lo"` means. libddsc 0.10.2 binds its sockets to every address of the machine whatever the
/// interface, and takes no peer that names another address than a loopback one.
namespace backwash::dds {

/// From now on this process hears this machine alone. Call before the first participant is made.
void loopback_alone() noexcept;

/// Of a datagram that was received: how many of its octets the middleware may read. After loopback_alone(), of one
/// that another machine sent only the 20 of a header are left, which say nothing; and in discovery data the addresses
/// of this machine become 127.0.0.1, so that a peer whose own settings have it on a network is reached all the same.
/// The kernel takes no packet from outside that claims an address of this machine. Asks it for those addresses once a
/// second at most, and only where a source is not a loopback one.
std::size_t heard_of(const msghdr& message, std::span<std::uint8_t> datagram) noexcept;

/// Who sent it, by IPv4; zeros if it is not known. After loopback_alone() that is this machine, 127.0.0.1, whichever of
/// its addresses it used.
Door::Source source_of(const msghdr& message) noexcept;

/// Makes locators in the parameter list of discovery data 127.0.0.1 where `ours` says their address is this machine's;
/// returns how many. For heard_of and its tests. Pure.
using IsOurs = bool (*)(std::uint32_t address_host_order);
std::size_t by_loopback(std::span<std::uint8_t> datagram, IsOurs ours) noexcept;

}  // namespace backwash::dds
