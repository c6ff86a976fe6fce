// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>

#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// The daemon's status as ROS 2's diagnostic tools show it (diagnostic_msgs/DiagnosticArray): one component with one
/// level, and the values that a person looks at first. The message points into it and into the status.
class ShownDiagnostics {
 public:
  /// Levels of diagnostic_msgs/DiagnosticStatus.
  static constexpr std::uint8_t kOk = 0, kWarn = 1, kError = 2;

  ShownDiagnostics(const dds::Status& status, const std::string& name_space);
  ShownDiagnostics(const ShownDiagnostics&) = delete;
  ShownDiagnostics& operator=(const ShownDiagnostics&) = delete;

  const dds::DiagnosticArray& message() const noexcept { return message_; }

 private:
  static constexpr std::size_t kValues = 10;
  void add(const char* key, std::string value);

  std::string name_, said_;
  std::array<std::string, kValues> texts_;
  std::array<dds::KeyValue, kValues> values_{};
  std::uint32_t count_ = 0;
  dds::DiagnosticStatus status_{};
  dds::DiagnosticArray message_{};
};

}  // namespace backwash::daemon
