// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/port/tcp_port.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>

namespace backwash::firmware_bridge {
namespace {

using Kind = PortError::Kind;
tl::unexpected<PortError> error(Kind kind, int number) { return tl::unexpected(PortError{kind, number}); }

bool nothing_now(int number) noexcept { return number == EAGAIN || number == EWOULDBLOCK || number == EINTR; }

// Set-points must leave at once; a few seconds of them at most may wait in the kernel; a peer that has vanished without
// closing is given up after 5 s, also while we are quiet: then the kernel asks.
bool configure(int fd) {
  constexpr int kNoDelay = 1, kSendBuffer = 8192, kGiveUp_ms = 5000, kAsk = 1, kQuiet_s = 2, kAgain_s = 1;
  return ::setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &kAsk, sizeof kAsk) == 0 &&
         ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPIDLE, &kQuiet_s, sizeof kQuiet_s) == 0 &&
         ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPINTVL, &kAgain_s, sizeof kAgain_s) == 0 &&
         ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &kNoDelay, sizeof kNoDelay) == 0 &&
         ::setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer) == 0 &&
         ::setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &kGiveUp_ms, sizeof kGiveUp_ms) == 0;
}

/// errno of a connection that was begun on a non-blocking socket; 0: it stands.
int await_connection(int fd, std::chrono::milliseconds patience) {
  pollfd waiting{fd, POLLOUT, 0};
  if (::poll(&waiting, 1, static_cast<int>(patience.count())) != 1) return ETIMEDOUT;
  int number = 0;
  socklen_t size = sizeof number;
  return ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &number, &size) == 0 ? number : errno;
}

}  // namespace

tl::expected<TcpPort, PortError> TcpPort::open(const std::string& address, std::uint16_t port,
                                               std::chrono::milliseconds patience) {
  sockaddr_in there{};
  there.sin_family = AF_INET;
  there.sin_port = htons(port);
  if (::inet_pton(AF_INET, address.c_str(), &there.sin_addr) != 1) return error(Kind::address, 0);
  FileDescriptor fd(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd.get() < 0 || !configure(fd.get())) return error(Kind::open, errno);
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&there), sizeof there) != 0) {
    const int number = errno == EINPROGRESS ? await_connection(fd.get(), patience) : errno;
    if (number != 0) return error(Kind::open, number);
  }
  return TcpPort(std::move(fd));
}

tl::expected<std::size_t, PortError> TcpPort::read(std::span<std::uint8_t> into) noexcept {
  const auto n = ::recv(fd_.get(), into.data(), into.size(), 0);
  if (n > 0) return static_cast<std::size_t>(n);
  if (n < 0 && nothing_now(errno)) return 0U;
  return error(Kind::lost, n < 0 ? errno : 0);
}

tl::expected<std::size_t, PortError> TcpPort::write(std::span<const std::uint8_t> bytes) noexcept {
  const auto n = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (n >= 0) return static_cast<std::size_t>(n);
  if (nothing_now(errno)) return 0U;
  return error(Kind::lost, errno);
}

}  // namespace backwash::firmware_bridge
