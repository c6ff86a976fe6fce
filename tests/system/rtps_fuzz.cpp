// SPDX-License-Identifier: BSD-3-Clause
// A hostile participant, for tests/system/daemon_rtps_fuzz.sh (docs/faults.md row 47): it takes part in the domain as a
// real peer with types that describe themselves, notes every packet that its own middleware sends, and sends damaged
// copies of them to where they went. To be run in a network namespace of its own.
//   rtps_fuzz DOMAIN NAMESPACE PACKETS SEED [outside [CREDENTIALS]]
// Prints how many were sent, and how many the receivers' sockets had no room for; 1 if it never met a peer. Outside:
// the peers speak by DDS Security, and it has no credentials or those of another authority; 1 if it does meet one.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "services/dds/topics.hpp"
#include "tests/system/rtps_mutator.hpp"

namespace dds = backwash::dds;
using backwash::fuzz::Mutator;
using backwash::fuzz::Packet;
using namespace std::chrono_literals;

namespace {

/// A packet and where it went.
struct Sent {
  Packet packet;
  sockaddr_in to{};
};

std::mutex lock;
std::vector<Sent> corpus;
std::size_t next_slot = 0;
std::set<std::uint16_t> targets;  // ports that others had open at the start

void note(const msghdr& message) {
  if (!message.msg_name || static_cast<sockaddr*>(message.msg_name)->sa_family != AF_INET) return;
  Sent sent;
  std::memcpy(&sent.to, message.msg_name, sizeof sent.to);
  if (!targets.contains(ntohs(sent.to.sin_port))) return;
  for (std::size_t n = 0; n < message.msg_iovlen; ++n) {
    const auto* from = static_cast<const std::uint8_t*>(message.msg_iov[n].iov_base);
    sent.packet.insert(sent.packet.end(), from, from + message.msg_iov[n].iov_len);
  }
  if (sent.packet.size() < 24) return;
  const std::lock_guard guard(lock);
  constexpr std::size_t kMost = 3000;
  if (corpus.size() < kMost)
    corpus.push_back(std::move(sent));
  else
    corpus[next_slot++ % kMost] = std::move(sent);
}

/// Everything that a peer of the daemon has.
struct Peer {
  dds::Participant participant;
  dds::Writer<dds::Odometry> odometry;
  dds::Writer<dds::Octomap> maps;
  dds::Writer<dds::PointCloud> clouds;
  dds::Writer<dds::TransformStamped> closures;
  dds::Writer<dds::Command> commands;
  dds::Reader<dds::Ack> acks;
  dds::Reader<dds::Status> statuses;
  dds::Reader<dds::Tube> tubes;

  Peer(std::uint32_t domain, const std::string& name, const std::string& credentials)
      : participant(domain, "lo", {}, credentials),
        odometry(dds::make_writer<dds::Odometry>(participant, name)),
        maps(dds::make_writer<dds::Octomap>(participant, name)),
        clouds(dds::make_writer<dds::PointCloud>(participant, name)),
        closures(dds::make_writer<dds::TransformStamped>(participant, name)),
        commands(dds::make_writer<dds::Command>(participant, name)),
        acks(dds::make_reader<dds::Ack>(participant, name)),
        statuses(dds::make_reader<dds::Status>(participant, name)),
        tubes(dds::make_reader<dds::Tube>(participant, name)) {}

  bool met(int patience) const {
    for (int n = 0; n < patience; ++n, std::this_thread::sleep_for(10ms))
      if (odometry.matched() > 0 && maps.matched() > 0 && commands.matched() > 0) return true;
    return false;
  }

  /// One sample of everything; the cloud takes several fragments.
  void speak() {
    static const std::string frame = "elsewhere", body = "base_link", id = "OcTree", x = "x";
    dds::Odometry o{};
    o.header.frame_id = dds::c_string(frame);
    o.child_frame_id = dds::c_string(body);
    odometry.write(o);
    dds::TransformStamped t{};
    t.header.frame_id = t.child_frame_id = dds::c_string(frame);
    closures.write(t);
    std::vector<std::uint8_t> data(5000);
    dds::Octomap m{};
    m.header.frame_id = dds::c_string(frame);
    m.id = dds::c_string(id);
    m.data = {40, 40, reinterpret_cast<decltype(m.data._buffer)>(data.data()), false};
    maps.write(m);
    dds::PointField field{dds::c_string(x), 0, 7, 1};
    dds::PointCloud c{};
    c.header.frame_id = dds::c_string(frame);
    c.fields = {1, 1, &field, false};
    c.data = {5000, 5000, data.data(), false};
    clouds.write(c);
    geometry_msgs_msg_dds__Point_ way{1, 2, 3};
    dds::Command command{};
    command.station = dds::c_string(id);
    command.waypoints = {1, 1, &way, false};
    commands.write(command);
    acks.take([](const dds::Ack&) {});
    statuses.take([](const dds::Status&) {});
    tubes.take([](const dds::Tube&) {});
  }
};

/// An open UDP socket of this network namespace, and the bytes that wait in it.
struct Socket {
  unsigned port, waiting;
};

std::vector<Socket> sockets() {
  std::ifstream table("/proc/net/udp");
  std::string line;
  std::getline(table, line);
  std::vector<Socket> open;
  Socket s{};
  while (std::getline(table, line))
    if (std::sscanf(line.c_str(), " %*d: %*8x:%x %*8x:%*x %*x %*x:%x", &s.port, &s.waiting) == 2) open.push_back(s);
  return open;
}

/// In the fullest of those that are attacked. Others are left out: a damaged packet can make a receiver answer the
/// socket that sent it, and nobody reads there.
unsigned waiting() {
  unsigned most = 0;
  for (const Socket& s : sockets())
    if (targets.contains(static_cast<std::uint16_t>(s.port))) most = std::max(most, s.waiting);
  return most;
}

/// Datagrams read by, and lost before, the sockets of this network namespace.
std::pair<long, long> udp_counters() {
  std::ifstream file("/proc/net/snmp");
  std::string line;
  while (std::getline(file, line)) {
    long in, none, errors, out, full;
    if (std::sscanf(line.c_str(), "Udp: %ld %ld %ld %ld %ld", &in, &none, &errors, &out, &full) == 5) return {in, full};
  }
  return {0, 0};
}

}  // namespace

extern "C" ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  note(*message);
  return syscall(SYS_sendmsg, socket, message, flags);
}

int main(int argc, char** argv) {
  if (argc < 5) return 64;
  const bool outside = argc > 5;
  const std::string credentials = argc > 6 ? argv[6] : "";
  const auto domain = static_cast<std::uint32_t>(std::atoi(argv[1]));
  const auto packets = static_cast<long>(std::atof(argv[3]));
  constexpr long kPerPeer = 50'000;  // then its identities are spent
  Mutator mutator(std::strtoull(argv[4], nullptr, 10));
  for (const Socket& s : sockets()) targets.insert(static_cast<std::uint16_t>(s.port));
  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  const auto [read_before, full_before] = udp_counters();
  const auto begun = std::chrono::steady_clock::now();
  std::unique_ptr<Peer> peer;
  std::size_t known = 0;
  for (long n = 0; n < packets; ++n) {
    if (n % kPerPeer == 0) {
      peer.reset();
      {
        const std::lock_guard guard(lock);
        corpus.clear();
      }
      peer = std::make_unique<Peer>(domain, argv[2], credentials);
      if (peer->met(outside ? 200 : 1000) == outside) {
        std::fprintf(stderr, "%s peer after %ld packets\n", outside ? "met a" : "no", n);
        return 1;
      }
    }
    if (n % 2000 == 0) peer->speak();
    if (n % 50 == 0)
      while (waiting() > 60'000) std::this_thread::sleep_for(200us);
    Sent one;
    {
      const std::lock_guard guard(lock);
      known = corpus.size();
      one = corpus[mutator.below(known)];
      const Packet other = corpus[mutator.below(known)].packet;
      one.packet = mutator.mutated(one.packet, other);
    }
    sendto(out, one.packet.data(), one.packet.size(), 0, reinterpret_cast<sockaddr*>(&one.to), sizeof one.to);
  }
  while (waiting() > 0) std::this_thread::sleep_for(1ms);
  const auto [read, full] = udp_counters();
  const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::printf("%ld mutated packets in %.1f s; %ld datagrams read, %ld without room\n", packets, s, read - read_before,
              full - full_before);
  return 0;
}
