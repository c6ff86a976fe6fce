// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/port/udp_port.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>

namespace backwash::firmware_bridge {
namespace {

using Kind = PortError::Kind;
tl::unexpected<PortError> error(Kind kind, int number) { return tl::unexpected(PortError{kind, number}); }

// ECONNREFUSED: an earlier datagram found nobody listening. The peer may start later, so nothing is lost.
bool nothing_now(int number) noexcept {
  return number == EAGAIN || number == EWOULDBLOCK || number == EINTR || number == ECONNREFUSED || number == ENOBUFS;
}

std::optional<sockaddr_in> socket_address(const UdpPort::Endpoint& endpoint) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_port = htons(endpoint.port);
  if (::inet_pton(AF_INET, endpoint.address.c_str(), &a.sin_addr) != 1) return std::nullopt;
  return a;
}

// The first byte of a frame: MAVLink 2, MAVLink 1.
bool begins_frame(std::span<const std::uint8_t> bytes) noexcept {
  return !bytes.empty() && (bytes[0] == 0xFD || bytes[0] == 0xFE);
}

const sockaddr* generic(const sockaddr_in* a) noexcept { return reinterpret_cast<const sockaddr*>(a); }

}  // namespace

tl::expected<UdpPort, PortError> UdpPort::open(const Endpoint& local, const std::optional<Endpoint>& peer,
                                               Clock::duration patience) {
  const auto here = socket_address(local);
  if (!here) return error(Kind::address, 0);
  FileDescriptor fd(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd.get() < 0) return error(Kind::open, errno);
  if (::bind(fd.get(), generic(&*here), sizeof(*here)) != 0) return error(Kind::open, errno);
  if (peer) {
    const auto there = socket_address(*peer);
    if (!there) return error(Kind::address, 0);
    if (::connect(fd.get(), generic(&*there), sizeof(*there)) != 0) return error(Kind::open, errno);
  }
  sockaddr_in bound{};
  socklen_t size = sizeof(bound);
  if (::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&bound), &size) != 0) return error(Kind::open, errno);
  return UdpPort(std::move(fd), ntohs(bound.sin_port), peer.has_value(), patience);
}

tl::expected<std::size_t, PortError> UdpPort::read(std::span<std::uint8_t> into) noexcept {
  sockaddr_in from{};
  socklen_t size = sizeof(from);
  const auto n = ::recvfrom(fd_.get(), into.data(), into.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
  if (n < 0) {
    if (!nothing_now(errno)) return error(Kind::lost, errno);
    if (finds_peer_ && has_peer_ && Clock::now() - heard_ >= patience_) listen_to_anyone();
    return 0U;
  }
  if (finds_peer_) heard_ = Clock::now();
  const auto size_read = static_cast<std::size_t>(n);
  if (has_peer_) return size_read;
  if (!begins_frame(into.first(size_read))) return 0U;
  // Connecting makes the kernel drop everybody else's datagrams from now on.
  has_peer_ = ::connect(fd_.get(), generic(&from), sizeof(from)) == 0;
  return size_read;
}

void UdpPort::listen_to_anyone() noexcept {
  sockaddr nobody{};
  nobody.sa_family = AF_UNSPEC;
  has_peer_ = ::connect(fd_.get(), &nobody, sizeof nobody) != 0;
}

tl::expected<std::size_t, PortError> UdpPort::write(std::span<const std::uint8_t> bytes) noexcept {
  if (!has_peer_) return 0U;
  const auto n = ::send(fd_.get(), bytes.data(), bytes.size(), 0);
  if (n >= 0) return static_cast<std::size_t>(n);
  if (nothing_now(errno)) return 0U;
  return error(Kind::lost, errno);
}

}  // namespace backwash::firmware_bridge
