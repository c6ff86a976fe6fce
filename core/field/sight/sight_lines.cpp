// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/sight/sight_lines.hpp"

#include <algorithm>
#include <cmath>

#include "core/field/sight/sight.hpp"

namespace backwash::field {
namespace {

constexpr double kHalf = 0.5 + kTouch;  // of a closed box with its tolerance, voxel edges

}  // namespace

SightLines::SightLines(std::span<const Bundle> bundles, int radius, double range2)
    : radius_(radius),
      width_(2 * radius + 1),
      bundles_(static_cast<int>(bundles.size())),
      end_(1 - 2 / std::max(2.0, std::sqrt(range2))),
      lines_(bundles.size() * static_cast<std::size_t>(width_ * width_)) {
  const auto beyond = [](int d) { return std::max(0, std::abs(d) - 1); };
  std::size_t n = 0;
  for (int dy = -radius; dy <= radius; ++dy)
    for (int dx = -radius; dx <= radius; ++dx)
      for (const Bundle& bundle : bundles) {
        if (beyond(dx) * beyond(dx) + beyond(dy) * beyond(dy) <= range2) make(bundle, dx, dy, lines_[n]);
        ++n;
      }
  left_.resize(crossings_.size() + 8);  // read eight at a time
}

/// `line` stays empty where no normal of the bundle looks at the column.
void SightLines::make(const Bundle& bundle, int dx, int dy, Line& line) {
  const auto least = [&](int d, std::size_t axis) { return std::min(d * bundle.low[axis], d * bundle.high[axis]); };
  if (least(dx, 0) + least(dy, 1) >= -0.5) return;
  // The element's place, mirrored so that neither coordinate is negative.
  std::array<Limits, 2> c{};
  std::array<int, 2> sign{1, 1};
  for (const std::size_t axis : {0U, 1U}) {
    const int d = axis == 0 ? dx : dy;
    const double low = d + 0.5 * bundle.low[axis], high = d + 0.5 * bundle.high[axis];
    const bool negative = low < 0;
    sign[axis] = negative ? -1 : 1;
    c[axis] = negative ? Limits{std::abs(high), std::abs(low)} : Limits{std::abs(low), std::abs(high)};
  }
  const std::size_t lead = std::abs(dx) >= std::abs(dy) ? 0 : 1;
  made_.clear();
  for (int s = std::max(std::abs(dx), std::abs(dy)); s >= 0; --s) add_slab(c[lead], c[1 - lead], s);
  std::stable_partition(made_.begin(), made_.end(), [](const Made& made) { return made.must; });
  line.first = static_cast<std::uint32_t>(crossings_.size());
  line.count = static_cast<std::uint16_t>(made_.size());
  line.must = static_cast<std::uint16_t>(std::ranges::count_if(made_, &Made::must));
  for (const Made& made : made_) {
    const int x = lead == 0 ? made.lead : made.side, y = lead == 0 ? made.side : made.lead;
    crossings_.push_back({static_cast<std::int16_t>(sign[0] * x), static_cast<std::int16_t>(sign[1] * y)});
    const int left = ceil_to_int(kParts * (1 - made.in) + 1e-6) - 1;
    left_.push_back(static_cast<std::uint8_t>(std::clamp(left, 0, kParts - 1)));
  }
}

/// The columns at the place s along the leading axis.
void SightLines::add_slab(const Limits& lead, const Limits& side, int s) {
  const double in_may = std::max(0.0, (s - kHalf) / lead[1]), out_may = std::min(end_, (s + kHalf) / lead[0]);
  const double in_must = std::max(0.0, (s - kHalf) / lead[0]), out_must = (s + kHalf) / lead[1];
  if (in_may > out_may) return;
  const int first = std::max(0, ceil_to_int(in_may * side[0] - kHalf)), last = floor_to_int(out_may * side[1] + kHalf);
  const double level_end = 1 - (2 + kTouch) / std::sqrt(lead[0] * lead[0] + side[0] * side[0]);  // the shortest line's
  for (int w = first; w <= last; ++w) {
    const double enter = w > 0 ? (w - kHalf) / side[1] : 0, late = w > 0 ? (w - kHalf) / side[0] : 0;
    const double earliest = std::max(in_may, enter);
    if (earliest > std::min(out_may, (w + kHalf) / side[0])) continue;
    const double in = std::max(in_must, late), out = std::min(out_must, (w + kHalf) / side[1]);
    made_.push_back({s, w, earliest, in <= out && in <= level_end});
  }
}

}  // namespace backwash::field
