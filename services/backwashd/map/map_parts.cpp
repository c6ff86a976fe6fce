// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/map_parts.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "core/config/file_hash.hpp"
#include "services/backwashd/in/localization.hpp"
#include "services/backwashd/text.hpp"
#include "services/dds/map_sending.hpp"

namespace backwash::daemon {

std::string MapParts::what() const {
  char size[32];
  std::snprintf(size, sizeof size, "%.1f MiB", static_cast<double>(size_) / (1 << 20));
  return std::string("a map of ") + size + " in parts of writer " + dds::text(writer_);
}

/// What is wrong with the map that a part says it belongs to, or with the part itself.
std::optional<std::string> MapParts::wrong(const dds::MapPart& part) const {
  if (part.size == 0 || part.size > most_bytes_)
    return "a map of " + std::to_string(part.size) + " bytes, at least 1 and at most " + std::to_string(most_bytes_);
  const std::string frame = part.frame_id ? part.frame_id : "";
  if (frame != frame_) return wrong_frame("the map", frame, "'" + frame_ + "'").value();
  const std::uint32_t count = dds::parts_of(part.size);
  const std::size_t length = part.number + 1 < count ? dds::kPartBytes : part.size - (count - 1) * dds::kPartBytes;
  if (part.number >= count || part.data._length != length)
    return "part " + std::to_string(part.number) + " of a map of " + std::to_string(part.size) + " bytes has " +
           std::to_string(part.data._length);
  return std::nullopt;
}

bool MapParts::is_of_this(const dds::MapPart& part) const noexcept {
  return part.size == size_ && part.hash == hash_ && part.binary == binary_ && part.resolution == resolution_;
}

void MapParts::begin(const dds::MapPart& part, const WriterId& writer, std::int64_t now_ns) {
  if (arriving() && held_ > 0 && !said_) cut_short_ = came() + ", and another began in its place";
  transfer_ = part.transfer;
  writer_ = writer;
  id_ = printable(part.id ? part.id : "");
  binary_ = part.binary;
  resolution_ = part.resolution;
  hash_ = part.hash;
  newest_ = 0;
  size_ = part.size;
  data_.clear();
  here_.clear();
  held_ = first_missing_ = 0;
  begun_ns_ = heard_ns_ = now_ns;
  said_ = false;
  state_ = backwash_msgs_msg_dds__MAPRECEIPT_ARRIVING;
  reason_.clear();
}

void MapParts::end(std::uint8_t state, std::string reason) {
  state_ = state;
  reason_ = std::move(reason);
  owes_ = true;
  if (state == backwash_msgs_msg_dds__MAPRECEIPT_WHOLE) return;
  data_ = {};
  here_ = {};
}

void MapParts::refuse(const dds::MapPart& part, const WriterId& writer, const std::string& why, std::int64_t now_ns) {
  if (alive(now_ns) && writer_ != writer) return;  // what arrives meanwhile goes on
  const bool known = transfer_ == part.transfer && writer_ == writer;
  if (transfer_ != part.transfer) begin(part, writer, now_ns);
  newest_ = std::max<std::uint64_t>(newest_, part.sent);
  newest_ns_ = now_ns;
  owes_ = true;
  if (known && !arriving()) return;  // the map worker has it, or it has its verdict
  end(backwash_msgs_msg_dds__MAPRECEIPT_REFUSED, why);
}

tl::expected<MapParts::Taken, std::string> MapParts::take(const dds::MapPart& part, const WriterId& writer,
                                                          std::int64_t now_ns) {
  const bool known = transfer_ == part.transfer && writer_ == writer;
  if (!known && alive(now_ns) && writer_ != writer)
    return tl::make_unexpected("a map in parts of writer " + dds::text(writer) + ": " + what() + " is arriving");
  if (!known && arriving() && now_ns - begun_ns_ < kOneIn_ns && writer_ == writer)
    return tl::make_unexpected("a map in parts of writer " + dds::text(writer) + ": another in less than a second");
  if (auto why = wrong(part)) {
    refuse(part, writer, *why, now_ns);
    return tl::make_unexpected(std::move(*why));
  }
  if (!known) begin(part, writer, now_ns);
  if (!is_of_this(part)) return tl::make_unexpected("a part that differs from the others of " + what());
  if (part.sent >= newest_) newest_ns_ = now_ns;
  newest_ = std::max<std::uint64_t>(newest_, part.sent);
  owes_ = true;
  if (state_ != backwash_msgs_msg_dds__MAPRECEIPT_ARRIVING) {
    heard_ns_ = now_ns;  // it asks what became of its map, and is told soon
    return Taken::here;
  }
  if (here_.empty()) {  // of the first part, and of one after the rest was let go
    data_.resize(size_);
    here_.resize(dds::parts_of(size_));
  }
  if (here_[part.number]) return Taken::here;
  said_ = false;
  heard_ns_ = now_ns;
  here_[part.number] = true;
  std::copy_n(reinterpret_cast<const std::int8_t*>(part.data._buffer), part.data._length,
              data_.begin() + static_cast<std::ptrdiff_t>(part.number * dds::kPartBytes));
  while (first_missing_ < here_.size() && here_[first_missing_]) ++first_missing_;
  if (++held_ < here_.size()) return held_ == 1 ? Taken::begins : Taken::here;
  if (config::fnv1a({reinterpret_cast<const char*>(data_.data()), data_.size()}) != hash_) {
    end(backwash_msgs_msg_dds__MAPRECEIPT_REFUSED, "what came differs from what was sent: send it again");
    return tl::make_unexpected(what() + ": " + reason_);
  }
  end(backwash_msgs_msg_dds__MAPRECEIPT_WHOLE, "");
  return Taken::whole;
}

MapMessage MapParts::message() {
  MapMessage message;
  message.data = std::exchange(data_, {});
  message.resolution = resolution_;
  message.binary = binary_;
  message.id = id_;
  message.received_ns = heard_ns_;
  message.from.writer = writer_;
  message.transfer = transfer_;
  return message;
}

void MapParts::judge(const MapVerdict& verdict) {
  if (verdict.transfer != transfer_) return;
  end(verdict.accepted ? backwash_msgs_msg_dds__MAPRECEIPT_ACCEPTED : backwash_msgs_msg_dds__MAPRECEIPT_REFUSED,
      verdict.why.data());
}

void MapParts::displaced(const MapMessage* message) {
  if (!message || !message->transfer || message->transfer != transfer_) return;
  end(backwash_msgs_msg_dds__MAPRECEIPT_REFUSED, "a newer map came before this one was looked at");
}

std::optional<dds::MapReceipt> MapParts::receipt(std::int64_t now_ns) {
  if (!owes_ || now_ns - told_ns_ < kReceipt_ns) return std::nullopt;
  owes_ = false;
  told_ns_ = now_ns;
  beyond_.fill(0);
  std::uint32_t bytes = 0;
  const auto count = static_cast<std::uint32_t>(here_.size());
  for (std::uint32_t n = 0; n < 8 * beyond_.size() && first_missing_ + n < count; ++n) {
    if (!here_[first_missing_ + n]) continue;
    beyond_[n / 8] = static_cast<std::uint8_t>(beyond_[n / 8] | 1u << (n % 8));
    bytes = n / 8 + 1;
  }
  dds::MapReceipt receipt{};
  receipt.transfer = *transfer_;
  receipt.newest = newest_;
  receipt.waited = static_cast<std::uint64_t>(now_ns - newest_ns_);
  receipt.held = held_;
  receipt.first_missing = first_missing_;
  receipt.beyond = {bytes, bytes, beyond_.data(), false};
  receipt.state = state_;
  receipt.reason = dds::c_string(reason_);
  return receipt;
}

void MapParts::forget() {
  data_ = {};
  here_ = {};
  held_ = first_missing_ = 0;
  transfer_.reset();
  owes_ = false;
}

std::string MapParts::came() const {
  char line[96];
  std::snprintf(line, sizeof line, ": %u of %u parts came in %.0f s", held_, dds::parts_of(size_),
                seconds(heard_ns_ - begun_ns_));
  return what() + line;
}

std::optional<std::string> MapParts::stalled(std::int64_t now_ns) {
  if (cut_short_) return std::exchange(cut_short_, std::nullopt);
  const std::int64_t silent_ns = now_ns - heard_ns_;
  if (!arriving() || silent_ns < kSilent_ns) return std::nullopt;
  std::string line = came() + ", none in the last " + std::to_string(silent_ns / 1'000'000'000) + " s";
  if (silent_ns > kForget_ns) forget();
  return std::exchange(said_, true) ? std::nullopt : std::optional(std::move(line));
}

std::optional<std::string> MapParts::let_go(std::span<const WriterId> departed) {
  if (!(arriving() || judged()) || std::ranges::find(departed, writer_) == departed.end()) return std::nullopt;
  const std::string line = came() + ", and its sender is gone";
  const bool whole = judged();
  forget();
  if (whole || std::exchange(said_, true)) return std::nullopt;
  return line;
}

}  // namespace backwash::daemon
