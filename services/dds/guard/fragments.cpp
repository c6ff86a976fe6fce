// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/guard/fragments.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <mutex>

namespace backwash::dds {
namespace {

// Layout of RTPS 2.3: 8.3.3 and 9.4.5.5.
constexpr std::size_t kHead = 20, kSubmessageHead = 4, kPrefixAt = 8, kPrefix = 12, kFragmentHead = 32;
constexpr std::uint8_t kDataFrag = 0x16, kLittleEndian = 1;
constexpr std::uint32_t kMost = 1u << 16;  // fragments of a sample: 64 MiB in the smallest that the standard allows

struct One {
  Partial sample;
  std::bitset<kMost> here;
  bool whole() const noexcept { return sample.came == sample.count; }  // of none, too
};

struct Kept {
  std::mutex mutex;
  std::array<One, kPartialSamples> all;
};

Kept& kept() noexcept {
  static Kept one;
  return one;
}

std::uint32_t number(std::span<const std::uint8_t> bytes, bool little) noexcept {
  std::uint32_t value = 0;
  for (std::size_t n = 0; n < bytes.size(); ++n) value = value << 8 | bytes[little ? bytes.size() - 1 - n : n];
  return value;
}

/// Where the fragments of this sample are kept: in the place of its writer's last one, of one that is whole, or of the
/// one that has not gone on for longest. Null: a later sample of its writer is there.
One* place(Kept& kept, const Partial& sample) noexcept {
  const auto same = std::ranges::find_if(kept.all, [&](const One& o) { return o.sample.writer == sample.writer; });
  if (same != kept.all.end() && same->sample.count > 0) {
    const Partial& known = same->sample;
    if (known.number == sample.number && known.size == sample.size && known.count == sample.count) return &*same;
    if (known.number > sample.number) return nullptr;
    *same = {sample, {}};
    return &*same;
  }
  One& oldest =
      *std::ranges::min_element(kept.all, {}, [](const One& o) { return o.whole() ? INT64_MIN : o.sample.newest_ns; });
  oldest = {sample, {}};
  return &oldest;
}

/// `body`: of a DATA_FRAG, from the byte behind its head on; at least kFragmentHead.
void note(std::span<const std::uint8_t> prefix, std::span<const std::uint8_t> body, bool little,
          std::int64_t now_ns) noexcept {
  const std::uint32_t first = number(body.subspan(20, 4), little), several = number(body.subspan(24, 2), little);
  const std::uint32_t each = number(body.subspan(26, 2), little), size = number(body.subspan(28, 4), little);
  if (size < kLargeSample || each == 0 || first == 0) return;
  // No more than the body has bytes for: who says more costs the receiving thread no more time than it sent.
  if (several > (body.size() - kFragmentHead) / each + 1) return;
  const std::uint32_t count = size / each + (size % each != 0);
  if (count > kMost || first > count) return;
  Guid writer{};
  std::ranges::copy(prefix, writer.begin());
  std::ranges::copy(body.subspan(8, 4), writer.begin() + kPrefix);
  const std::uint64_t sample =
      std::uint64_t{number(body.subspan(12, 4), little)} << 32 | number(body.subspan(16, 4), little);
  Kept& k = kept();
  const std::unique_lock lock(k.mutex, std::try_to_lock);
  if (!lock) return;
  One* const one = place(k, {writer, sample, size, 0, count, now_ns, now_ns});
  if (!one) return;
  for (std::uint32_t n = first - 1; n < std::min(count, first - 1 + several); ++n) {
    if (one->here[n]) continue;
    one->here[n] = true;
    ++one->sample.came;
    one->sample.newest_ns = now_ns;
  }
}

}  // namespace

void note_fragments(std::span<const std::uint8_t> datagram, std::int64_t now_ns) noexcept {
  if (datagram.size() < kHead || !std::ranges::equal(datagram.first(4), std::string_view("RTPS"))) return;
  const auto prefix = datagram.subspan(kPrefixAt, kPrefix);
  for (std::size_t at = kHead; at + kSubmessageHead <= datagram.size();) {
    const bool little = datagram[at + 1] & kLittleEndian;
    const std::size_t told = number(datagram.subspan(at + 2, 2), little), rest = datagram.size() - at - kSubmessageHead;
    const std::size_t length = told == 0 ? rest : told;  // 0: to the end
    if (length > rest) return;
    if (datagram[at] == kDataFrag && length >= kFragmentHead)
      note(prefix, datagram.subspan(at + kSubmessageHead, length), little, now_ns);
    at += kSubmessageHead + length;
  }
}

std::vector<Partial> partial_samples() {
  Kept& k = kept();
  const std::lock_guard lock(k.mutex);
  std::vector<Partial> partial;
  for (const One& one : k.all)
    if (!one.whole()) partial.push_back(one.sample);
  return partial;
}

}  // namespace backwash::dds
