// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/autopilot_clock.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "core/log/little_endian.hpp"

namespace backwash::log {
namespace {

struct Timesync {
  std::int64_t answered_ns, asked_ns;  ///< 0 in a question; the asker's own time
};

/// A frame's TIMESYNC (MAVLink 1 and 2), its end filled up with the zeros that are not sent.
std::optional<Timesync> timesync_of(std::span<const std::uint8_t> frame) {
  constexpr std::uint8_t kFirst = 0xFE, kSecond = 0xFD;
  constexpr std::uint32_t kTimesync = 111;
  const bool second = !frame.empty() && frame[0] == kSecond;
  if (!second && (frame.empty() || frame[0] != kFirst)) return std::nullopt;
  const std::size_t head = second ? 10 : 6;
  if (frame.size() < head + frame[1]) return std::nullopt;
  const std::uint32_t id = second ? frame[7] | frame[8] << 8 | frame[9] << 16 : frame[5];
  if (id != kTimesync) return std::nullopt;
  std::array<std::uint8_t, sizeof(Timesync)> payload{};
  std::copy_n(frame.begin() + static_cast<std::ptrdiff_t>(head), std::min<std::size_t>(frame[1], payload.size()),
              payload.begin());
  return little<Timesync>(payload.data());
}

/// Of each stretch of time the pair with the shortest round trip.
std::vector<ClockPair> quickest(const std::vector<ClockPair>& pairs) {
  constexpr std::int64_t kStretch_ns = 5'000'000'000;
  std::vector<ClockPair> best;
  std::int64_t stretch = -1;
  for (const ClockPair& pair : pairs) {
    const std::int64_t now = (pair.ours_ns - pairs.front().ours_ns) / kStretch_ns;
    if (now != stretch)
      best.push_back(pair);
    else if (pair.round_trip_ns < best.back().round_trip_ns)
      best.back() = pair;
    stretch = now;
  }
  return best;
}

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

}  // namespace

std::vector<ClockPair> clock_pairs(const RawLog& log) {
  constexpr std::int64_t kLongest_ns = 1'000'000'000;
  std::vector<ClockPair> pairs;
  bool waits = false;  // for the answer to the question of then
  std::int64_t asked_ns = 0;
  for (const RawRecord& record : log.records) {
    const bool out = record.header.kind == RecordKind::frame_out;
    if (!out && record.header.kind != RecordKind::frame_in) continue;
    const auto sync = timesync_of(record.bytes);
    if (!sync) continue;
    if (out && sync->answered_ns == 0) {
      waits = true;
      asked_ns = sync->asked_ns;
    }
    if (out || sync->answered_ns == 0) continue;
    if (!waits || asked_ns != sync->asked_ns) continue;  // it answers somebody else
    const std::int64_t round_trip = record.header.t_ns - sync->asked_ns;
    waits = false;
    if (round_trip < 0 || round_trip > kLongest_ns) continue;
    if (!pairs.empty() && sync->answered_ns <= pairs.back().theirs_ns) pairs.clear();
    pairs.push_back({sync->asked_ns + round_trip / 2, sync->answered_ns, round_trip});
  }
  return pairs;
}

std::int64_t ClockLine::ours(double theirs_s) const noexcept {
  const double since = theirs_s - seconds(theirs_ns);
  return ours_ns + static_cast<std::int64_t>(std::llround(1e9 * since * (1 + rate)));
}

ClockLine clock_line(const std::vector<ClockPair>& pairs) {
  constexpr double kRateFrom = 10;  // s
  const auto best = quickest(pairs);
  const ClockPair& zero = best.front();
  // y: by how much our clock went further than theirs since the first pair.
  const auto x = [&](const ClockPair& p) { return seconds(p.theirs_ns - zero.theirs_ns); };
  const auto y = [&](const ClockPair& p) { return seconds(p.ours_ns - zero.ours_ns - (p.theirs_ns - zero.theirs_ns)); };
  const auto n = static_cast<double>(best.size());
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
  for (const auto& p : best) {
    mean_x += x(p) / n;
    mean_y += y(p) / n;
  }
  for (const auto& p : best) {
    xx += (x(p) - mean_x) * (x(p) - mean_x);
    xy += (x(p) - mean_x) * (y(p) - mean_y);
  }
  ClockLine line;
  line.pairs = best.size();
  line.rate = x(best.back()) >= kRateFrom && xx > 0 ? xy / xx : 0;
  line.theirs_ns = zero.theirs_ns;
  line.ours_ns = zero.ours_ns + static_cast<std::int64_t>(std::llround(1e9 * (mean_y - line.rate * mean_x)));
  for (const auto& p : best) {
    const double left = seconds(line.ours(seconds(p.theirs_ns)) - p.ours_ns);
    line.rms_s += left * left / n;
    line.largest_s = std::max(line.largest_s, std::abs(left));
    line.round_trip_s = std::max(line.round_trip_s, seconds(p.round_trip_ns));
  }
  line.rms_s = std::sqrt(line.rms_s);
  return line;
}

}  // namespace backwash::log
