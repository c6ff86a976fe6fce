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

bool is_reliable(const dds_qos_t* qos) {
  dds_reliability_kind_t kind = DDS_RELIABILITY_BEST_EFFORT;
  dds_qget_reliability(qos, &kind, nullptr);
  return kind == DDS_RELIABILITY_RELIABLE;
}

bool is_kept(const dds_qos_t* qos) {
  dds_durability_kind_t kind = DDS_DURABILITY_VOLATILE;
  dds_qget_durability(qos, &kind);
  return kind != DDS_DURABILITY_VOLATILE;
}

}  // namespace

ForeignWriters::ForeignWriters(const Participant& participant, const std::vector<const detail::ReaderBase*>& readers)
    : publications_(participant.publications()) {
  for (const auto* reader : readers) {
    dds_qos_t* qos = dds_create_qos();
    dds_get_qos(reader->handle(), qos);
    wanted_[reader->topic()] = {reader->type(), is_reliable(qos), is_kept(qos)};
    dds_delete_qos(qos);
  }
}

ForeignWriters::News ForeignWriters::take_new() {
  News news;
  take(publications_, [&](const Guid& guid, const dds_builtintopic_endpoint_t* writer) {
    const auto ours = writer ? wanted_.find(writer->topic_name) : wanted_.end();
    if (ours == wanted_.end() || seen_.size() >= kMost) return;
    const Wanted& wanted = ours->second;
    const std::string why = wanted.type != writer->type_name
                                ? "has the type " + std::string(writer->type_name) + ", expected " + wanted.type
                            : wanted.reliable && !is_reliable(writer->qos) ? "is best effort, expected reliable"
                            : wanted.kept && !is_kept(writer->qos)         ? "is volatile, expected transient local"
                                                                           : "";
    if (why.empty() || !seen_.insert(guid).second) return;
    if (news.count++ == 0) news.first = "writer " + text(guid) + " of " + ours->first + " " + why;
  });
  return news;
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
