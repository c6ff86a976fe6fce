// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/receive.hpp"

#include <dds/dds.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <random>
#include <span>

#include "services/dds/guard/fragments.hpp"
#include "services/dds/guard/loopback.hpp"
#include "services/dds/guard/packet_filter.hpp"
#include "services/dds/guard/strangers.hpp"

namespace backwash::dds {
namespace {

std::atomic<bool> secured{false};

std::int64_t now_ns() noexcept {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Door& door() noexcept {
  static Door one([] {
    std::random_device random;
    return std::uint64_t{random()} << 32 | random();
  }());
  return one;
}

Door::Prefix prefix(const std::uint8_t* guid) noexcept { return Door::Prefix(guid, 12); }

}  // namespace

void expect_participant(bool with_credentials, std::span<const std::string> topics) {
  secured = with_credentials;
  door().wants(topics);
}

bool expected(std::string_view topic) noexcept { return door().wants(topic); }

void note_participant(Entity participant) {
  dds_guid_t guid;
  if (dds_get_guid(participant, &guid) == DDS_RETCODE_OK) door().ours(prefix(guid.v), now_ns());
}

void forget_participant(Entity participant) {
  dds_guid_t guid;
  if (dds_get_guid(participant, &guid) == DDS_RETCODE_OK) door().gone(prefix(guid.v));
}

void note_match(const Guid& guid) noexcept { door().met(prefix(guid.data()), now_ns()); }

dds_listener* match_listener() {
  dds_listener_t* const listener = dds_create_listener(nullptr);
  dds_lset_publication_matched(listener, [](Entity of, dds_publication_matched_status_t status, void*) {
    dds_builtintopic_endpoint_t* const reader = dds_get_matched_subscription_data(of, status.last_subscription_handle);
    if (!reader) return;  // of this process, or gone
    door().met(prefix(reader->participant_key.v), now_ns());
    dds_builtintopic_free_endpoint(reader);
  });
  return listener;
}

}  // namespace backwash::dds

// Takes the C library's place in every program that links this: the middleware receives by it and by nothing else.
extern "C" ssize_t recvmsg(int socket, msghdr* message, int flags) {
  using namespace backwash::dds;
  const ssize_t received = syscall(SYS_recvmsg, socket, message, flags);
  if (received <= 0 || message->msg_iovlen != 1 || (flags & MSG_PEEK)) return received;
  const std::span datagram(static_cast<std::uint8_t*>(message->msg_iov[0].iov_base),
                           std::min(static_cast<std::size_t>(received), message->msg_iov[0].iov_len));
  const std::span heard = datagram.first(heard_of(*message, datagram));
  const Heard how{source_of(*message), now_ns(), secured};
  note_fragments(heard, how.now_ns);
  return static_cast<ssize_t>(let_in(door(), heard.first(filter_packet(heard)), how));
}
