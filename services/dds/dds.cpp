// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/dds.hpp"

#include <dds/dds.h>
#include <dds/ddsrt/log.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

namespace backwash::dds {
namespace {

constexpr int kTakeAtOnce = 64;

Entity checked(dds_return_t code, const std::string& what) {
  if (code < 0) throw Error("DDS: " + what + ": " + dds_strretcode(-code));
  return code;
}

/// Scheduling of the middleware's receiving threads.
std::string threads(int priority) {
  if (priority == 0) return "";
  std::string xml = "<Threads>";
  for (const char* name : {"recv", "dq.user", "dq.builtins", "tev"})
    xml += std::string("<Thread name=\"") + name + "\"><Scheduling><Class>Realtime</Class><Priority>" +
           std::to_string(priority) + "</Priority></Scheduling></Thread>";
  return xml + "</Threads>";
}

std::string configuration(const std::string& interface, int priority, std::size_t max_sample_bytes) {
  // The loopback interface has no multicast: participants find each other by asking the first thirty ports in turn.
  const bool loopback = interface == "lo";
  return "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"" + interface +
         "\"/></Interfaces>" + (loopback ? "<AllowMulticast>false</AllowMulticast>" : "") + "</General>" +
         (loopback ? "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30"
                     "</MaxAutoParticipantIndex><Peers><Peer address=\"localhost\"/></Peers></Discovery>"
                   : "") +
         threads(priority) + "<Internal><MaxSampleSize>" + std::to_string(max_sample_bytes) + "B</MaxSampleSize>" +
         // One receiving thread: the others' scheduling cannot be configured.
         (priority > 0 ? "<MultipleReceiveThreads>false</MultipleReceiveThreads>" : "") +
         "</Internal></Domain></CycloneDDS>";
}

// The topic and its delivery; the caller owns both through `participant` and dds_delete_qos.
Entity make_topic(Entity participant, const dds_topic_descriptor& type, const std::string& name) {
  return checked(dds_create_topic(participant, &type, name.c_str(), nullptr, nullptr), "topic " + name);
}

dds_qos_t* make_qos(Delivery delivery) {
  dds_qos_t* qos = dds_create_qos();
  const bool best_effort = delivery == Delivery::latest || delivery == Delivery::scans;
  dds_qset_reliability(qos, best_effort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST,
                   delivery == Delivery::reliable ? 64
                   : delivery == Delivery::scans  ? 8
                                                  : 1);
  dds_qset_durability(qos, delivery == Delivery::state ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  return qos;
}

}  // namespace

Participant::Participant(std::uint32_t domain, const std::string& interface, int priority,
                         std::size_t max_sample_bytes) {
  if (!std::getenv("CYCLONEDDS_URI"))
    domain_ = checked(dds_create_domain(domain, configuration(interface, priority, max_sample_bytes).c_str()),
                      "domain " + std::to_string(domain) + " on interface " + interface);
  participant_ = checked(dds_create_participant(domain, nullptr, nullptr),
                         "participant in domain " + std::to_string(domain) + " on interface " + interface);
}

Participant::~Participant() {
  dds_delete(participant_);
  if (domain_ > 0) dds_delete(domain_);
}

namespace detail {

ReaderBase::ReaderBase(const Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
                       Delivery delivery) {
  const Entity handle = make_topic(participant.handle(), type, topic);
  dds_qos_t* qos = make_qos(delivery);
  const dds_return_t reader = dds_create_reader(participant.handle(), handle, qos, nullptr);
  dds_delete_qos(qos);
  reader_ = checked(reader, "reader of " + topic);
}

std::size_t ReaderBase::take(const std::function<void(const void*)>& each) {
  std::array<void*, kTakeAtOnce> samples{};
  std::array<dds_sample_info_t, kTakeAtOnce> infos;
  std::size_t taken = 0;
  for (;;) {
    samples[0] = nullptr;  // asks the middleware to lend its own memory
    const dds_return_t count = dds_take(reader_, samples.data(), infos.data(), kTakeAtOnce, kTakeAtOnce);
    if (count <= 0) return taken;
    for (dds_return_t i = 0; i < count; ++i) {
      if (!infos[static_cast<std::size_t>(i)].valid_data) continue;
      each(samples[static_cast<std::size_t>(i)]);
      ++taken;
    }
    dds_return_loan(reader_, samples.data(), count);
  }
}

WriterBase::WriterBase(const Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
                       Delivery delivery) {
  const Entity handle = make_topic(participant.handle(), type, topic);
  dds_qos_t* qos = make_qos(delivery);
  const dds_return_t writer = dds_create_writer(participant.handle(), handle, qos, nullptr);
  dds_delete_qos(qos);
  writer_ = checked(writer, "writer of " + topic);
}

int WriterBase::matched() const {
  dds_publication_matched_status_t status;
  return dds_get_publication_matched_status(writer_, &status) == DDS_RETCODE_OK ? static_cast<int>(status.current_count)
                                                                                : 0;
}

bool WriterBase::write(const void* sample) { return dds_write(writer_, sample) == DDS_RETCODE_OK; }

}  // namespace detail

ForeignWriters::ForeignWriters(const Participant& participant)
    : participant_(participant.handle()),
      publications_(
          checked(dds_create_reader(participant.handle(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
                  "reader of the participants' writers")) {}

std::size_t ForeignWriters::count() {
  void* sample = nullptr;
  dds_sample_info_t info;
  while (dds_take(publications_, &sample, &info, 1, 1) == 1) {
    if (info.valid_data) {
      const auto& writer = *static_cast<const dds_builtintopic_endpoint_t*>(sample);
      const Entity ours = dds_find_topic(DDS_FIND_SCOPE_PARTICIPANT, participant_, writer.topic_name, nullptr, 0);
      std::array<char, 256> type{};
      if (ours > 0 && dds_get_type_name(ours, type.data(), type.size()) > 0 &&
          std::string_view(type.data()) != writer.type_name) {
        std::array<std::uint8_t, 16> key{};
        std::copy_n(writer.key.v, key.size(), key.begin());
        seen_.insert(key);
      }
      if (ours > 0) dds_delete(ours);
    }
    dds_return_loan(publications_, &sample, 1);
    sample = nullptr;
  }
  return seen_.size();
}

Malformed::Malformed(Counters counters, Say say) : counters_(std::move(counters)), say_(say) {
  dds_set_log_sink(
      [](void* self, const dds_log_data_t* data) {
        auto& malformed = *static_cast<Malformed*>(self);
        const std::string_view line(data->message, data->size);
        if (!malformed.take(line)) malformed.say_(line);
      },
      this);
}

Malformed::~Malformed() { dds_set_log_sink(nullptr, nullptr); }

bool Malformed::take(std::string_view line) noexcept {
  constexpr std::string_view kBefore = ": deserialization ";
  const auto at = line.find(kBefore);
  if (at == line.npos || line.find(" failed") == line.npos) return false;
  const std::string_view what = line.substr(at + kBefore.size());
  for (const auto& [topic, counter] : counters_) {
    if (!what.starts_with(topic) || !what.substr(topic.size()).starts_with('/')) continue;
    ++*counter;
    return true;
  }
  return false;
}

WaitSet::WaitSet(const Participant& participant)
    : participant_(participant.handle()), waitset_(checked(dds_create_waitset(participant.handle()), "wait set")) {}

void WaitSet::add(const detail::ReaderBase& reader) {
  const Entity condition = checked(dds_create_readcondition(reader.handle(), DDS_ANY_STATE), "read condition");
  checked(dds_waitset_attach(waitset_, condition, condition), "wait set");
}

void WaitSet::wait(double timeout_s) {
  dds_waitset_wait(waitset_, nullptr, 0, static_cast<dds_duration_t>(timeout_s * 1e9));
}

}  // namespace backwash::dds
