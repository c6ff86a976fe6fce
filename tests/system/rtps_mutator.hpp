// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <random>
#include <span>
#include <vector>

/// Damages RTPS packets (the wire protocol of DDS) with knowledge of their structure, for rtps_fuzz.cpp.
namespace backwash::fuzz {

using Packet = std::vector<std::uint8_t>;

/// Where a submessage of a packet is: `at` its header, `length` the bytes behind that.
struct Submessage {
  std::size_t at, length;
};

/// A parameter of a list: `at` its id, `length` of its value.
struct Parameter {
  std::size_t at, length;
};

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  /// A damaged copy of `packet`; parts may come from `other`. Discovery samples get a fresh sequence number, so that
  /// the receiver does not drop them as repeated.
  Packet mutated(const Packet& packet, const Packet& other) {
    Packet p = packet;
    const auto messages = submessages(p);
    for (const Submessage& m : messages)
      if (p[m.at] == kData && one_in(10) != 0) freshen(p, m);
    const std::size_t rounds = 1 + below(4);
    for (std::size_t n = 0; n < rounds; ++n) mutate(p, other);
    if (p.size() > kMost) p.resize(kMost);
    return p;
  }

  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }

 private:
  static constexpr std::uint8_t kData = 0x15, kDataFragment = 0x16;
  static constexpr std::size_t kMost = 65000;

  std::size_t one_in(std::size_t n) { return below(n); }
  static std::uint16_t read16(const Packet& p, std::size_t at, bool little) {
    return static_cast<std::uint16_t>(little ? p[at] | p[at + 1] << 8 : p[at] << 8 | p[at + 1]);
  }
  void write(Packet& p, std::size_t at, std::uint64_t value, std::size_t bytes, bool little) {
    for (std::size_t n = 0; n < bytes && at + n < p.size(); ++n)
      p[at + n] = static_cast<std::uint8_t>(value >> 8 * (little ? n : bytes - 1 - n));
  }
  bool little(const Packet& p, const Submessage& m) const { return p[m.at + 1] & 1; }

  std::vector<Submessage> submessages(const Packet& p) const {
    std::vector<Submessage> found;
    for (std::size_t at = 20; at + 4 <= p.size();) {
      std::size_t length = read16(p, at + 2, p[at + 1] & 1);
      if (length == 0 || length > p.size() - at - 4) length = p.size() - at - 4;
      found.push_back({at, length});
      at += 4 + length;
    }
    return found;
  }

  /// Of the payload of a discovery sample, or of inline QoS.
  std::vector<Parameter> parameters(const Packet& p, const Submessage& m) const {
    std::vector<Parameter> found;
    const std::size_t end = m.at + 4 + m.length;
    const bool data = p[m.at] == kData;
    if ((!data && p[m.at] != kDataFragment) || m.length < 24) return found;
    std::size_t at = m.at + 8 + read16(p, m.at + 6, little(p, m));
    bool order = little(p, m);
    if (!(p[m.at + 1] & 2)) {  // no inline QoS: the payload, if it is a parameter list
      if (at + 4 > end || p[at] != 0 || (p[at + 1] != 2 && p[at + 1] != 3)) return found;
      order = p[at + 1] & 1;
      at += 4;
    }
    while (at + 4 <= end) {
      const std::size_t length = read16(p, at + 2, order);
      if (length > end - at - 4) break;
      found.push_back({at, length});
      if (read16(p, at, order) == 1) break;
      at += 4 + length;
    }
    return found;
  }

  void freshen(Packet& p, const Submessage& m) {
    if (m.length < 20) return;
    const std::uint32_t writer = p[m.at + 12] << 24 | p[m.at + 13] << 16 | p[m.at + 14] << 8 | p[m.at + 15];
    const bool order = little(p, m);
    const std::size_t at = m.at + 20;
    std::uint32_t now = 0;
    for (std::size_t n = 0; n < 4; ++n) now |= std::uint32_t{p[at + n]} << 8 * (order ? n : 3 - n);
    std::uint32_t& last = last_[writer];
    last = std::max(last, now) + 1;
    write(p, at, last, 4, order);
  }

  std::uint32_t interesting() {
    static constexpr std::array<std::uint32_t, 18> kValues{
        0, 1, 2, 3, 4, 7, 8, 0x7f, 0xff, 0x100, 0xfffe, 0xffff, 0x10000, 1 << 24, 0x7fffffff, 0x80000000, ~1u, ~0u};
    return below(3) ? kValues[below(kValues.size())] : static_cast<std::uint32_t>(random_());
  }

  void bytes(Packet& p, std::size_t from, std::size_t length) {
    if (length == 0 || from + length > p.size()) return;
    const std::size_t at = from + below(length);
    // Discriminators of type identifiers and of type objects' kinds among them.
    static constexpr std::array<std::uint8_t, 24> kKinds{0x00, 0x01, 0x0a, 0x10, 0x11, 0x20, 0x30, 0x40,
                                                         0x41, 0x42, 0x50, 0x51, 0x52, 0x53, 0x60, 0x61,
                                                         0x62, 0x70, 0x71, 0x80, 0x90, 0xf1, 0xf2, 0xff};
    switch (below(5)) {
      case 0:
        p[at] ^= static_cast<std::uint8_t>(1u << below(8));
        break;
      case 1:
        p[at] = kKinds[below(kKinds.size())];
        break;
      case 2:
        p[at] = static_cast<std::uint8_t>(random_());
        break;
      case 3:
        write(p, from + below(length / 4 + 1) * 4, interesting(), 4, below(4) != 0);
        break;
      default:
        write(p, from + below(length / 2 + 1) * 2, interesting(), 2, below(4) != 0);
    }
  }

  void list(Packet& p, const Submessage& m) {
    const auto all = parameters(p, m);
    if (all.empty()) return bytes(p, m.at, m.length + 4);
    const Parameter one = all[below(all.size())];
    const bool order = !(p[m.at + 1] & 2) ? p[all[0].at - 3] & 1 : little(p, m);
    static constexpr std::array<std::uint16_t, 28> kIds{0x00, 0x01, 0x02, 0x05, 0x07, 0x0f, 0x15, 0x16,  0x1a, 0x1d,
                                                        0x23, 0x29, 0x2b, 0x2c, 0x2f, 0x31, 0x32, 0x50,  0x52, 0x58,
                                                        0x59, 0x5a, 0x62, 0x70, 0x72, 0x73, 0x75, 0x8007};
    switch (below(7)) {
      case 0:
        return write(p, one.at, kIds[below(kIds.size())] | (below(8) ? 0 : 0x4000), 2, order);
      case 1:
        return write(p, one.at + 2, interesting(), 2, order);
      case 2:
        return write(p, one.at + 2, below(one.length / 4 + 2) * 4, 2, order);
      case 3:
        return write(p, one.at + 4 + below(one.length / 4 + 1) * 4, interesting(), 4, order);
      case 4: {  // another entity of the same participant
        for (const Parameter& q : all)
          if (read16(p, q.at, order) == 0x5a && q.length == 16) write(p, q.at + 16, random_(), 3, order);
        return;
      }
      case 5: {  // the type's description, if there is one
        for (const Parameter& q : all)
          if (const auto id = read16(p, q.at, order); id == 0x75 || id == 0x72)
            for (std::size_t n = 0; n <= below(3); ++n) bytes(p, q.at + 4, q.length);
        return;
      }
      default:
        return bytes(p, one.at + 4, one.length);
    }
  }

  void entity(Packet& p, const Submessage& m) {
    static constexpr std::array<std::uint32_t, 14> kEntities{0x000001c1, 0x000002c2, 0x000002c7, 0x000003c2, 0x000003c7,
                                                             0x000004c2, 0x000100c2, 0x000200c2, 0x000300c3, 0x000301c3,
                                                             0x000300c4, 0x000301c4, 0xff0003c2, 0x000201c3};
    write(p, m.at + 8 + 4 * below(2), kEntities[below(kEntities.size())], 4, false);
  }

  void splice(Packet& p, const Packet& other) {
    const auto theirs = submessages(other);
    if (theirs.empty()) return;
    const Submessage m = theirs[below(theirs.size())];
    const auto ours = submessages(p);
    const std::size_t at = ours.empty() || below(2) ? p.size() : ours[below(ours.size())].at;
    p.insert(p.begin() + static_cast<long>(at), other.begin() + static_cast<long>(m.at),
             other.begin() + static_cast<long>(m.at + 4 + m.length));
  }

  void mutate(Packet& p, const Packet& other) {
    const auto all = submessages(p);
    if (all.empty()) return bytes(p, 0, p.size());
    const Submessage m = all[below(all.size())];
    switch (below(16)) {
      case 0:
        return bytes(p, 0, p.size());
      case 1:
        return bytes(p, m.at, 4);  // id, flags, length
      case 2:
        return write(p, m.at + 2, interesting(), 2, little(p, m));
      case 3:
        return p.resize(20 + below(p.size() - 19));  // cut
      case 4:
        return splice(p, other);
      case 5:
        return entity(p, m);
      case 6:
        return write(p, m.at + 16 + 4 * below(2), interesting(), 4, little(p, m));  // sequence number
      case 7:
        return write(p, m.at + 4 + 4 * below(12), interesting(), 4, little(p, m));  // any field, bitmaps too
      case 8:
        return write(p, m.at + 28 + 2 * below(6), interesting(), 2, little(p, m));  // fragments
      case 9:
        return bytes(p, m.at + 4, std::min<std::size_t>(m.length, 28));
      case 10:
        return bytes(p, 8, below(50) ? 0 : 12);  // another participant
      default:
        return list(p, m);
    }
  }

  std::mt19937_64 random_;
  std::map<std::uint32_t, std::uint32_t> last_;  // sequence number of each writer
};

}  // namespace backwash::fuzz
