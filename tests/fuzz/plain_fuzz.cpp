// SPDX-License-Identifier: BSD-3-Clause
// The plain serial link's receiver, as it runs on both ends, on damaged frames of every kind.
#include <gtest/gtest.h>

#include <cstring>
#include <optional>
#include <span>

#include "firmware_bridge/autopilot_link.hpp"
#include "firmware_bridge/plain/plain.h"
#include "tests/bridge/pseudo_terminal.hpp"
#include "tests/fuzz/mutator.hpp"

namespace backwash::fuzz {
namespace {

/// The body between two delimiters, decoded from the definition of COBS: groups of a length and its bytes, a zero
/// between two groups. Nothing: it is not the coding of anything.
std::optional<Bytes> unstuffed(const Bytes& coded) {
  Bytes body;
  for (std::size_t at = 0; at < coded.size();) {
    const std::size_t group = coded[at];
    if (group == 0 || at + group > coded.size()) return std::nullopt;
    if (at > 0) body.push_back(0);
    body.insert(body.end(), coded.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                coded.begin() + static_cast<std::ptrdiff_t>(at + group));
    at += group;
  }
  return body;
}

/// CRC-32 by long division of the reversed message, as its definition has it.
std::uint32_t crc_by_division(std::span<const std::uint8_t> bytes) {
  std::uint32_t rest = 0xFFFFFFFF;
  for (const auto byte : bytes)
    for (int bit = 0; bit < 8; ++bit) {
      const bool out = (rest >> 31) != (byte >> bit & 1U);
      rest = rest << 1 ^ (out ? 0x04C11DB7U : 0U);
    }
  std::uint32_t reversed = 0;
  for (int bit = 0; bit < 32; ++bit) reversed |= (rest >> bit & 1U) << (31 - bit);
  return ~reversed;
}

/// What a frame is by the document alone.
plain_event_t judged(const Bytes& coded) {
  const auto body = unstuffed(coded);
  if (!body || body->size() < 56 || (*body)[1] != 1) return PLAIN_REFUSED;
  const bool state = (*body)[0] == 0x53;
  if (body->size() != (state ? 72U : 56U)) return PLAIN_REFUSED;
  if (!state && (*body)[0] != 0x43 && (*body)[0] != 0x50) return PLAIN_REFUSED;
  const auto word = [&](std::size_t at) {
    return (*body)[at] | (*body)[at + 1] << 8 | (*body)[at + 2] << 16 | std::uint32_t{(*body)[at + 3]} << 24;
  };
  if (word(body->size() - 4) != crc_by_division(std::span(*body).first(body->size() - 4))) return PLAIN_REFUSED;
  for (std::size_t i = 0; i < (state ? 13U : 10U); ++i)
    if ((word(12 + 4 * i) >> 23 & 0xFF) == 0xFF) return PLAIN_REFUSED;
  return state ? PLAIN_STATE : (*body)[0] == 0x43 ? PLAIN_COMMAND : PLAIN_POSE;
}

float any_float(Mutator& mutator) {
  const auto bits = static_cast<std::uint32_t>(mutator.bits());
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return mutator.one_in(8) ? value : static_cast<float>(mutator.below(2000)) / 100 - 10;
}

Bytes state(Mutator& mutator, std::uint16_t sequence) {
  plain_state_t s{};
  s.sequence = sequence;
  s.time_ms = sequence;
  s.pose_known = !mutator.one_in(8);
  for (auto* floats : {&s.position, &s.velocity, &s.rates})
    for (float& f : *floats) f = any_float(mutator);
  s.attitude[0] = mutator.one_in(8) ? any_float(mutator) : 1;
  Bytes wire(PLAIN_STATE_SIZE);
  plain_write_state(&s, wire.data());
  return wire;
}

Bytes frame(Mutator& mutator) {
  Bytes wire(PLAIN_LARGEST_SIZE);
  const auto fill = [&](auto& floats) {
    for (float& f : floats) f = any_float(mutator);
  };
  switch (mutator.below(3)) {
    case 0: {
      plain_command_t c{};
      c.sequence = static_cast<std::uint16_t>(mutator.bits());
      c.request = static_cast<std::uint8_t>(mutator.below(6));
      c.has_setpoint = mutator.one_in(2);
      fill(c.position);
      fill(c.velocity);
      fill(c.acceleration);
      plain_write_command(&c, wire.data());
      wire.resize(PLAIN_COMMAND_SIZE);
      break;
    }
    case 1: {
      plain_pose_t p{};
      p.time_ms = static_cast<std::uint32_t>(mutator.bits());
      fill(p.position);
      fill(p.attitude);
      fill(p.velocity_b);
      plain_write_pose(&p, wire.data());
      wire.resize(PLAIN_POSE_SIZE);
      break;
    }
    default: {
      plain_state_t s{};
      s.pose_known = mutator.one_in(2);
      s.answered = static_cast<std::uint16_t>(mutator.bits());
      fill(s.position);
      fill(s.velocity);
      fill(s.attitude);
      fill(s.rates);
      plain_write_state(&s, wire.data());
    }
  }
  return wire;
}

Bytes stuffed(const Bytes& body) {
  Bytes coded;
  for (auto from = body.begin();;) {
    const auto zero = std::find(from, body.end(), 0);
    coded.push_back(static_cast<std::uint8_t>(zero - from + 1));
    coded.insert(coded.end(), from, zero);
    if (zero == body.end()) break;
    from = zero + 1;
  }
  coded.push_back(0);
  return coded;
}

/// A frame whose checksum is right, with one byte of its body changed: its kind or version as often as not.
Bytes sealed_anew(Mutator& mutator, const Bytes& wire) {
  Bytes body = *unstuffed(Bytes(wire.begin(), wire.end() - 1));
  body.resize(body.size() - 4);
  body[mutator.below(mutator.one_in(2) ? 2 : body.size())] = static_cast<std::uint8_t>(mutator.bits());
  const std::uint32_t crc = crc_by_division(body);
  for (int i = 0; i < 4; ++i) body.push_back(static_cast<std::uint8_t>(crc >> (8 * i)));
  return stuffed(body);
}

TEST(Fuzz, ThePlainReceiverTakesExactlyWhatItsDocumentSays) {
  Mutator mutator("plain link", 10.0 / 3);
  plain_receiver_t receiver{};
  Bytes coded;  // since the last delimiter
  std::uint64_t taken = 0, refused = 0, wrong = 0;
  const auto hear = [&](std::uint8_t byte) {
    const plain_event_t event = plain_receive(&receiver, byte);
    if (byte != 0) {
      coded.push_back(byte);
      wrong += event != PLAIN_NOTHING;
      return;
    }
    const plain_event_t right = coded.empty() ? PLAIN_NOTHING : judged(coded);
    wrong += event != right;
    taken += event > PLAIN_REFUSED;
    refused += event == PLAIN_REFUSED;
    coded.clear();
  };
  for (bool more = true; more;) {
    Bytes bytes = mutator.one_in(10) ? mutator.noise(1 + mutator.below(200)) : frame(mutator);
    if (mutator.one_in(6)) bytes = sealed_anew(mutator, frame(mutator));
    if (mutator.one_in(2)) bytes = mutator.damaged(bytes);
    more = mutator.spend(bytes.size());
    for (const auto byte : bytes) hear(byte);
  }
  std::printf("%llu frames taken, %llu refused\n", static_cast<unsigned long long>(taken),
              static_cast<unsigned long long>(refused));
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(taken, mutator.inputs() / 8);
  EXPECT_GT(refused, mutator.inputs() / 8);
}

TEST(Fuzz, TheLinkBehindAPlainLineKeepsNothingBroken) {
  Mutator mutator("link to a plain controller");
  firmware_bridge::test::PseudoTerminal far;
  const firmware_bridge::Time start{std::chrono::seconds(1000)};
  firmware_bridge::AutopilotLink link(
      firmware_bridge::PlainPort(firmware_bridge::SerialPort::open(far.path(), 921'600).value(), 1), 1, start);
  Bytes waiting;
  std::uint16_t sequence = 0;
  for (bool more = true; more;) {
    while (waiting.size() < 1500) {
      Bytes bytes = mutator.one_in(10) ? mutator.noise(1 + mutator.below(200)) : state(mutator, ++sequence);
      if (mutator.one_in(4)) bytes = mutator.damaged(bytes);
      waiting.insert(waiting.end(), bytes.begin(), bytes.end());
    }
    more = mutator.spend(waiting.size());
    // A pseudo-terminal hands bytes over in its own time, and takes no more while it does not.
    for (std::size_t written = 0; written < waiting.size();) {
      const ssize_t n = ::write(far.master(), waiting.data() + written, waiting.size() - written);
      if (n > 0) written += static_cast<std::size_t>(n);
      ASSERT_TRUE(link.poll(start));
    }
    waiting.clear();
    for (std::uint64_t before = 0; before == 0 || before != link.received().bytes; ::usleep(300)) {
      before = link.received().bytes;
      ASSERT_TRUE(link.poll(start));
      const auto& t = link.telemetry();
      if (const auto said = t.local_state.at(start)) {
        ASSERT_LE(said->value.p_W.norm(), 1e4);
        ASSERT_LE(said->value.v_W.norm(), 100);
      }
      if (const auto said = t.attitude.at(start)) {
        ASSERT_NEAR(said->value.q_LB.norm(), 1, 1e-6);
        ASSERT_LE(said->value.omega_B.norm(), 100);
      }
    }
  }
  EXPECT_EQ(link.vehicle(), 1);
  EXPECT_TRUE(link.telemetry().local_state.at(start) && link.telemetry().attitude.at(start));
  EXPECT_GT(link.received().frames, 1000u);
  EXPECT_GT(link.received().bad_crc, 100u) << "what the line damages is counted";
  EXPECT_GT(link.telemetry().broken, 0u);
  EXPECT_TRUE(far.read().empty()) << "nothing is sent of its own accord";
}

}  // namespace
}  // namespace backwash::fuzz
