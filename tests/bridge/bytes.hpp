// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/mavlink/messages.hpp"

namespace backwash::mavlink::test {

using Bytes = std::vector<std::uint8_t>;

inline Bytes from_hex(const std::string& hex) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

/// CRC-16/MCRF4XX bit by bit, as its definition says (reflected 0x1021, start 0xFFFF): not how the codec computes it.
inline std::uint16_t crc_by_bits(std::span<const std::uint8_t> bytes, std::uint16_t crc = 0xFFFF) {
  for (const auto byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ byte);
    for (int bit = 0; bit < 8; ++bit) crc = static_cast<std::uint16_t>(crc & 1 ? (crc >> 1) ^ 0x8408 : crc >> 1);
  }
  return crc;
}

/// Judges an accepted frame from the bytes alone: layout, known id, bitwise checksum, no flags to be respected.
inline bool frame_is_good(std::span<const std::uint8_t> b) {
  if (b.size() < 8) return false;
  const bool v2 = b[0] == 0xFD;
  const std::size_t header = v2 ? 10 : 6;
  const std::uint32_t id = v2 ? b[7] | b[8] << 8 | b[9] << 16 : b[5];
  if (b.size() != header + b[1] + 2 || (v2 && (b[2] & 0xFE) != 0)) return false;
  const MessageInfo* m = find_message(id);
  if (m == nullptr) return false;
  Bytes summed(b.begin() + 1, b.end() - 2);
  summed.push_back(m->crc_extra);
  return crc_by_bits(summed) == (b[b.size() - 2] | b[b.size() - 1] << 8);
}

/// A received frame that owns its bytes.
struct Received {
  Frame frame;
  Bytes bytes, payload, signature;
};

inline void collect(Parser& parser, std::span<const std::uint8_t> input, std::vector<Received>& out) {
  parser.feed(input, [&](const Frame& f) {
    out.push_back({f, Bytes(f.bytes.begin(), f.bytes.end()), Bytes(f.payload.begin(), f.payload.end()),
                   Bytes(f.signature.begin(), f.signature.end())});
  });
}

inline std::vector<Received> parse(std::span<const std::uint8_t> input) {
  Parser parser;
  std::vector<Received> out;
  collect(parser, input, out);
  return out;
}

inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace backwash::mavlink::test
