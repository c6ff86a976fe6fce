// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/serial_port.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>

namespace backwash::firmware_bridge {
namespace {

struct Rate {
  unsigned baud;
  speed_t code;
};
constexpr std::array kRates{Rate{9600, B9600},       Rate{19200, B19200},     Rate{38400, B38400},
                            Rate{57600, B57600},     Rate{115200, B115200},   Rate{230400, B230400},
                            Rate{460800, B460800},   Rate{500000, B500000},   Rate{576000, B576000},
                            Rate{921600, B921600},   Rate{1000000, B1000000}, Rate{1152000, B1152000},
                            Rate{1500000, B1500000}, Rate{2000000, B2000000}, Rate{2500000, B2500000},
                            Rate{3000000, B3000000}, Rate{3500000, B3500000}, Rate{4000000, B4000000}};

std::optional<speed_t> speed_code(unsigned baud) noexcept {
  for (const auto& rate : kRates) {
    if (rate.baud == baud) return rate.code;
  }
  return std::nullopt;
}

using Kind = PortError::Kind;
tl::unexpected<PortError> error(Kind kind, int number) { return tl::unexpected(PortError{kind, number}); }

// TIOCEXCL keeps others out, but not root's. A lock of the process, so that this one may open a port that it lost again
// before the old descriptor is closed.
bool lock(int fd) noexcept {
  struct flock whole {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  return ::fcntl(fd, F_SETLK, &whole) == 0;
}

bool nothing_now(int number) noexcept { return number == EAGAIN || number == EWOULDBLOCK || number == EINTR; }

}  // namespace

tl::expected<SerialPort, PortError> SerialPort::open(const std::string& path, unsigned baud) {
  const auto speed = speed_code(baud);
  if (!speed) return error(Kind::kBaudRate, 0);
  FileDescriptor fd(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (fd.get() < 0) return error(errno == EBUSY ? Kind::kBusy : Kind::kOpen, errno);
  if (!lock(fd.get())) return error(Kind::kBusy, errno);
  termios settings{};
  if (::tcgetattr(fd.get(), &settings) != 0) return error(errno == ENOTTY ? Kind::kNotSerial : Kind::kConfigure, errno);
  ::cfmakeraw(&settings);
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  settings.c_cflag |= CLOCAL | CREAD;
  // With at least one byte to wait for, "nothing yet" is EAGAIN, and a read of 0 bytes can only be a hang-up.
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (::cfsetspeed(&settings, *speed) != 0 || ::tcsetattr(fd.get(), TCSANOW, &settings) != 0) {
    return error(Kind::kConfigure, errno);
  }
  // tcsetattr succeeds when any of the settings was taken.
  termios taken{};
  if (::tcgetattr(fd.get(), &taken) != 0) return error(Kind::kConfigure, errno);
  if (::cfgetospeed(&taken) != *speed) return error(Kind::kBaudRate, 0);
  if (::ioctl(fd.get(), TIOCEXCL) != 0) return error(Kind::kConfigure, errno);
  ::tcflush(fd.get(), TCIOFLUSH);
  return SerialPort(std::move(fd));
}

tl::expected<std::size_t, PortError> SerialPort::read(std::span<std::uint8_t> into) noexcept {
  // Only what is at hand is read: a read from an empty terminal waits, even when non-blocking, until a kernel worker
  // has flushed the line, and that worker has ordinary priority (up to 300 ms seen with both processors busy).
  int at_hand = 0;
  if (::ioctl(fd_.get(), FIONREAD, &at_hand) != 0) return error(Kind::kLost, errno);
  if (at_hand <= 0) return 0U;
  const auto n = ::read(fd_.get(), into.data(), std::min(into.size(), static_cast<std::size_t>(at_hand)));
  if (n > 0) return static_cast<std::size_t>(n);
  if (n < 0 && nothing_now(errno)) return 0U;
  return error(Kind::kLost, n < 0 ? errno : 0);
}

tl::expected<std::size_t, PortError> SerialPort::write(std::span<const std::uint8_t> bytes) noexcept {
  const auto n = ::write(fd_.get(), bytes.data(), bytes.size());
  if (n >= 0) return static_cast<std::size_t>(n);
  if (nothing_now(errno)) return 0U;
  return error(Kind::kLost, errno);
}

void SerialPort::discard_output() noexcept { ::tcflush(fd_.get(), TCOFLUSH); }

}  // namespace backwash::firmware_bridge
