// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/config/daemon_config.hpp"
#include "core/config/strict_table.hpp"

// Parts of the daemon's file that are read by themselves.
namespace backwash::config {

using TextKey = std::pair<std::string_view, std::string*>;

tl::expected<void, ConfigError> read_texts(const StrictTable& file, std::span<const TextKey> keys, bool needed);

inline constexpr std::string_view kOdometryTexts[] = {"odometry.profile", "odometry.twist", "odometry.child",
                                                      "odometry.message"};
inline constexpr std::string_view kRateLeast = "odometry.rate_least";

/// The profile's frames where none are given, and its twist; a custom one's own.
tl::expected<void, ConfigError> read_odometry(const StrictTable& file, Daemon& d);

/// `sent`: dds.tf. Who takes poses and closures from rt/tf would hear itself there.
tl::expected<void, ConfigError> read_frames(const StrictTable& file, const std::string& sent, Daemon& d);

}  // namespace backwash::config
