// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "core/config/daemon_config.hpp"

namespace backwash::daemon {

/// Everything that a daemon is started with, read and validated before any port is opened (faults.md row 38).
struct Settings {
  config::Daemon daemon;
  Vehicle vehicle;
  Model model;
};

/// Reads the daemon's file and the vehicle and model files that it names. Error: one line naming file, line and key.
tl::expected<Settings, std::string> load_settings(const std::string& path);

/// Runs until SIGINT or SIGTERM; returns the exit code: 0, or 74 when the device is no port
/// that we could use (one that is missing or busy is waited for). Throws for DDS and log
/// failures at start.
int run(const Settings& settings);

}  // namespace backwash::daemon
