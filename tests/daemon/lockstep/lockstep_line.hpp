// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {

/// The line between the flight controller and the daemon.
struct Lockstep::Line {
  virtual ~Line() = default;
  virtual firmware_bridge::Port open() = 0;  ///< the daemon's end
  /// From the flight controller; returns when all of it can be read at the other end.
  virtual void write(const std::vector<std::uint8_t>& bytes) = 0;
  /// What has arrived at the flight controller, at least `expected` bytes unless they do not come.
  virtual std::vector<std::uint8_t> read(std::size_t expected) = 0;
};

}  // namespace backwash::daemon::test
