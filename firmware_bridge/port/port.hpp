// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace backwash::firmware_bridge {

/// Why a port could not be opened or used.
struct PortError {
  enum class Kind {
    open,        ///< the path or socket could not be opened
    busy,        ///< another program holds the serial port
    not_serial,  ///< the path is not a terminal device
    baud_rate,   ///< a rate that the device cannot do
    configure,   ///< the device refused its settings
    address,     ///< not a numeric IPv4 address
    lost,        ///< unplugged, hung up, or a failing device; open it again
  };
  Kind kind;
  int system_error = 0;  ///< errno; 0 where there is none (hang-up)
};

/// One line for the operator. Not real-time.
std::string describe(const PortError& error);

/// Stands for a port that could not be opened yet: lost from the start, so that the one that is opened later takes its
/// place like any other. Real-time.
struct ClosedPort {
  tl::expected<std::size_t, PortError> read(std::span<std::uint8_t>) noexcept { return lost(); }
  tl::expected<std::size_t, PortError> write(std::span<const std::uint8_t>) noexcept { return lost(); }
  void discard_output() noexcept {}

 private:
  static tl::unexpected<PortError> lost() noexcept { return tl::unexpected(PortError{PortError::Kind::lost}); }
};

/// Owns a file descriptor.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) noexcept : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~FileDescriptor();
  int get() const noexcept { return fd_; }

 private:
  int fd_;
};

}  // namespace backwash::firmware_bridge
