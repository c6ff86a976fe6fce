// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/connections.hpp"

#include <sys/socket.h>

#include <map>

namespace backwash::ctl {

bool Connections::room() {
  const std::lock_guard lock(mutex_);
  if (count_ >= most_) {
    std::map<std::string, std::size_t> of;
    for (const Open& one : open_)
      if (!one.proven && !one.going) ++of[one.remote];
    Open* leaves = nullptr;
    for (Open& one : open_)
      if (!one.proven && !one.going && (!leaves || of[one.remote] > of[leaves->remote])) leaves = &one;
    if (!leaves) return false;
    leaves->going = true;
    shutdown(leaves->socket, SHUT_RDWR);
  }
  ++count_;
  return true;
}

Connections::Place Connections::enter(int socket, const std::string& remote) {
  const std::lock_guard lock(mutex_);
  return open_.insert(open_.end(), Open{socket, remote});
}

void Connections::prove(Place place) {
  const std::lock_guard lock(mutex_);
  place->proven = true;
}

void Connections::leave(Place place) {
  const std::lock_guard lock(mutex_);
  open_.erase(place);
}

void Connections::gone() {
  const std::lock_guard lock(mutex_);
  --count_;
}

}  // namespace backwash::ctl
