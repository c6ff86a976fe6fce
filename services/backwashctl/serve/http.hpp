// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <variant>

#include "services/backwashctl/serve/gate.hpp"
#include "services/backwashctl/serve/porch.hpp"

/// HTTP for one page. cpp-httplib is seen by this unit's source alone.
namespace backwash::ctl {

struct Asked {
  std::map<std::string, std::string> parameters;  ///< after the ?
  std::string body, remote;                       ///< remote: numeric address
};

/// Server-sent events of one stream: what is to be sent next, waited for at most 0.1 s; empty: nothing yet. Copies
/// share what they hold, and the last one is destroyed when the stream ends, whoever ends it.
using NextEvents = std::function<std::string()>;

/// What there is, by path. Functions are called by several threads at once.
struct Site {
  std::map<std::string, Reply> files;
  std::map<std::string, std::function<Reply(const Asked&)>> reads;  ///< GET
  std::map<std::string, std::function<Reply(const Asked&)>> posts;  ///< with the token
  std::map<std::string, std::function<std::variant<Reply, NextEvents>(const Asked&)>> streams;
  std::function<bool(const std::string& page)> knows;  ///< whether a page of that name was admitted
};

struct Door {
  std::string address;  ///< numeric IPv4 to listen on
  int port = 0;         ///< 0: any that is free
  std::string token;
};

/// Each connection is one request of at most kRequestBytes within kRequest_s, or a stream. It waits in the Porch until
/// its head is whole. kKnown of those that show a key (the token, or the name of a page that was admitted) are answered
/// at a time, and kStrangers of the others: for a further one their oldest is closed, and it gets 503 while kLeaving
/// are still closing. A client that takes no bytes for kWrite_s is dropped.
constexpr std::size_t kRequestBytes = Porch::kHeadBytes, kBodyBytes = 4 << 10, kKnown = 32, kStrangers = 24,
                      kLeaving = 8;
constexpr double kRequest_s = 3, kWrite_s = 1;

/// Calls `listening` with the port, then serves until `stopped`. Throws StartError 71 where it cannot listen.
void serve_http(const Door& door, const Site& site, const std::function<void(int port)>& listening,
                const std::function<bool()>& stopped);

}  // namespace backwash::ctl
