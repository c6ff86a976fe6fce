// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/writers.hpp"

#include <dds/dds.h>

#include <algorithm>
#include <utility>

namespace backwash::dds {
namespace {

/// Calls `each` with what has changed in the middleware's own topic of writers. Of one that is gone only the key is
/// there.
template <typename Each>
void take(Entity publications, Each&& each) {
  void* sample = nullptr;
  dds_sample_info_t info;
  while (dds_take(publications, &sample, &info, 1, 1) == 1) {
    const auto& writer = *static_cast<const dds_builtintopic_endpoint_t*>(sample);
    Guid guid;
    std::copy_n(writer.key.v, guid.size(), guid.begin());
    each(guid, info.valid_data && info.instance_state == DDS_IST_ALIVE ? &writer : nullptr);
    dds_return_loan(publications, &sample, 1);
    sample = nullptr;
  }
}

}  // namespace

ForeignWriters::ForeignWriters(const Participant& participant, std::initializer_list<const detail::ReaderBase*> readers)
    : publications_(participant.publications()) {
  for (const auto* reader : readers) types_[reader->topic()] = reader->type();
}

std::size_t ForeignWriters::take_new() {
  const std::size_t before = seen_.size();
  take(publications_, [&](const Guid& guid, const dds_builtintopic_endpoint_t* writer) {
    const auto ours = writer ? types_.find(writer->topic_name) : types_.end();
    if (ours != types_.end() && ours->second != writer->type_name && seen_.size() < kMost) seen_.insert(guid);
  });
  return seen_.size() - before;
}

OtherWriters::OtherWriters(const Participant& participant, std::string topic, const Guid& ours)
    : topic_(std::move(topic)), ours_(ours), publications_(participant.publications()) {}

std::optional<Guid> OtherWriters::first() {
  take(publications_, [&](const Guid& guid, const dds_builtintopic_endpoint_t* writer) {
    if (!writer)
      std::erase(writers_, guid);
    else if (writer->topic_name == topic_ && guid != ours_ && writers_.size() < kMost &&
             std::ranges::find(writers_, guid) == writers_.end())
      writers_.push_back(guid);
  });
  return writers_.empty() ? std::nullopt : std::optional(writers_.front());
}

}  // namespace backwash::dds
