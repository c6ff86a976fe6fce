// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>

namespace backwash::firmware_bridge {

/// One line of a GPIO chip, held for us alone, by libgpiod 1 (line_v1.cpp) or 2 (line_v2.cpp), whichever is installed.
/// Nothing here is real-time: a line behind an I²C expander waits for its bus.
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
  // The two libraries have no type in common.
  struct Handle;
  struct Release {
    void operator()(Handle* handle) const noexcept;
  };
  explicit GpioLine(std::unique_ptr<Handle, Release> handle) noexcept : handle_(std::move(handle)) {}
  std::unique_ptr<Handle, Release> handle_;
};

}  // namespace backwash::firmware_bridge
