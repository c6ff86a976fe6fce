// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/map_sending.hpp"

#include <algorithm>

namespace backwash::dds {
namespace {

constexpr double kFirst = 32e3;                    // byte/s to begin with
constexpr double kGain = 0.12;                     // of the rate, a step, where nothing waits
constexpr double kSlowest = 0.7, kFastest = 1.25;  // a step of the rate
constexpr double kBegins = 1.4;                    // a step before a queue was ever seen
constexpr double kBeyondArrival = 1.75;            // the rate over what arrives, at most
constexpr double kFades = 0.95;                    // of what arrived once, a step
constexpr std::int64_t kStep_ns = 100'000'000;     // between two steps, at least
constexpr std::int64_t kBurst_ns = 20'000'000;     // of the rate that may go out at once

}  // namespace

MapSending::MapSending(std::size_t bytes, double most, std::int64_t now_ns)
    : parts_(parts_of(bytes)),
      most_(most),
      rate_(std::min(kFirst, most)),
      credit_ns_(now_ns),
      progress_ns_(now_ns),
      heard_ns_(now_ns),
      steered_ns_(now_ns) {}

bool MapSending::is_lost(const Part& part, std::int64_t now_ns) const noexcept {
  return !part.held && (part.sent_ns + kReorder_ns < newest_ns_ || part.sent_ns + way_ns_ + kSilence_ns < now_ns);
}

std::optional<std::uint32_t> MapSending::next(std::int64_t now_ns) {
  if (held_ == count()) {
    if (now_ns - std::max(heard_ns_, parts_[0].sent_ns) < kAsk_ns) return std::nullopt;
    parts_[0].sent_ns = now_ns;
    ++sent_;
    return 0;
  }
  if (now_ns - heard_ns_ > kSilence_ns + way_ns_) {  // the line is fuller than anybody can say, or gone
    rate_ = std::max(kLeast, rate_ / 2);
    heard_ns_ = now_ns;
    looked_at_ = first_missing_;
  }
  const double seconds = static_cast<double>(now_ns - credit_ns_) * 1e-9;
  credit_ = std::min(credit_ + seconds * rate_, 2 * kOnLine + rate_ * static_cast<double>(kBurst_ns) * 1e-9);
  credit_ns_ = now_ns;
  if (credit_ < kOnLine) return std::nullopt;
  const std::uint32_t end = std::min(count(), first_missing_ + kPartsBeyond);
  while (looked_at_ < fresh_ && !is_lost(parts_[looked_at_], now_ns)) ++looked_at_;
  std::uint32_t number = looked_at_;
  if (looked_at_ == fresh_) {
    if (fresh_ >= end) {
      looked_at_ = first_missing_;
      return std::nullopt;
    }
    number = fresh_++;
  }
  looked_at_ = number + 1;
  parts_[number].sent_ns = now_ns;
  credit_ -= kOnLine;
  ++sent_;
  return number;
}

void MapSending::hold(std::uint32_t number, std::int64_t now_ns) {
  if (std::exchange(parts_[number].held, true)) return;
  ++held_;
  progress_ns_ = now_ns;
}

// Whoever puts the parts together has begun anew: a daemon that restarted, or that heard nothing for too long.
void MapSending::begin_anew(const MapReceipt& receipt) {
  for (Part& part : parts_) part.held = false;
  held_ = steered_held_ = first_missing_ = 0;
  fresh_ = std::min(fresh_, receipt.first_missing + 8 * receipt.beyond._length);
}

void MapSending::hear(const MapReceipt& receipt, std::int64_t now_ns) {
  const auto newest_ns = static_cast<std::int64_t>(receipt.newest);
  const auto waited_ns = static_cast<std::int64_t>(receipt.waited);
  if (receipt.first_missing > fresh_ || newest_ns < 0 || newest_ns > now_ns || waited_ns < 0) return;
  if (newest_ns > newest_ns_ && receipt.first_missing < first_missing_) begin_anew(receipt);  // it never falls else
  for (std::uint32_t n = first_missing_; n < receipt.first_missing; ++n) hold(n, now_ns);
  for (std::uint32_t n = 0; n < 8 * receipt.beyond._length && receipt.first_missing + n < fresh_; ++n)
    if (receipt.beyond._buffer[n / 8] >> (n % 8) & 1) hold(receipt.first_missing + n, now_ns);
  while (first_missing_ < count() && parts_[first_missing_].held) ++first_missing_;
  heard_ns_ = now_ns;
  looked_at_ = first_missing_;
  if (newest_ns <= newest_ns_) return;
  newest_ns_ = newest_ns;
  way_ns_ = std::max<std::int64_t>(now_ns - newest_ns - waited_ns, 0);
  least_way_ns_ = std::min(least_way_ns_, way_ns_);
  step_way_ns_ = std::min(step_way_ns_, way_ns_);
  if (now_ns - steered_ns_ >= std::max(kStep_ns, way_ns_)) steer(now_ns);
}

// The queue two steps ahead, if it goes on as since the last one: a rate that looked at the queue alone would swing, as
// what it changes is seen one way there and back later.
void MapSending::steer(std::int64_t now_ns) {
  const double arrived = (held_ - steered_held_) * kOnLine / (static_cast<double>(now_ns - steered_ns_) * 1e-9);
  arrives_ = std::max(arrived, kFades * arrives_);
  const auto queue_ns = static_cast<double>(step_way_ns_ - least_way_ns_);
  const double ahead = (3 * queue_ns - 2 * queue_ns_) / static_cast<double>(kQueue_ns);
  filled_ = filled_ || ahead > 1;
  const double faster = filled_ ? std::clamp(1 + kGain * (1 - ahead), kSlowest, kFastest) : kBegins;
  rate_ = faster < 1 ? rate_ * faster : std::min(rate_ * faster, std::max(kBeyondArrival * arrives_, rate_));
  rate_ = std::clamp(rate_, kLeast, most_);
  queue_ns_ = queue_ns;
  step_way_ns_ = INT64_MAX;
  steered_ns_ = now_ns;
  steered_held_ = held_;
}

}  // namespace backwash::dds
