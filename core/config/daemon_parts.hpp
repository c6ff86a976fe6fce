// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/config/daemon_config.hpp"
#include "core/config/strict_table.hpp"

// Parts of the daemon's file that are read by themselves.
namespace backwash::config {

/// What a file says of the odometry, as it stands there.
struct OdometryWords {
  std::string profile = "ros", twist, message = "odometry";
};

/// The profile's frames where none are given, and its twist; a custom one's own.
tl::expected<void, ConfigError> read_odometry(const StrictTable& file, const OdometryWords& said, Daemon& d);

/// `sent`: dds.tf. Who takes poses and closures from rt/tf would hear itself there.
tl::expected<void, ConfigError> read_frames(const StrictTable& file, const std::string& sent, Daemon& d);

}  // namespace backwash::config
