// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/porch.hpp"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>

#include "services/command_line/exit_code.hpp"

namespace backwash::ctl {
namespace {

constexpr int kAtOnce = 64;  // after so many the others of a round have their turn

}  // namespace

Porch::Porch(int listener) : listener_(listener), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  epoll_event event{.events = EPOLLIN, .data = {.u64 = 0}};
  if (fcntl(listener_, F_SETFL, fcntl(listener_, F_GETFL) | O_NONBLOCK) != 0 || listen(listener_, SOMAXCONN) != 0 ||
      epoll_ctl(epoll_, EPOLL_CTL_ADD, listener_, &event) != 0)
    throw StartError(kSystem, "serve: this system waits for no connections");
}

Porch::~Porch() {
  while (!young_.empty()) end(young_.begin());
  close(epoll_);
}

void Porch::step(int milliseconds, const Take& take) {
  std::array<epoll_event, kAtOnce> ready;
  const int count = epoll_wait(epoll_, ready.data(), kAtOnce, milliseconds);
  for (int n = 0; n < count; ++n)
    if (const auto young = young_.find(ready[static_cast<std::size_t>(n)].data.u64); young != young_.end())
      look(young, take);
  let_in(take);
  while (!young_.empty() && young_.begin()->second.until <= Clock::now()) end(young_.begin());
}

void Porch::let_in(const Take& take) {
  for (int n = 0; n < kAtOnce; ++n) {
    const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const bool none_left = socket < 0 && (errno == EMFILE || errno == ENFILE);
    if ((none_left || young_.size() >= kYoung) && !young_.empty()) end(young_.begin());
    if (socket < 0) return;
    const auto young = young_.emplace(++last_, Young{socket, Clock::now() + kHead}).first;
    if (look(young, take)) continue;
    // Edges: what is not a whole head yet is looked at again once more has come.
    epoll_event event{.events = EPOLLIN | EPOLLET, .data = {.u64 = last_}};
    if (epoll_ctl(epoll_, EPOLL_CTL_ADD, socket, &event) != 0) end(young);
  }
}

/// Whether it is young no more.
bool Porch::look(Entry young, const Take& take) {
  const int socket = young->second.socket;
  const auto size = recv(socket, seen_.data(), seen_.size(), MSG_PEEK | MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return false;
  const std::string_view seen(seen_.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  if (seen.find("\r\n\r\n") != seen.npos) {
    epoll_ctl(epoll_, EPOLL_CTL_DEL, socket, nullptr);
    young_.erase(young);
    take(socket, seen);
    return true;
  }
  const bool over = seen.empty() || seen.size() == kHeadBytes;
  if (over) end(young);
  return over;
}

void Porch::end(Entry young) {
  close(young->second.socket);
  young_.erase(young);
}

bool shows_key(std::string_view head, const std::function<bool(std::string_view)>& is_key) {
  const auto digit = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
  for (auto begin = head.begin(); begin != head.end();) {
    begin = std::find_if(begin, head.end(), digit);
    const auto end = std::find_if_not(begin, head.end(), digit);
    if (end - begin == 32 && is_key({begin, end})) return true;
    begin = end;
  }
  return false;
}

}  // namespace backwash::ctl
