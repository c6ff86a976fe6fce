// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "idl/topics.hpp"

struct dds_topic_descriptor;

/// Thin ownership around Cyclone DDS's C binding: what the daemon, the ground station and the bench share. Only the
/// sources here see the middleware's own header.
namespace backwash::dds {

/// A call into the middleware failed; the message names the call, the topic and the reason. Thrown at start-up only.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What this process's own permissions of DDS Security do not let it do.
struct NotPermitted : Error {
  using Error::Error;
};

using Entity = std::int32_t;

constexpr double kLease_s = 2;

/// How a participant receives.
struct Receiving {
  /// SCHED_FIFO priority of the threads that receive, so that a busy machine does not delay samples; the caller must
  /// have the right. 0: ordinary.
  int priority = 0;
  std::size_t max_sample_bytes = 64u << 20;  ///< larger samples are dropped by the middleware, either way
  /// Sockets and threads that no other participant of this process uses: what floods one never waits before the other.
  /// One participant of a process and domain may be the one that is not apart.
  bool apart = false;
  /// Whole names of all topics that it will ever have (topics.hpp): of endpoints of others, as many as a large system
  /// has, the middleware never hears. None: it may have any, and hears of all, up to the door's count (door.hpp).
  std::vector<std::string> topics = {};
};

/// One participant in a domain. Topic names get the prefix `rt` and the name space: rt/backwash/…
class Participant {
 public:
  /// `interface`: network interface by name; with it, priority and size, ignored if the environment's CYCLONEDDS_URI
  /// already configures the middleware (whose Domain Id then has to be "any"). `credentials`: folder of DDS Security
  /// that security::read_credentials found good; empty: without. Throws Error.
  Participant(std::uint32_t domain, const std::string& interface, const Receiving& receiving = {},
              const std::string& credentials = {});
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  Entity handle() const noexcept { return participant_; }
  /// Reader of the middleware's own topic of all writers in the domain, for writers.hpp. Throws Error.
  Entity publications() const;

 private:
  Entity domain_ = 0, participant_ = 0;
};

/// Identity of one writer: its process draws it anew at each start.
using Guid = std::array<std::uint8_t, 16>;

/// Who all writers of one participant are: its own identity, which no writer has.
inline Guid participant_of(Guid writer) noexcept {
  writer[12] = writer[13] = writer[14] = writer[15] = 0;
  return writer;
}

/// As the tools of DDS print it: 8 hexadecimal digits four times.
std::string text(const Guid& guid);

class WaitSet;

namespace detail {

class ReaderBase {
 public:
  ReaderBase(const Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
             Delivery delivery);
  Entity handle() const noexcept { return reader_; }
  const std::string& topic() const noexcept { return topic_; }
  const std::string& type() const noexcept { return type_; }
  /// Writers that are gone since the last call: deleted, or silent after a crash, for the lease of their liveliness if
  /// they have one (kLease_s), else for that of their process (10 s). Cheap while none comes or goes. Call from the
  /// thread that takes. Of several whose liveliness ends at once one is told now, the others after the longer lease.
  std::vector<Guid> departed();
  /// Writers that are matched, as of the last departed(), and those of samples since. Call from the thread that takes.
  std::vector<Guid> known() const;
  /// Is replaced by one that begins anew, in the wait set too: of a topic of Delivery::state it gets from each writer
  /// what that said last, even if it was taken already. Call from the thread that takes.
  void renew(WaitSet& waitset);

 protected:
  /// Calls `each` with every valid sample received since the last call and its writer; returns how many.
  std::size_t take(const std::function<void(const void*, const Guid&)>& each);

 private:
  const Guid& writer(std::uint64_t publication);
  std::string topic_, type_;
  Entity reader_;
  std::map<std::uint64_t, Guid> writers_;  // by the middleware's handle
};

class WriterBase {
 public:
  WriterBase(const Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
             Delivery delivery);
  /// Readers matched now.
  int matched() const;
  Guid guid() const;

 protected:
  /// False if the middleware refused the sample.
  bool write(const void* sample);

 private:
  Entity writer_;
};

}  // namespace detail

/// Typed reader; `type` is the descriptor idlc generated for T.
template <typename T>
class Reader : public detail::ReaderBase {
 public:
  using ReaderBase::ReaderBase;
  /// `each` takes a sample, or a sample and its writer's Guid.
  template <typename Each>
  std::size_t take(Each&& each) {
    return ReaderBase::take([&](const void* sample, const Guid& writer) {
      if constexpr (std::is_invocable_v<Each, const T&, const Guid&>)
        each(*static_cast<const T*>(sample), writer);
      else
        each(*static_cast<const T*>(sample));
    });
  }
};

/// Typed writer; strings and sequences in a sample stay the caller's.
template <typename T>
class Writer : public detail::WriterBase {
 public:
  using WriterBase::WriterBase;
  bool write(const T& sample) { return WriterBase::write(&sample); }
};

/// Counts samples that the middleware drops because their bytes are none of their topic's type (docs/faults.md row 27).
/// It says so nowhere but in its log, a line for each: while this lives it takes those lines out of that log, which is
/// one for the whole process. Others go to `other`, at most one a second: what a hostile peer provokes is one line for
/// each packet, written by the threads that receive.
class Malformed {
 public:
  /// Each topic by its whole name, with the counter of its samples, which the middleware's threads add to.
  using Counters = std::vector<std::pair<std::string, std::atomic<std::uint64_t>*>>;
  /// Called by the middleware's threads with a line, and how many were left out since the last.
  using Other = std::function<void(std::string_view line, std::int64_t left_out)>;
  Malformed(Counters counters, Other other);
  ~Malformed();
  Malformed(const Malformed&) = delete;
  Malformed& operator=(const Malformed&) = delete;
  /// Of a log line: true if it was counted.
  bool take(std::string_view line) noexcept;
  /// Hands a line that was not counted on, or leaves it out.
  void pass_on(std::string_view line);

 private:
  Counters counters_;
  Other other_;
  std::atomic<std::int64_t> next_ns_{0}, left_out_{0};
};

/// Sleeps until one of its readers has data.
class WaitSet {
 public:
  explicit WaitSet(const Participant& participant);
  void add(const detail::ReaderBase& reader);
  /// wait() returns as well when a writer of it has come or gone, until departed() is asked.
  void add_departures(const detail::ReaderBase& reader);
  /// Returns when data has arrived or after `timeout_s`.
  void wait(double timeout_s);

 private:
  Entity participant_, waitset_;
};

/// View of a std::string as the char* that generated C types hold; never written through.
inline char* c_string(const std::string& s) { return const_cast<char*>(s.c_str()); }

}  // namespace backwash::dds
