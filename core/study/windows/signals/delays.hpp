// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "core/study/windows/observation.hpp"
#include "core/study/windows/signals/instrument.hpp"
#include "core/study/windows/signals/series.hpp"
#include "core/study/windows/stretch.hpp"

namespace backwash::study {

/// How late and how steeply thrust and commands act: what windows say of it, of which the designs follow when all
/// flights are together.
struct Delays {
  /// Σ z (level, rate)/√Σz² of a window, z the instrument of the delay and that of the slope; their means; its part of
  /// the first stage.
  struct ThrustMoments {
    std::size_t window;
    std::array<double, 2> delay{}, slope{}, mean{};  // mean: not an instrument's, of the window
    FirstStage stage{};
  };
  std::vector<ThrustMoments> thrust;
  std::array<DelayStage, 2> command;  ///< level, vertical
  DelayStage tilt;

  /// The rows of a window that is number `number`; `row`: gets its weights along the window and its design of a lag.
  /// Precondition: the flight has set-points.
  std::vector<ChannelValue> add(const Series& s, SampleRange rows, std::size_t number, WindowRow& row);
  /// What another one was given, its windows counted from `first`.
  void add(const Delays& other, std::size_t first);
  /// Sets the designs of all windows.
  void settle(std::vector<WindowRow>& windows) const;
};

}  // namespace backwash::study
