// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <list>
#include <mutex>
#include <string>

namespace backwash::ctl {

/// The connections that are open, and which of them goes when there is one too many: never one that came with the
/// token, otherwise the oldest of whoever has most. So nobody without the token keeps a STOP away by many connections.
class Connections {
 public:
  struct Open {
    int socket;
    std::string remote;
    bool proven = false, going = false;
  };
  using Place = std::list<Open>::iterator;

  explicit Connections(std::size_t most) : most_(most) {}

  /// Counts one more, and shuts another one where all places are taken. False, and not counted: none may go.
  bool room();
  /// The counted one has a thread from now on.
  Place enter(int socket, const std::string& remote);
  /// It came with the token: it stays.
  void prove(Place place);
  /// Before its socket is closed, whose number another one may get.
  void leave(Place place);
  /// It is no longer counted.
  void gone();

 private:
  std::mutex mutex_;
  std::list<Open> open_;  // the oldest first
  std::size_t most_, count_ = 0;
};

}  // namespace backwash::ctl
