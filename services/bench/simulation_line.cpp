// SPDX-License-Identifier: BSD-3-Clause
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "services/bench/controller_in_loop.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::bench {
namespace {

using firmware_bridge::FileDescriptor;

constexpr int kWait_ms = 100;

[[noreturn]] void fail(const std::string& device) {
  throw StartError(kInputOutput, "--in-loop " + device + ": " + std::strerror(errno != 0 ? errno : EINVAL) +
                                     "; give tcpin:ADDRESS:PORT, ADDRESS an IPv4 of this machine, or a serial port");
}

FileDescriptor listen_on(const std::string& device, const std::string& endpoint) {
  const auto colon = endpoint.rfind(':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  errno = 0;
  std::uint16_t port = 0;
  const char* const last = endpoint.data() + endpoint.size();
  const bool good = colon != endpoint.npos && std::from_chars(endpoint.data() + colon + 1, last, port).ptr == last &&
                    port > 0 && ::inet_pton(AF_INET, endpoint.substr(0, colon).c_str(), &address.sin_addr) == 1;
  if (!good) fail(device);
  address.sin_port = htons(port);
  FileDescriptor fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int yes = 1;
  ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || ::listen(fd.get(), 1) != 0)
    fail(device);
  return fd;
}

FileDescriptor open_serial(const std::string& path) {
  FileDescriptor fd(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios raw{};
  if (fd.get() < 0 || ::tcgetattr(fd.get(), &raw) != 0) fail(path);
  ::cfmakeraw(&raw);
  ::cfsetspeed(&raw, B921600);
  if (::tcsetattr(fd.get(), TCSANOW, &raw) != 0) fail(path);
  return fd;
}

bool readable(int fd) {
  pollfd p{fd, POLLIN, 0};
  return ::poll(&p, 1, kWait_ms) > 0;
}

}  // namespace

SimulationLine::SimulationLine(const std::string& device) {
  constexpr std::string_view kListen = "tcpin:";
  if (device.starts_with(kListen))
    listener_ = listen_on(device, device.substr(kListen.size()));
  else
    line_ = open_serial(device);
}

std::vector<std::uint8_t> SimulationLine::wait() {
  if (line_.get() < 0) {
    if (!readable(listener_.get())) return {};
    FileDescriptor taken(::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    const int yes = 1;
    ::setsockopt(taken.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    const std::lock_guard lock(mutex_);
    line_ = std::move(taken);
    return {};
  }
  if (!readable(line_.get())) return {};
  std::vector<std::uint8_t> bytes(4096);
  const auto n = ::read(line_.get(), bytes.data(), bytes.size());
  bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  if (n == 0 && listener_.get() >= 0) {
    const std::lock_guard lock(mutex_);
    line_ = FileDescriptor();
  }
  return bytes;
}

// What the controller does not take is lost, as on any line to a slower one.
void SimulationLine::write(std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  if (line_.get() >= 0) (void)!::write(line_.get(), bytes.data(), bytes.size());
}

}  // namespace backwash::bench
