// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/sight_lines.hpp"

#include <algorithm>
#include <cmath>

#include "core/field/sight.hpp"

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
  std::stable_partition(made_.begin(), made_.end(), [](const Crossing& made) { return made.must; });
  line.first = static_cast<std::uint32_t>(crossings_.size());
  line.count = static_cast<std::uint16_t>(made_.size());
  line.must = static_cast<std::uint16_t>(std::ranges::count_if(made_, &Crossing::must));
  for (const Crossing& crossing : made_) {
    const int x = lead == 0 ? crossing.lead : crossing.side, y = lead == 0 ? crossing.side : crossing.lead;
    crossings_.push_back({static_cast<std::int16_t>(sign[0] * x), static_cast<std::int16_t>(sign[1] * y)});
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
    if (std::max(in_may, enter) > std::min(out_may, (w + kHalf) / side[0])) continue;
    const double in = std::max(in_must, late), out = std::min(out_must, (w + kHalf) / side[1]);
    made_.push_back({s, w, in <= out && in <= level_end});
  }
}

LineFromAbove::LineFromAbove(double c_x, double c_y, int range) noexcept
    : per_x_(1 / c_x), per_y_(1 / c_y), flat2_(c_x * c_x + c_y * c_y) {
  flat_ = std::sqrt(flat2_);
  end_ = 1 - 2 / std::max(2.0, std::sqrt(flat2_ + range * range));
}

bool LineFromAbove::cross(const ColumnOffset& column) noexcept {
  const double x0 = (column.x - kHalf) * per_x_, x1 = (column.x + kHalf) * per_x_;
  const double y0 = (column.y - kHalf) * per_y_, y1 = (column.y + kHalf) * per_y_;
  const double in = std::max({0.0, std::min(x0, x1), std::min(y0, y1)});
  const double out = std::min({end_, std::max(x0, x1), std::max(y0, y1)});
  if (in > out) return false;
  far_ = 1 / (1 - in), near_ = 1 / (1 - out);
  const double least = 2 * std::max(1 + 0.5 * kTouch, far_);  // length of a line that is longer than 2 beyond `in`
  gap_ = least <= flat_ ? 0 : ceil_to_int(std::sqrt(least * least - flat2_));
  return true;
}

std::uint64_t LineFromAbove::hidden(int low, int high) const noexcept {
  // From y ≤ kEnds[h] · flat_ the last 2 voxel edges begin below the top of the voxel h.
  constexpr auto reach = [](double top) { return top / std::sqrt(4 - top * top); };
  static const std::array<double, 2> kEnds{reach(kHalf), reach(1 + kHalf)};
  const double bottom = low - kHalf, top = high + kHalf;
  int first = ceil_to_int(bottom * (bottom > 0 ? far_ : near_)), last = floor_to_int(top * (top < 0 ? far_ : near_));
  if (low == 0 || low == -1) first = std::max(first, -floor_to_int(flat_ * kEnds[static_cast<std::size_t>(-low)]));
  if (high == 0 || high == 1) last = std::min(last, floor_to_int(flat_ * kEnds[static_cast<std::size_t>(high)]));
  return bits(kCentre + first, kCentre + last) & ~bits(kCentre - gap_ + 1, kCentre + gap_ - 1);
}

}  // namespace backwash::field
