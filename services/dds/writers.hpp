// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "services/dds/dds.hpp"

/// Who else writes: what the middleware knows of the writers of other participants.
namespace backwash::dds {

/// Counts the writers of other participants that use the topic of one of these readers with another type, or offer less
/// than it asks: the middleware does not connect them and tells nobody (docs/faults.md row 27).
class ForeignWriters {
 public:
  struct News {
    std::size_t count = 0;
    std::string first;  ///< of them: topic, writer, what it offers and what was expected; text of others in it
  };
  ForeignWriters(const Participant& participant, const std::vector<const detail::ReaderBase*>& readers);
  /// Who came since the last call; after kMost of them no more are counted. Call from one thread.
  News take_new();

 private:
  struct Wanted {
    std::string type;
    bool reliable, kept;
  };
  static constexpr std::size_t kMost = 1000;  // their identities are kept
  Entity publications_;
  std::map<std::string, Wanted> wanted_;  // by topic
  std::set<Guid> seen_;
};

/// The writers that other participants have on one topic now. Call from one thread.
class OtherWriters {
 public:
  /// `ours`: a writer of our own, which is none of them.
  OtherWriters(const Participant& participant, std::string topic, const Guid& ours);
  /// The one known longest; nothing if there is none. Cheap while none comes or goes.
  std::optional<Guid> first();

 private:
  static constexpr std::size_t kMost = 1000;  // their identities are kept
  std::string topic_;
  Guid ours_;
  Entity publications_;
  std::vector<Guid> writers_;
};

}  // namespace backwash::dds
