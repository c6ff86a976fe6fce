// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

/// Names of frames, as messages hold them: the daemon's own by default, and one that it does not know.
namespace backwash::daemon {

inline const std::string kMap = "map", kOdom = "odom", kBody = "base_link", kUnknownFrame = "camera";

}  // namespace backwash::daemon
