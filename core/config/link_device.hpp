// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace backwash::config {

/// What is spoken on the link.
enum class LinkProtocol {
  mavlink,
  plain,  ///< docs/plain_link.md, on a serial port
};

/// What [link] device names.
struct LinkDevice {
  enum class Kind {
    serial,  ///< a path
    udp,     ///< udp:ADDRESS:PORT: datagrams to and from this peer
    udpin,   ///< udpin:ADDRESS:PORT: bound here; the first that sends is the peer
    tcp,     ///< tcp:ADDRESS:PORT: a connection that we open
  };
  Kind kind = Kind::serial;
  std::string address;     ///< numeric IPv4; serial: the path
  std::uint16_t port = 0;  ///< of a socket, 1…65535
};

/// Reads one; what begins with none of the words above is a path. Absent: a socket without numeric address or port.
std::optional<LinkDevice> link_device(std::string_view text);

}  // namespace backwash::config
