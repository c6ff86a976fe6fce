// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "services/dds/status_members.hpp"

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
  void add(std::string key, std::string value);

  std::string name_, said_;
  std::deque<std::string> texts_;
  std::vector<dds::KeyValue> values_;
  dds::DiagnosticStatus status_{};
  dds::DiagnosticArray message_{};
};

}  // namespace backwash::daemon
