// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

struct dds_topic_descriptor;

/// Thin ownership around Cyclone DDS's C binding: what the daemon, the ground station and the bench share. Only dds.cpp
/// sees the middleware's own header.
namespace backwash::dds {

/// A call into the middleware failed; the message names the call, the topic and the reason. Thrown at start-up only.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Entity = std::int32_t;

/// Delivery of a topic.
enum class Delivery {
  latest,    ///< best effort, keep last 1: odometry, status
  scans,     ///< best effort, keep last 8: point clouds, as ROS 2 drivers send sensor data
  reliable,  ///< reliable, keep last 64: commands and acknowledgements
  state,     ///< reliable, transient local, keep last 1: late joiners get the newest: map, trajectory, tube
};

/// One participant in a domain. Topic names get the prefix `rt` and the name space: rt/backwash/…
class Participant {
 public:
  /// `interface`: network interface by name; ignored if the environment's CYCLONEDDS_URI already configures the
  /// middleware. `priority` > 0: SCHED_FIFO priority of the threads that receive, so that a busy machine does not delay
  /// samples; the caller must have the right. `max_sample_bytes`: larger samples are dropped by the middleware. Throws
  /// Error.
  Participant(std::uint32_t domain, const std::string& interface, int priority = 0,
              std::size_t max_sample_bytes = 64u << 20);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  Entity handle() const noexcept { return participant_; }

 private:
  Entity domain_ = 0, participant_ = 0;
};

namespace detail {

class ReaderBase {
 public:
  ReaderBase(const Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
             Delivery delivery);
  Entity handle() const noexcept { return reader_; }

 protected:
  /// Calls `each` with every valid sample received since the last call; returns how many.
  std::size_t take(const std::function<void(const void*)>& each);

 private:
  Entity reader_;
};

class WriterBase {
 public:
  WriterBase(const Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
             Delivery delivery);
  /// Readers matched now.
  int matched() const;

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
  template <typename Each>
  std::size_t take(Each&& each) {
    return ReaderBase::take([&](const void* sample) { each(*static_cast<const T*>(sample)); });
  }
};

/// Typed writer; strings and sequences in a sample stay the caller's.
template <typename T>
class Writer : public detail::WriterBase {
 public:
  using WriterBase::WriterBase;
  bool write(const T& sample) { return WriterBase::write(&sample); }
};

/// Counts the writers of other participants that use the name of one of this participant's topics with another type:
/// the middleware does not connect them and tells nobody (faults.md row 27).
class ForeignWriters {
 public:
  explicit ForeignWriters(const Participant& participant);
  /// All that were seen so far. Call from one thread.
  std::size_t count();

 private:
  Entity participant_, publications_;
  std::set<std::array<std::uint8_t, 16>> seen_;
};

/// Counts samples that the middleware drops because their bytes are none of their topic's type (faults.md row 27). It
/// says so nowhere but in its log, a line for each: while this lives it takes those lines out of that log, which is one
/// for the whole process. Other lines are given to `say`, by the middleware's own threads.
class Malformed {
 public:
  /// Each topic by its whole name, with the counter of its samples, which the middleware's threads add to.
  using Counters = std::vector<std::pair<std::string, std::atomic<std::uint64_t>*>>;
  using Say = void (*)(std::string_view line);
  Malformed(Counters counters, Say say);
  ~Malformed();
  Malformed(const Malformed&) = delete;
  Malformed& operator=(const Malformed&) = delete;
  /// Of a log line: true if it was counted.
  bool take(std::string_view line) noexcept;

 private:
  Counters counters_;
  Say say_;
};

/// Sleeps until one of its readers has data.
class WaitSet {
 public:
  explicit WaitSet(const Participant& participant);
  void add(const detail::ReaderBase& reader);
  /// Returns when data has arrived or after `timeout_s`.
  void wait(double timeout_s);

 private:
  Entity participant_, waitset_;
};

/// View of a std::string as the char* that generated C types hold; never written through.
inline char* c_string(const std::string& s) { return const_cast<char*>(s.c_str()); }

}  // namespace backwash::dds
