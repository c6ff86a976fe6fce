// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/service_manager.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace backwash::daemon {
namespace {

using firmware_bridge::FileDescriptor;

/// A datagram socket connected to `path`; "@…" is an abstract name. Closed if that is nobody's.
FileDescriptor connected(std::string_view path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() < 2 || path.size() >= sizeof address.sun_path) return FileDescriptor();
  std::memcpy(address.sun_path, path.data(), path.size());
  if (path.front() == '@') address.sun_path[0] = '\0';
  FileDescriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  if (socket.get() < 0 || ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), size) != 0)
    return FileDescriptor();
  return socket;
}

/// systemd.exec(5): DEVICE:INODE of the stream that was connected to the journal.
bool is_journal(int fd) {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat status {};
  if (!stream || ::fstat(fd, &status) != 0) return false;
  return std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino) == stream;
}

bool send(int fd, std::string_view message) noexcept {
  return fd >= 0 && ::send(fd, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0;
}

}  // namespace

ServiceManager ServiceManager::of_environment(int log_fd) {
  ServiceManager manager;
  if (const char* path = std::getenv("NOTIFY_SOCKET")) manager.manager_ = connected(path);
  if (is_journal(log_fd)) manager.journal_ = connected("/run/systemd/journal/socket");
  return manager;
}

void ServiceManager::notify(std::string_view message) const noexcept { send(manager_.get(), message); }

bool ServiceManager::transition(std::string_view mode, std::string_view reason) const {
  const std::string text = std::string(mode) + ": " + std::string(reason);
  notify("STATUS=" + text);
  return send(journal_.get(), "MESSAGE=" + text + "\nPRIORITY=5\nSYSLOG_IDENTIFIER=backwashd\nBACKWASH_MODE=" +
                                  std::string(mode) + "\nBACKWASH_REASON=" + std::string(reason) + "\n");
}

}  // namespace backwash::daemon
