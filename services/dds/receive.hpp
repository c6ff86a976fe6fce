// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "services/dds/dds.hpp"

struct dds_listener;

/// The one way by which datagrams reach the middleware: recvmsg(), in place of the C library's in every program that
/// links this. Whom they make known there (door.hpp), what they must be (packet_filter.hpp), whose they are
/// (loopback.hpp), and which parts of a large sample have come (fragments.hpp).
namespace backwash::dds {

/// A participant of this process is about to be made, with credentials of DDS Security or without: from now on all are;
/// and with no other topics than these (Door::wants).
void expect_participant(bool secured, std::span<const std::string> topics);
/// Whether that is one of a participant that was expected.
bool expected(std::string_view topic) noexcept;
/// It was made; it will be no more.
void note_participant(Entity participant);
void forget_participant(Entity participant);

/// The middleware has connected a reader or writer of ours with `guid`: no stranger any more. Not from the middleware's
/// receiving threads.
void note_match(const Guid& guid) noexcept;
/// For a writer of ours: nor is whoever reads its topic. The caller deletes it.
dds_listener* match_listener();

}  // namespace backwash::dds
