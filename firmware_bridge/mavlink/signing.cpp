// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/mavlink/signing.hpp"

#include <sha2.h>  // libmd: works on the caller's memory alone

#include <algorithm>

namespace backwash::mavlink {
namespace {

constexpr std::size_t kLinkAndTime = 7;  // bytes of the signature block before the hash

SigningTime time_of(std::span<const std::uint8_t> block) noexcept {
  SigningTime time = 0;
  for (std::size_t i = 0; i < 6; ++i) time |= SigningTime{block[1 + i]} << (8 * i);
  return time;
}

}  // namespace

void Signing::advance_to(SigningTime now) noexcept { time_ = std::max(time_, std::min(now, kLastSigningTime)); }

Signing::Hash Signing::hash(std::span<const std::uint8_t> frame,
                            std::span<const std::uint8_t> link_and_time) const noexcept {
  SHA2_CTX context;
  SHA256Init(&context);
  SHA256Update(&context, key_.data(), key_.size());
  SHA256Update(&context, frame.data(), frame.size());
  SHA256Update(&context, link_and_time.data(), link_and_time.size());
  std::array<std::uint8_t, SHA256_DIGEST_LENGTH> digest;
  SHA256Final(digest.data(), &context);
  Hash first;
  std::copy_n(digest.begin(), first.size(), first.begin());
  return first;
}

bool Signing::sign(EncodedFrame& frame) noexcept {
  if (time_ >= kLastSigningTime) return false;
  ++time_;
  std::array<std::uint8_t, kLinkAndTime> block{link_id_};
  for (std::size_t i = 0; i < 6; ++i) block[1 + i] = static_cast<std::uint8_t>(time_ >> (8 * i));
  const Hash signature = hash(frame.view(), block);
  const auto end = std::ranges::copy(block, frame.bytes.begin() + static_cast<std::ptrdiff_t>(frame.length)).out;
  std::ranges::copy(signature, end);
  frame.length += kSignature;
  return true;
}

SignatureVerdict Signing::judge_stream(const Stream& now) noexcept {
  const auto same = [&](const std::optional<Stream>& s) {
    return s && s->system == now.system && s->component == now.component && s->link_id == now.link_id;
  };
  auto at = std::ranges::find_if(streams_, same);
  if (at != streams_.end()) {
    if (now.time <= (*at)->time) return SignatureVerdict::replayed;
  } else {
    if (now.time + kOldestNewStream < time_) return SignatureVerdict::old;
    at = std::ranges::find_if(streams_, [](const auto& s) { return !s; });
    if (at == streams_.end()) return SignatureVerdict::no_room;
  }
  *at = now;
  advance_to(now.time);
  return SignatureVerdict::good;
}

SignatureVerdict Signing::judge(const Frame& frame) noexcept {
  if (frame.signature.size() != kSignature) {
    ++counters_.unsigned_frames;
    return SignatureVerdict::not_signed;
  }
  // Every byte is compared, so that the time taken tells nothing of how many were right.
  const Hash right = hash(frame.bytes, frame.signature.first(kLinkAndTime));
  std::uint8_t difference = 0;
  for (std::size_t i = 0; i < right.size(); ++i)
    difference = static_cast<std::uint8_t>(difference | (right[i] ^ frame.signature[kLinkAndTime + i]));
  if (difference != 0) {
    ++counters_.wrong_signature;
    return SignatureVerdict::wrong_signature;
  }
  const SignatureVerdict verdict =
      judge_stream({frame.sender.system, frame.sender.component, frame.signature[0], time_of(frame.signature)});
  switch (verdict) {
    case SignatureVerdict::replayed:
      ++counters_.replayed;
      break;
    case SignatureVerdict::old:
      ++counters_.old;
      break;
    case SignatureVerdict::no_room:
      ++counters_.no_room;
      break;
    default:
      ++counters_.good;
  }
  return verdict;
}

}  // namespace backwash::mavlink
