// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "core/types/vehicle.hpp"
#include "services/backwashd/control/controlled.hpp"
#include "services/backwashd/control/doubts.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

struct Channels;

/// The status of one moment, with all that its message points to.
class ShownStatus {
 public:
  ShownStatus(const ControlView& view, const Vehicle& vehicle, const Channels& channels);
  ShownStatus(const ShownStatus&) = delete;
  ShownStatus& operator=(const ShownStatus&) = delete;

  /// To be completed by what other threads have said.
  dds::Status& message() noexcept { return message_; }

 private:
  void take_view(const ControlView& view);
  void take_counts(const Channels& channels);
  void take_parameters(const ControlView& view, const Vehicle& vehicle);
  char* keep(std::string text) { return texts_.emplace_back(std::move(text)).data(); }

  std::deque<std::string> texts_;
  Doubts doubts_;
  std::vector<firmware_bridge::ParameterFinding> findings_;
  std::vector<dds::Parameter> parameters_;
  std::vector<dds::Advice> advice_;
  dds::Status message_;
};

}  // namespace backwash::daemon
