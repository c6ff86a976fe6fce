// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/port/serial_port.hpp"

#include <asm/termbits.h>  // termios2, which <termios.h> does not have and does not go with
#include <fcntl.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

namespace backwash::firmware_bridge {
namespace {

// A receiver samples the middle of the tenth bit half a bit off at 5 %; each end may have half of that.
constexpr double kBaudTolerance = 0.025;

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

/// 8N1, nothing changed on the way, no flow control, `baud` bit/s whether it has a name or not.
void make_raw(termios2& t, unsigned baud) noexcept {
  t.c_iflag = 0;
  t.c_oflag = 0;
  t.c_lflag = 0;
  t.c_cflag = CS8 | CLOCAL | CREAD | BOTHER;
  t.c_ispeed = t.c_ospeed = baud;
  // With at least one byte to wait for, "nothing yet" is EAGAIN, and a read of 0 bytes can only be a hang-up.
  t.c_cc[VMIN] = 1;
  t.c_cc[VTIME] = 0;
}

/// Some drivers gather what they receive for up to 16 ms; those without the flag have nothing to change.
void ask_for_low_latency(int fd) noexcept {
  serial_struct settings{};
  if (::ioctl(fd, TIOCGSERIAL, &settings) != 0) return;
  settings.flags |= ASYNC_LOW_LATENCY;
  ::ioctl(fd, TIOCSSERIAL, &settings);
}

}  // namespace

tl::expected<SerialPort, PortError> SerialPort::open(const std::string& path, unsigned baud) {
  if (baud == 0) return error(Kind::baud_rate, 0);
  FileDescriptor fd(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (fd.get() < 0) return error(errno == EBUSY ? Kind::busy : Kind::open, errno);
  if (!lock(fd.get())) return error(Kind::busy, errno);
  termios2 settings{};
  if (::ioctl(fd.get(), TCGETS2, &settings) != 0)
    return error(errno == ENOTTY ? Kind::not_serial : Kind::configure, errno);
  make_raw(settings, baud);
  if (::ioctl(fd.get(), TCSETS2, &settings) != 0) return error(Kind::configure, errno);
  // The call succeeds when any of the settings was taken; a rate becomes what the device's clock can be divided to.
  termios2 taken{};
  if (::ioctl(fd.get(), TCGETS2, &taken) != 0) return error(Kind::configure, errno);
  if (std::abs(static_cast<double>(taken.c_ospeed) - baud) > kBaudTolerance * baud) return error(Kind::baud_rate, 0);
  ask_for_low_latency(fd.get());
  if (::ioctl(fd.get(), TIOCEXCL) != 0) return error(Kind::configure, errno);
  ::ioctl(fd.get(), TCFLSH, TCIOFLUSH);
  return SerialPort(std::move(fd));
}

tl::expected<std::size_t, PortError> SerialPort::read(std::span<std::uint8_t> into) noexcept {
  // Only what is at hand is read: a read from an empty terminal waits, even when non-blocking, until a kernel worker
  // has flushed the line, and that worker has ordinary priority (up to 300 ms seen with both processors busy).
  int at_hand = 0;
  if (::ioctl(fd_.get(), FIONREAD, &at_hand) != 0) return error(Kind::lost, errno);
  if (at_hand <= 0) return 0U;
  const auto n = ::read(fd_.get(), into.data(), std::min(into.size(), static_cast<std::size_t>(at_hand)));
  if (n > 0) return static_cast<std::size_t>(n);
  if (n < 0 && nothing_now(errno)) return 0U;
  return error(Kind::lost, n < 0 ? errno : 0);
}

tl::expected<std::size_t, PortError> SerialPort::write(std::span<const std::uint8_t> bytes) noexcept {
  const auto n = ::write(fd_.get(), bytes.data(), bytes.size());
  if (n >= 0) return static_cast<std::size_t>(n);
  if (nothing_now(errno)) return 0U;
  return error(Kind::lost, errno);
}

void SerialPort::discard_output() noexcept { ::ioctl(fd_.get(), TCFLSH, TCOFLUSH); }

}  // namespace backwash::firmware_bridge
