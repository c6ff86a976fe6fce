// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/pty.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "services/command_line/exit_code.hpp"

namespace backwash::bench {

Pty::Pty(const std::string& link) : fd_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)), link_(link) {
  char name[128];
  if (fd_ < 0 || grantpt(fd_) != 0 || unlockpt(fd_) != 0 || ptsname_r(fd_, name, sizeof name) != 0)
    throw StartError(kSystem, std::string("no pseudo-terminal: ") + std::strerror(errno));
  // The other end stays open here too: then a companion that closes it does not look like a hang-up.
  other_ = open(name, O_RDWR | O_NOCTTY);
  termios raw{};
  if (other_ < 0 || tcgetattr(other_, &raw) != 0)
    throw StartError(kSystem, std::string(name) + ": " + std::strerror(errno));
  cfmakeraw(&raw);
  tcsetattr(other_, TCSANOW, &raw);
  // A link of an earlier bench, and nothing else, is taken out of the way.
  struct stat there {};
  if (lstat(link.c_str(), &there) == 0 && !S_ISLNK(there.st_mode))
    throw StartError(kCannotCreate,
                     "--link " + link + ": exists and is no symbolic link; name a file that is not there yet");
  unlink(link.c_str());
  if (symlink(name, link.c_str()) != 0)
    throw StartError(kCannotCreate, "--link " + link + ": cannot be made: " + std::strerror(errno) +
                                        "; name a file in a folder that can be written");
}

Pty::~Pty() {
  unlink(link_.c_str());
  close(other_);
  close(fd_);
}

std::vector<std::uint8_t> Pty::read() {
  // A companion that is killed leaves its claim on the line behind: a real port drops it with the last descriptor, but
  // here one stays open, and who is not root would find the line busy for ever.
  ioctl(other_, TIOCNXCL);
  // A read from an empty terminal would wait for a kernel worker of ordinary priority (see SerialPort::read).
  int at_hand = 0;
  if (ioctl(fd_, FIONREAD, &at_hand) != 0 || at_hand <= 0) return {};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(at_hand));
  const ssize_t n = ::read(fd_, bytes.data(), bytes.size());
  bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  return bytes;
}

void Pty::write(std::span<const std::uint8_t> bytes) {
  if (!bytes.empty()) (void)!::write(fd_, bytes.data(), bytes.size());
}

}  // namespace backwash::bench
