// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "core/adapt/in_flight.hpp"
#include "core/config/daemon_config.hpp"
#include "services/command_line/exit_code.hpp"
#include "services/security/credentials.hpp"

namespace backwash::daemon {

/// Everything that a daemon is started with, read and validated before any port is opened (docs/faults.md row 38).
struct Settings {
  config::Daemon daemon;
  Vehicle vehicle;
  Model model;
  std::optional<security::Credentials> credentials;  ///< of DDS Security; absent: everyone may speak
  std::optional<adapt::InFlightConstants> air{};     ///< none: nothing is learnt of the air
};

/// Reads the daemon's file and the vehicle and model files that it names. Error: 66 where one of them is missing, 78
/// where it is wrong, naming file, line and key.
tl::expected<Settings, StartError> load_settings(const std::string& path);

/// Runs until SIGINT or SIGTERM; returns the exit code: 0; 74 when the device is no port that can be
/// used (one that is missing or busy is waited for), 73 when the log cannot be
/// made, 71 when the middleware or a thread cannot be started; 70 after an exception in any thread, which ends the
/// flight in silence (docs/faults.md row 50); 74 also when the disk does not answer at the end. Each is one line on
/// standard error.
int run(const Settings& settings);

}  // namespace backwash::daemon
