// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace backwash::bench {

/// The controller's end of a pseudo-terminal, raw and non-blocking; `link` is a symbolic link to the other end, made at
/// start and removed at the end.
class Pty {
 public:
  /// Throws StartError naming what failed.
  explicit Pty(const std::string& link);
  ~Pty();
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;
  /// Everything at hand.
  std::vector<std::uint8_t> read();
  /// What does not fit is lost, as on a serial line without flow control.
  void write(std::span<const std::uint8_t> bytes);

 private:
  int fd_, other_;
  std::string link_;
};

}  // namespace backwash::bench
