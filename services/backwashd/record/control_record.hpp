// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "core/log/raw/raw_log.hpp"

namespace backwash::daemon {

/// One record of a real-time thread for the raw log.
struct ControlRecord {
  log::RecordHeader header{};
  std::array<std::uint8_t, 512> bytes{};
};

}  // namespace backwash::daemon
