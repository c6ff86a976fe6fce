// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/guard/door.hpp"

#include <algorithm>
#include <cstring>

namespace backwash::dds {
namespace {

constexpr std::int64_t kForever = INT64_MAX;

}  // namespace

bool Allowance::has(std::int64_t now_ns, std::int64_t cost_ns, std::int64_t burst_ns) const noexcept {
  return std::max<std::int64_t>(full_ns_, now_ns) + cost_ns - now_ns <= burst_ns;
}

bool Allowance::take(std::int64_t now_ns, std::int64_t cost_ns, std::int64_t burst_ns) noexcept {
  std::int64_t full = full_ns_, next;
  do {
    next = std::max(full, now_ns) + cost_ns;
    if (next - now_ns > burst_ns) return false;
  } while (!full_ns_.compare_exchange_weak(full, next));
  return true;
}

// Of splitmix64: each bit of the secret and of the value changes each bit of the result.
std::uint64_t Door::secret(std::uint64_t value) const noexcept {
  std::uint64_t z = secret_ ^ value;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = ((z ^ z >> 27) + secret_) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

std::uint64_t Door::key(Prefix prefix) const noexcept {
  std::uint64_t first;
  std::uint32_t last;
  std::memcpy(&first, prefix.data(), sizeof first);
  std::memcpy(&last, prefix.data() + sizeof first, sizeof last);
  return secret(secret(first) ^ last) | 1;  // 0: nobody's
}

std::uint64_t Door::key(std::string_view topic) const noexcept {
  std::uint64_t sum = secret(topic.size());
  for (; !topic.empty(); topic.remove_prefix(std::min(topic.size(), sizeof sum))) {
    std::uint64_t part = 0;
    std::memcpy(&part, topic.data(), std::min(topic.size(), sizeof part));
    sum = secret(sum ^ part);
  }
  return sum;
}

Door::Place* Door::find(std::uint64_t key, std::int64_t now_ns) noexcept {
  for (Place& place : places_)
    if (place.key == key && place.until_ns >= now_ns) return &place;
  return nullptr;
}

bool Door::knows(Prefix prefix, std::int64_t now_ns) noexcept {
  Place* const place = find(key(prefix), now_ns);
  if (!place) return false;
  if (place->until_ns != kForever) place->until_ns = now_ns + kLease_s * kSecond_ns;
  return true;
}

// Of those here: the stranger of longest standing; if there is none, whoever is silent for longest, and for long.
Door::Place* Door::first_to_go(std::uint64_t of_socket, std::uint64_t of_address, std::int64_t now_ns) noexcept {
  constexpr std::int64_t kLong = (kLease_s - kSilent_s) * kSecond_ns;
  Place *stranger = nullptr, *silent = nullptr;
  for (Place& p : places_) {
    if (p.until_ns < now_ns || (of_socket && p.of_socket != of_socket) || (of_address && p.of_address != of_address))
      continue;
    if (!p.friendly && (!stranger || p.since_ns < stranger->since_ns)) stranger = &p;
    if (p.until_ns <= now_ns + kLong && (!silent || p.until_ns < silent->until_ns)) silent = &p;
  }
  return stranger ? stranger : silent;
}

// Whoever has a full share gives up one of its own.
Door::Place* Door::room(std::uint64_t of_socket, std::uint64_t of_address, std::int64_t now_ns) noexcept {
  std::size_t socket = 0, address = 0;
  Place* free = nullptr;
  for (Place& p : places_) {
    if (p.until_ns < now_ns) {
      free = &p;
      continue;
    }
    socket += of_socket && p.of_socket == of_socket;
    address += of_address && p.of_address == of_address;
  }
  if (socket >= kOfSocket) return first_to_go(of_socket, 0, now_ns);
  if (address >= kOfAddress) return first_to_go(0, of_address, now_ns);
  return free ? free : first_to_go(0, 0, now_ns);
}

void Door::settle(Place& place, std::uint64_t key, std::int64_t now_ns) noexcept {
  for (Known& endpoint : endpoints_)
    if (endpoint.place == &place) endpoint = {0, nullptr, place.until_ns};
  place.key = 0;
  place.endpoints = 0;
  place.friendly = false;
  place.kept = 0;
  place.of_socket = place.of_address = 0;
  place.since_ns = now_ns;
  place.until_ns = now_ns + kLease_s * kSecond_ns;
  place.key = key;
}

// Each that differs from the last costs, whether it is let in or not; the same again costs nothing.
bool Door::announces(Socket& socket, std::uint64_t key, std::int64_t now_ns) noexcept {
  constexpr std::int64_t kEach = kNextOfSocket_s * kSecond_ns, kAll = kFirstOfSocket * kEach;
  std::int64_t full_ns = std::max<std::int64_t>(socket.full_ns, now_ns);
  if (const auto who = static_cast<std::uint32_t>(key >> 1); socket.last.exchange(who) != who)
    socket.full_ns = full_ns = std::min(full_ns + kEach, now_ns + kAll + kDebtOfSocket_s * kSecond_ns);
  return full_ns <= now_ns + kAll;
}

bool Door::has_kept(std::uint64_t address) const noexcept {
  return !address || std::ranges::find(addresses_, address) != addresses_.end();
}

void Door::keep(Place& place, std::uint64_t address) noexcept {
  place.kept = address;
  if (!has_kept(address)) addresses_[next_address_++ % addresses_.size()] = address;
}

bool Door::lets_in(Prefix prefix, const Source& from, std::int64_t now_ns, bool handshake,
                   std::uint64_t kept) noexcept {
  constexpr std::int64_t kAddress_ns = kNextAddress_s * kSecond_ns, kAllAddresses_ns = kAddresses * kAddress_ns;
  const std::uint64_t who = key(prefix);
  if (kept) kept = secret(kept);
  if (Place* const place = find(who, now_ns)) {
    if (place->until_ns != kForever) place->until_ns = now_ns + kLease_s * kSecond_ns;
    if (!place->announcements.take(now_ns, kSecond_ns / kAgain, kAgainFirst * kSecond_ns / kAgain)) return false;
    // Its lease may have been a short one: to the middleware it is new each time.
    if (!kept || place->kept == kept) return true;
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || !(has_kept(kept) || kept_.take(now_ns, kAddress_ns, kAllAddresses_ns))) return false;
    keep(*place, kept);
    return true;
  }
  const std::uint64_t of_address = secret(from.address) | 1, of_socket = secret(of_address ^ from.port) | 1;
  // Two sums of each socket: hardly one in ten thousand has both in common with a flood from a few hundred others.
  const bool first = announces(sockets_[of_socket / 2 % kSockets], who, now_ns);
  const bool second = announces(sockets_[kSockets + of_socket / 2 / kSockets % kSockets], who, now_ns);
  if (!first && !second) return false;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || find(who, now_ns)) return lock.owns_lock();
  const bool fresh = !has_kept(kept);
  const std::int64_t each_ns = (handshake ? 2 : 1) * kSecond_ns;
  struct Share {
    Allowance& all;
    std::int64_t cost_ns, burst_ns;
  } const shares[] = {
      {nets_[of_address / 2 % kBuckets], each_ns / kNewOfAddress, kFirstOfAddress * kSecond_ns / kNewOfAddress},
      {in_all_, each_ns / kNew, kFirst * kSecond_ns / kNew},
      {kept_, fresh ? kAddress_ns : 0, fresh ? kAllAddresses_ns : kForever}};
  // Nothing is taken from the others' shares by whoever has none left of its own.
  for (const Share& s : shares)
    if (!s.all.has(now_ns, s.cost_ns, s.burst_ns)) return false;
  for (const Share& s : shares) s.all.take(now_ns, s.cost_ns, s.burst_ns);
  Place* const place = room(of_socket, of_address, now_ns);
  if (!place) return false;
  settle(*place, who, now_ns);
  keep(*place, kept);
  place->of_socket = of_socket;
  place->of_address = of_address;
  place->socket = static_cast<std::uint32_t>(of_socket / 2 % kBuckets);
  return true;
}

bool Door::takes(Prefix prefix, std::size_t bytes, std::int64_t now_ns) noexcept {
  Place* const place = find(key(prefix), now_ns);
  if (!place) return false;
  const auto may = [&](Allowance& a, std::int64_t rate, std::int64_t burst) {
    const std::int64_t each_ns = kSecond_ns / rate;
    return a.take(now_ns, static_cast<std::int64_t>(bytes) * each_ns, burst * each_ns);
  };
  if (place->friendly) return may(place->bytes, kBytes, kFirstBytes);
  return may(sockets_bytes_[place->socket], kBytes, kFirstBytes) &&
         may(strangers_bytes_, kBytesOfStrangers, kFirstBytesOfStrangers);
}

void Door::wants(std::span<const std::string> topics) noexcept {
  const std::lock_guard lock(mutex_);
  for (const std::string& topic : topics)
    if (const std::size_t n = topics_known_; n < kTopics) {
      topics_[n] = key(topic);
      ++topics_known_;
    }
  if (topics.empty() || topics_known_ == kTopics) topics_known_ = kAllTopics;
}

bool Door::wants(std::string_view topic) const noexcept {
  const std::size_t known = topics_known_;
  const std::uint64_t name = key(topic);
  return known == kAllTopics || std::find(topics_.begin(), topics_.begin() + known, name) != topics_.begin() + known;
}

Door::Endpoint Door::takes_endpoint(Prefix prefix, std::uint32_t entity, bool gone, std::int64_t now_ns) noexcept {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return Endpoint::later;
  const std::uint64_t who = key(prefix), what = secret(who ^ entity) | 1;
  Place* const place = find(who, now_ns);
  if (!place) return Endpoint::never;
  Known* free = nullptr;
  for (Known& known : endpoints_) {
    if ((known.place ? known.place->until_ns.load() : known.until_ns) < now_ns) {
      free = &known;
    } else if (known.key == what) {
      if (gone) {
        known = {};
        --place->endpoints;
      }
      return Endpoint::yes;
    }
  }
  if (gone) return Endpoint::yes;
  if (place->endpoints >= kEndpointsOfOne) return Endpoint::never;
  std::size_t shared = 0;
  for (const Place& p : places_)
    if (p.until_ns >= now_ns && p.endpoints > kSureOfOne) shared += p.endpoints - kSureOfOne;
  if (!free || (place->endpoints >= kSureOfOne && shared >= kShared)) return Endpoint::later;
  *free = {what, place, 0};
  ++place->endpoints;
  return Endpoint::yes;
}

void Door::met(Prefix prefix, std::int64_t now_ns) noexcept {
  const std::lock_guard lock(mutex_);
  const std::uint64_t who = key(prefix);
  Place* place = find(who, now_ns);
  if (!place && (place = room(0, 0, now_ns))) settle(*place, who, now_ns);
  if (place) place->friendly = true;
}

void Door::ours(Prefix prefix, std::int64_t now_ns) noexcept {
  met(prefix, now_ns);
  if (Place* const place = find(key(prefix), now_ns)) place->until_ns = kForever;
}

void Door::gone(Prefix prefix) noexcept {
  if (Place* const place = find(key(prefix), kForever)) place->until_ns = INT64_MIN;
}

std::size_t Door::living(std::int64_t now_ns) const noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(places_, [&](const Place& place) { return place.until_ns >= now_ns; }));
}

}  // namespace backwash::dds
