// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/port/port.hpp"

#include <unistd.h>

#include <system_error>

namespace backwash::firmware_bridge {

FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) ::close(fd_);
}

std::string describe(const PortError& error) {
  std::string text;
  switch (error.kind) {
    case PortError::Kind::open:
      text = "cannot be opened";
      break;
    case PortError::Kind::busy:
      text = "is held by another program";
      break;
    case PortError::Kind::not_serial:
      text = "is not a serial port";
      break;
    case PortError::Kind::baud_rate:
      text = "cannot do this baud rate";
      break;
    case PortError::Kind::configure:
      text = "refused its settings";
      break;
    case PortError::Kind::address:
      text = "is not a numeric IPv4 address";
      break;
    case PortError::Kind::lost:
      text = "was unplugged or hung up";
      break;
  }
  if (error.system_error != 0) text += ": " + std::generic_category().message(error.system_error);
  return text;
}

}  // namespace backwash::firmware_bridge
