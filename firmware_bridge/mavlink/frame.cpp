// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/mavlink/frame.hpp"

#include <algorithm>
#include <cstring>

#include "firmware_bridge/mavlink/messages.hpp"

namespace backwash::mavlink {
namespace {

/// What the header says: complete when `length` > 0.
struct Header {
  std::size_t length = 0;   // of the header itself; 0: more bytes needed
  std::size_t payload = 0;  // bytes
  std::size_t total = 0;    // header to signature
  std::uint8_t incompat = 0;
  Sender sender;
  std::uint32_t id = 0;
};

bool is_magic(std::uint8_t byte) noexcept { return byte == kMagicV2 || byte == kMagicV1; }

Header read_header(std::span<const std::uint8_t> b) noexcept {
  Header h;
  h.payload = b.size() > 1 ? b[1] : 0;
  if (b[0] == kMagicV1) {
    if (b.size() < kHeaderV1) return {};
    h.length = kHeaderV1;
    h.sender = {b[3], b[4], b[2]};
    h.id = b[5];
    h.total = h.length + h.payload + kChecksum;
  } else {
    if (b.size() < kHeaderV2) return {};
    h.length = kHeaderV2;
    h.incompat = b[2];
    h.sender = {b[5], b[6], b[4]};
    h.id = b[7] | std::uint32_t{b[8]} << 8 | std::uint32_t{b[9]} << 16;
    h.total = h.length + h.payload + kChecksum + (h.incompat & kIncompatSigned ? kSignature : 0);
  }
  return h;
}

bool continues(const Sender& last, const Sender& now) noexcept {
  return now.system == last.system && now.component == last.component &&
         now.sequence == static_cast<std::uint8_t>(last.sequence + 1);
}

bool checksum_right(std::span<const std::uint8_t> b, const Header& h, std::uint8_t crc_extra) noexcept {
  Crc crc;
  crc.add(b.subspan(1, h.length - 1 + h.payload));
  crc.add(crc_extra);
  const std::size_t at = h.length + h.payload;
  return crc.value() == (b[at] | b[at + 1] << 8);
}

/// What bytes are that may begin a frame; part: what they are depends on bytes to come.
enum class Found { part, noise, bad_checksum, unknown, frame };

/// h: their header. `continuing`: they follow a frame of its sender, whose count goes on.
Found look(std::span<const std::uint8_t> b, const Header& h, bool continuing) noexcept {
  if (!is_magic(b[0])) return Found::noise;
  if (h.length == 0) return Found::part;
  const MessageInfo* known = find_message(h.id);
  if (known == nullptr) {
    if (!continuing) return Found::noise;
    if (b.size() <= h.total) return Found::part;
    return is_magic(b[h.total]) ? Found::unknown : Found::noise;
  }
  // MAVLink 1 neither truncates nor extends, and its short header makes noise look like a frame too often otherwise.
  if (b[0] == kMagicV1 && h.payload != known->base_length) return Found::noise;
  if (b.size() < h.length + h.payload + kChecksum) return Found::part;
  if (!checksum_right(b, h, known->crc_extra)) return Found::bad_checksum;
  return b.size() < h.total ? Found::part : Found::frame;
}

}  // namespace

std::size_t Parser::take(std::span<const std::uint8_t> input) noexcept {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  const std::size_t n = std::min(input.size(), buffer_.size() - end_);
  std::copy_n(input.begin(), n, buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += n;
  counters_.bytes += n;
  return n;
}

std::optional<Frame> Parser::next() noexcept {
  while (begin_ < end_) {
    const std::span<const std::uint8_t> b{buffer_.data() + begin_, end_ - begin_};
    const Header h = read_header(b);
    const Found found = look(b, h, in_step_ && continues(last_sender_, h.sender));
    if (found == Found::part) return std::nullopt;
    in_step_ = found == Found::frame || found == Found::unknown;
    if (!in_step_) {
      ++begin_;
      ++counters_.skipped_bytes;
      counters_.bad_crc += found == Found::bad_checksum ? 1u : 0u;
      continue;
    }
    begin_ += h.total;
    last_sender_ = h.sender;
    if (found == Found::unknown) {
      ++counters_.unknown_id;
      continue;
    }
    if ((h.incompat & ~kIncompatSigned) != 0) {
      ++counters_.unknown_incompat;
      continue;
    }
    ++counters_.frames;
    const std::size_t unsigned_length = h.length + h.payload + kChecksum;
    return Frame{b[0],
                 h.incompat,
                 h.sender,
                 h.id,
                 b.subspan(h.length, h.payload),
                 b.first(unsigned_length),
                 b.subspan(unsigned_length, h.total - unsigned_length)};
  }
  return std::nullopt;
}

EncodedFrame encode_frame(const Sender& sender, std::uint32_t id, std::uint8_t crc_extra, const Payload& payload,
                          std::uint8_t incompat_flags) noexcept {
  EncodedFrame f;
  const std::array<std::uint8_t, kHeaderV2> header{kMagicV2,
                                                   static_cast<std::uint8_t>(payload.length),
                                                   incompat_flags,
                                                   0,
                                                   sender.sequence,
                                                   sender.system,
                                                   sender.component,
                                                   static_cast<std::uint8_t>(id),
                                                   static_cast<std::uint8_t>(id >> 8),
                                                   static_cast<std::uint8_t>(id >> 16)};
  std::ranges::copy(header, f.bytes.begin());
  std::copy_n(payload.bytes.begin(), payload.length, f.bytes.begin() + kHeaderV2);
  f.length = kHeaderV2 + payload.length;
  Crc crc;
  crc.add(f.view().subspan(1));
  crc.add(crc_extra);
  f.bytes[f.length++] = static_cast<std::uint8_t>(crc.value());
  f.bytes[f.length++] = static_cast<std::uint8_t>(crc.value() >> 8);
  return f;
}

}  // namespace backwash::mavlink
