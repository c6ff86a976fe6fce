// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <gpiod.hpp>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace backwash::firmware_bridge {

/// One line of a GPIO chip, held for us alone, by libgpiod 1. Nothing here is real-time: a line behind an
/// I²C expander waits for its bus.
class GpioLine {
 public:
  enum class Use {
    switch_input,  ///< pulled up, with events at both edges
    output,        ///< low at first
  };
  struct Edge {
    bool high;
    std::chrono::steady_clock::time_point at;
  };
  GpioLine(GpioLine&&) = default;
  GpioLine& operator=(GpioLine&&) = default;
  using Error = std::string;  ///< one line: chip, line and the system's reason

  /// `chip`: a device as /dev/gpiochip0, or the label of the first that has it; `name`: of the line, as the board's
  /// description has it.
  static tl::expected<GpioLine, Error> open(const std::string& chip, const std::string& name, Use use);

  /// Waits at most so long for an edge of an input; true: next_edge() has one. Error: the line is gone.
  tl::expected<bool, Error> wait(std::chrono::nanoseconds most);
  /// The oldest edge that was not taken yet. Precondition: wait() was true. Error: the line is gone.
  tl::expected<Edge, Error> next_edge();
  /// Present level, high = true. Error: the line is gone.
  tl::expected<bool, Error> level() const;
  /// Drives an output. Error: the line is gone.
  tl::expected<void, Error> set(bool high);

 private:
  GpioLine(gpiod::line line, std::string what) : line_(std::move(line)), what_(std::move(what)) {}
  gpiod::line line_;  // keeps its chip open, and is given back with it
  std::string what_;  // chip and line
};

}  // namespace backwash::firmware_bridge
