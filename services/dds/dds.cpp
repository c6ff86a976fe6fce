// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/dds.hpp"

#include <dds/dds.h>
#include <dds/ddsrt/log.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "services/dds/guard/loopback.hpp"
#include "services/dds/guard/secured.hpp"
#include "services/dds/quality.hpp"
#include "services/dds/receive.hpp"

namespace backwash::dds {
namespace {

constexpr int kTakeAtOnce = 64;
// Asked of the kernel, which gives up to net.core.rmem_max. A cloud of 4.8 MB is 3,600 datagrams in 8 MB of the
// kernel's memory, and a best-effort sample of which one is lost never arrives.
constexpr const char* kReceiveBuffer = "32MiB";

Entity checked(dds_return_t code, const std::string& what) {
  if (code == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY)
    throw NotPermitted("DDS: " + what +
                       ": the permissions of its credentials do not allow it; backwash keys add makes others");
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

std::string configuration(const std::string& interface, const Receiving& receiving) {
  // The loopback interface is not marked as one with multicast, but has it: what others with their own settings listen
  // to. Those without it are found by asking the first thirty ports in turn. Multicast is for discovery alone: data
  // sent to a group would reach the sockets of every participant.
  const bool loopback = interface == "lo";
  return "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"" + interface +
         (loopback ? "\" multicast=\"true" : "") + "\"/></Interfaces><AllowMulticast>spdp</AllowMulticast></General>" +
         // With an index each start has a port that an earlier one had: a new one each time would be a new address to
         // whoever counts them (door.hpp).
         "<Discovery><ParticipantIndex>auto</ParticipantIndex>" +
         (loopback ? "<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex><Peers><Peer address=\"localhost\"/></Peers>"
                   : "<MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>") +
         "</Discovery>" + threads(receiving.priority) + "<Internal><MaxSampleSize>" +
         std::to_string(receiving.max_sample_bytes) + "B</MaxSampleSize><SocketReceiveBufferSize max=\"" +
         kReceiveBuffer + "\"/>" +
         // One receiving thread: the others' scheduling cannot be configured.
         (receiving.priority > 0 ? "<MultipleReceiveThreads>false</MultipleReceiveThreads>" : "") +
         "</Internal></Domain></CycloneDDS>";
}

// The middleware shares sockets and threads within a domain object, of which a process has one for each number. Another
// number, which on the wire is the same domain, gives a participant its own. It is one that has ports, because DDS
// Security asks for it and knows no others.
constexpr std::uint32_t kDomains = 231;
std::uint32_t apart_from(std::uint32_t domain) { return (domain + kDomains / 2) % kDomains; }

std::string on_the_wire(std::uint32_t domain) {
  return ",<CycloneDDS><Domain Id=\"any\"><Discovery><ExternalDomainId>" + std::to_string(domain) +
         "</ExternalDomainId></Discovery></Domain></CycloneDDS>";
}

// The topic and its delivery; the caller owns both through `participant` and dds_delete_qos.
Entity make_topic(Entity participant, const dds_topic_descriptor& type, const std::string& name) {
  if (!expected(name)) throw Error("DDS: topic " + name + " was not named when its participant was made");
  return checked(dds_create_topic(participant, &type, name.c_str(), nullptr, nullptr), "topic " + name);
}

}  // namespace

Participant::Participant(std::uint32_t domain, const std::string& interface, const Receiving& receiving,
                         const std::string& credentials) {
  const char* environment = std::getenv("CYCLONEDDS_URI");
  const std::string where = "domain " + std::to_string(domain) + " on interface " + interface;
  const std::uint32_t number = receiving.apart ? apart_from(domain) : domain;
  const std::string chosen = environment ? environment : configuration(interface, receiving);
  if (!environment && interface == "lo") loopback_alone();
  if (receiving.apart || !environment)
    domain_ =
        checked(dds_create_domain(number, (chosen + (receiving.apart ? on_the_wire(domain) : "")).c_str()), where);
  expect_participant(!credentials.empty(), receiving.topics);
  dds_qos_t* const qos = secured(credentials);
  const dds_return_t participant = dds_create_participant(number, qos, nullptr);
  dds_delete_qos(qos);
  participant_ = checked(participant, "participant in " + where);
  note_participant(participant_);
}

Participant::~Participant() {
  forget_participant(participant_);
  dds_delete(participant_);
  if (domain_ > 0) dds_delete(domain_);
}

Entity Participant::publications() const {
  return checked(dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
                 "reader of the participants' writers");
}

std::string text(const Guid& guid) {
  std::string all;
  for (std::size_t n = 0; n < guid.size(); ++n) {
    char byte[4];
    std::snprintf(byte, sizeof byte, n % 4 == 0 && n > 0 ? ":%02x" : "%02x", guid[n]);
    all += byte;
  }
  return all;
}

namespace detail {

ReaderBase::ReaderBase(const Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
                       Delivery delivery)
    : topic_(topic), type_(type.m_typename) {
  const Entity handle = make_topic(participant.handle(), type, topic);
  dds_qos_t* qos = quality(delivery, Role::reader, type_);
  const dds_return_t reader = dds_create_reader(participant.handle(), handle, qos, nullptr);
  dds_delete_qos(qos);
  reader_ = checked(reader, "reader of " + topic);
}

const Guid& ReaderBase::writer(std::uint64_t publication) {
  const auto [at, fresh] = writers_.try_emplace(publication);
  if (!fresh) return at->second;
  if (dds_builtintopic_endpoint_t* endpoint = dds_get_matched_publication_data(reader_, publication)) {
    std::copy_n(endpoint->key.v, at->second.size(), at->second.begin());
    dds_builtintopic_free_endpoint(endpoint);
  } else {  // gone before its sample was taken: as good as any other that will not come again
    std::memcpy(at->second.data(), &publication, sizeof publication);
    return at->second;
  }
  note_match(at->second);
  return at->second;
}

std::vector<Guid> ReaderBase::departed() {
  dds_subscription_matched_status_t status{};
  dds_get_subscription_matched_status(reader_, &status);
  dds_liveliness_changed_status_t alive{};
  dds_get_liveliness_changed_status(reader_, &alive);
  std::vector<Guid> gone;
  if (alive.alive_count_change < 0 && alive.not_alive_count_change > 0)
    gone.push_back(writer(alive.last_publication_handle));
  if (status.total_count_change == 0 && status.current_count_change == 0) return gone;
  std::vector<dds_instance_handle_t> matched(status.current_count + 16);
  const dds_return_t count = dds_get_matched_publications(reader_, matched.data(), matched.size());
  if (count < 0 || static_cast<std::size_t>(count) > matched.size()) return gone;
  matched.resize(static_cast<std::size_t>(count));
  for (const auto publication : matched) writer(publication);
  std::erase_if(writers_, [&](const auto& known) {
    if (std::ranges::find(matched, known.first) != matched.end()) return false;
    gone.push_back(known.second);
    return true;
  });
  return gone;
}

std::vector<Guid> ReaderBase::known() const {
  std::vector<Guid> all;
  for (const auto& [publication, writer] : writers_) all.push_back(writer);
  return all;
}

void ReaderBase::renew(WaitSet& waitset) {
  dds_qos_t* qos = dds_create_qos();
  dds_get_qos(reader_, qos);
  const Entity fresh = dds_create_reader(dds_get_participant(reader_), dds_get_topic(reader_), qos, nullptr);
  dds_delete_qos(qos);
  if (fresh < 0) return;  // no memory: the old one goes on
  dds_delete(std::exchange(reader_, fresh));
  waitset.add(*this);
}

std::size_t ReaderBase::take(const std::function<void(const void*, const Guid&)>& each) {
  std::array<void*, kTakeAtOnce> samples{};
  std::array<dds_sample_info_t, kTakeAtOnce> infos;
  std::size_t taken = 0;
  for (;;) {
    samples[0] = nullptr;  // asks the middleware to lend its own memory
    const dds_return_t count = dds_take(reader_, samples.data(), infos.data(), kTakeAtOnce, kTakeAtOnce);
    if (count <= 0) return taken;
    for (dds_return_t i = 0; i < count; ++i) {
      const dds_sample_info_t& info = infos[static_cast<std::size_t>(i)];
      if (!info.valid_data) continue;
      each(samples[static_cast<std::size_t>(i)], writer(info.publication_handle));
      ++taken;
    }
    dds_return_loan(reader_, samples.data(), count);
  }
}

WriterBase::WriterBase(const Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
                       Delivery delivery) {
  const Entity handle = make_topic(participant.handle(), type, topic);
  dds_qos_t* qos = quality(delivery, Role::writer, type.m_typename);
  dds_listener_t* listener = match_listener();
  const dds_return_t writer = dds_create_writer(participant.handle(), handle, qos, listener);
  dds_delete_listener(listener);
  dds_delete_qos(qos);
  writer_ = checked(writer, "writer of " + topic);
}

int WriterBase::matched() const {
  dds_publication_matched_status_t status;
  return dds_get_publication_matched_status(writer_, &status) == DDS_RETCODE_OK ? static_cast<int>(status.current_count)
                                                                                : 0;
}

Guid WriterBase::guid() const {
  dds_guid_t drawn{};
  dds_get_guid(writer_, &drawn);
  Guid guid;
  std::copy_n(drawn.v, guid.size(), guid.begin());
  return guid;
}

bool WriterBase::write(const void* sample) { return dds_write(writer_, sample) == DDS_RETCODE_OK; }

}  // namespace detail

Malformed::Malformed(Counters counters, Other other) : counters_(std::move(counters)), other_(std::move(other)) {
  dds_set_log_sink(
      [](void* self, const dds_log_data_t* data) {
        const std::string_view line(data->message, data->size);
        if (!static_cast<Malformed*>(self)->take(line)) static_cast<Malformed*>(self)->pass_on(line);
      },
      this);
}

void Malformed::pass_on(std::string_view line) {
  const std::int64_t now = dds_time();
  std::int64_t next = next_ns_;
  // Of the threads that come at once, one speaks.
  if (now < next || !next_ns_.compare_exchange_strong(next, now + DDS_SECS(1)))
    ++left_out_;
  else
    other_(line, left_out_.exchange(0));
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

void WaitSet::add_departures(const detail::ReaderBase& reader) {
  checked(dds_set_status_mask(reader.handle(), DDS_SUBSCRIPTION_MATCHED_STATUS | DDS_LIVELINESS_CHANGED_STATUS),
          "statuses of a reader");
  checked(dds_waitset_attach(waitset_, reader.handle(), reader.handle()), "wait set");
}

void WaitSet::wait(double timeout_s) {
  dds_waitset_wait(waitset_, nullptr, 0, static_cast<dds_duration_t>(timeout_s * 1e9));
}

}  // namespace backwash::dds
