// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral_sweep.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "core/field/kernels.hpp"
#include "core/field/sight.hpp"

namespace backwash::field {
namespace {

constexpr double kInPlane = 1e-9;  // m: a point in an element's own plane does not see it, whatever the rounding
constexpr int kFar = 1000;         // layers: farther than anything in a window

/// A word moved up by n bits, down if n < 0; |n| ≥ 64 leaves nothing.
std::uint64_t moved(std::uint64_t word, int n) noexcept {
  if (n <= -64 || n >= 64) return 0;
  return n < 0 ? word >> -n : word << n;
}

}  // namespace

LateralSweep::LateralSweep(const LateralColumns& columns) : columns_(columns) {}

void LateralSweep::open(int x, int y, int height, int first_z) {
  const int r = columns_.radius_, rows = height + 2 * r, pitch = columns_.pitch_;
  const Index3& size = columns_.grid_->size();
  first_x_ = x - r, first_y_ = y - r, first_z_ = first_z;
  window_.assign(static_cast<std::size_t>(rows) * static_cast<std::size_t>(pitch), 0);
  for (int z = std::max(0, first_z - kBelow); z < std::min(size.z(), first_z + 128 - kBelow); ++z)
    for (int j = std::max(0, -first_y_); j < std::min(rows, size.y() - first_y_); ++j) {
      Layers* row = window_.data() + static_cast<std::ptrdiff_t>(j) * pitch;
      const int begin = std::max(0, -first_x_), end = std::min(pitch, size.x() - first_x_);
      const std::size_t cells = columns_.grid_->linear(Index3(0, first_y_ + j, z));
      for (int i = begin; i < end; ++i)
        if (columns_.grid_->at(cells + static_cast<std::size_t>(first_x_ + i)) == map::Cell::occupied)
          row[i] |= Layers{1} << (z - first_z + kBelow);
    }
}

void LateralSweep::add(int x, int y, std::uint64_t targets, LateralColumns::Sums& sums) {
  if (!targets) return;
  x_ = x, y_ = y;
  home_ = window_.data() + static_cast<std::ptrdiff_t>(y - first_y_) * columns_.pitch_ + (x - first_x_);
  line_ = nullptr;
  const int radius = columns_.radius_;
  const Index3& size = columns_.grid_->size();
  const int low = first_z_ + std::countr_zero(targets) - radius,
            high = first_z_ + 63 - std::countl_zero(targets) + radius;
  for (int row = std::max(0, y - radius); row <= std::min(size.y() - 1, y + radius); ++row) {
    const auto* column = columns_.column_first_.data() + static_cast<std::ptrdiff_t>(row) * size.x();
    const std::uint32_t first = column[std::max(0, x - radius)], end = column[std::min(size.x(), x + radius + 1)];
    if (near_.size() < end - first) near_.resize(end - first);
    std::size_t count = 0;
    const int dy = row - y;
    for (const ElementSegment* s = columns_.segments_.data() + first; s != columns_.segments_.data() + end; ++s) {
      const int dx = s->x - x;
      const double along = dx * s->m_x + dy * s->m_y;
      near_[count] = s;
      count += static_cast<std::size_t>((along < -0.5) & (dx * dx + dy * dy + 0.25 + along <= columns_.range2_) &
                                        (s->low <= high) & (s->high >= low));
    }
    for (std::size_t n = 0; n < count; ++n) add(*near_[n], targets, sums);
  }
}

/// The gates; false if no element has a term at a target.
bool LateralSweep::meet(const ElementSegment& segment, std::uint64_t targets, View& view) const noexcept {
  const int dx = segment.x - x_, dy = segment.y - y_;
  const double a = columns_.grid_->resolution(), a2 = a * a, along = dx * segment.m_x + dy * segment.m_y;
  const double flat2 = dx * dx + dy * dy + 0.25 + along;
  view.segment = &segment;
  view.d2 = a2 * flat2;
  if (-a * (along + 0.5) <= kInPlane || !columns_.terms_.in_wall_range(view.d2)) return false;
  static_cast<LateralColumns::Reach&>(view) = columns_.reach_of(flat2);
  view.first_up = 0, view.last_up = -1;
  if (segment.floor != LateralColumns::kNoFloor) add_corner(view);
  const bool corners = view.first_up <= view.last_up;
  const int z_low = segment.low - first_z_, z_high = segment.high - first_z_, floor = segment.floor - first_z_;
  const int up = corners ? view.range : 0, down = std::max(view.wall_range, up);
  int low = z_low - up, high = z_high + down;
  if (view.wall_range < 0) low = std::max(low, floor + view.first_up), high = std::min(high, floor + view.last_up);
  if (view.wall_range < 0 && !corners) return false;
  view.targets = targets & bits(low, high);
  view.with_corner = corners ? bits(floor + view.first_up, floor + view.last_up) : 0;
  if (!view.targets) return false;
  view.low = std::countr_zero(view.targets), view.high = 63 - std::countl_zero(view.targets);
  view.from = std::max(z_low, view.low - down), view.to = std::min(z_high, view.high + up);
  return view.from <= view.to;
}

/// The heights at which ProximityModel::corner_factor(d_c², h_c) may not be zero.
void LateralSweep::add_corner(View& view) const noexcept {
  const auto& k = columns_.model_.corner;
  const double a = columns_.grid_->resolution(), d = std::sqrt(view.d2);
  const double h2 = (k.l_max + 1e-6) * (k.l_max + 1e-6) - view.d2;
  if (h2 < 0) return;
  const double highest = std::sqrt(h2);
  const double least = k.phi_max < std::numbers::pi / 2 ? d * columns_.cot_phi_max_ : -highest;
  view.first_up = ceil_to_int(least / a + 0.5 - 1e-6), view.last_up = floor_to_int(highest / a + 0.5);
  const auto inside = [&](int up) {
    const double h = a * (up - 0.5);
    return columns_.terms_.in_corner_range(view.d2 + h * h);
  };
  while (view.first_up <= view.last_up && !inside(view.first_up)) ++view.first_up;
  while (view.first_up <= view.last_up && !inside(view.last_up)) --view.last_up;
}

/// Takes the columns in hand that the lines to a segment cross; those of the last segment often do.
void LateralSweep::look_along(const SightLines::Line& line) {
  if (line_ == &line) return;
  line_ = &line;
  const auto crossings = columns_.lines_.crossings(line);
  if (crossed_.size() < crossings.size()) crossed_.resize(crossings.size()), hiding_.resize(crossings.size());
  all_ = 0;
  for (std::size_t n = 0; n < crossings.size(); ++n)
    all_ |= crossed_[n] = home_[static_cast<std::ptrdiff_t>(crossings[n].y) * columns_.pitch_ + crossings[n].x];
}

/// The free heights that all crossed columns have in common; false if every element is hidden from every target.
bool LateralSweep::common_stretch(const View& view, FreeStretch& stretch) {
  const int low = std::min(view.low, view.from) + kBelow, high = std::max(view.high, view.to) + kBelow;
  const bool inside = low >= 0 && high <= 127;  // else all of it is uncertain
  stretch = inside ? FreeStretch{-kFar, kFar} : FreeStretch{0, 0};
  const Layers band = inside ? ~Layers{0} >> (127 - high + low) << low : ~Layers{0}, all = all_ & band;
  hiding_count_ = 0;
  if (all == 0) return true;
  for (std::size_t n = 0; inside && n < line_->must; ++n)
    if ((crossed_[n] & band) == band) return false;
  const auto crossings = columns_.lines_.crossings(*line_);
  for (std::size_t n = 0; n < crossings.size(); ++n) {
    hiding_[hiding_count_] = {crossings[n], crossed_[n]};
    hiding_count_ += (crossed_[n] & band) != 0 ? 1 : 0;
  }
  if (!inside) return true;
  const int middle = std::clamp((view.low + view.high) / 2, view.from, view.to) + kBelow;
  const auto highest_below = [](std::uint64_t upper, std::uint64_t lower) {
    return upper ? 127 - std::countl_zero(upper) : lower ? 63 - std::countl_zero(lower) : -kFar;
  };
  const Layers under = all & ((Layers{1} << middle) - 1), over = all >> middle << middle;
  const auto low_part = static_cast<std::uint64_t>(over), high_part = static_cast<std::uint64_t>(over >> 64);
  stretch.below = highest_below(static_cast<std::uint64_t>(under >> 64), static_cast<std::uint64_t>(under)) - kBelow;
  const int above = low_part ? std::countr_zero(low_part) : high_part ? 64 + std::countr_zero(high_part) : kFar;
  stretch.above = above - kBelow;
  return true;
}

void LateralSweep::add(const ElementSegment& segment, std::uint64_t targets, LateralColumns::Sums& sums) {
  View view;
  if (!meet(segment, targets, view)) return;
  look_along(columns_.lines_.at(segment.bundle, segment.x - x_, segment.y - y_));
  FreeStretch stretch;
  if (!common_stretch(view, stretch)) return;
  const double decay = std::exp(-columns_.model_.wall.k2 * view.d2);
  const auto &w = segment.wall, &c = segment.corner;
  const LateralTerms terms{{decay * w.xx, decay * w.xy, decay * w.yy, decay * w.zz},
                           {c.xx, c.xy, c.yy, c.zz},
                           columns_.grid_->resolution(),
                           view.d2,
                           columns_.model_.corner.phi_max,
                           segment.floor - first_z_};
  const LateralSums out{sums.xx.data(), sums.xy.data(), sums.yy.data(), sums.zz.data()};
  const std::uint64_t certain = bits(stretch.below + 1, stretch.above - 1);
  if (segment.low == segment.high) {  // most segments of crooked walls
    const int z = view.from;
    const bool inside = z > stretch.below && z < stretch.above;
    std::uint64_t seen = in_range(view, z);
    if (const std::uint64_t open = inside ? seen & ~certain : seen) seen = (seen & ~open) | seen_from(view, z, open);
    if (seen)
      add_element(terms, columns_.step_.data() + columns_.kLayers - z, seen & bits(z, z + view.wall_range),
                  seen & view.with_corner, out);
    return;
  }
  const int begin = view.low, end = view.high;
  std::fill(wall_.begin() + begin, wall_.begin() + end + 1, 0);
  std::fill(seen_.begin() + begin, seen_.begin() + end + 1, 0);
  const int from = std::max(view.from, stretch.below + 1), to = std::min(view.to, stretch.above - 1);
  const int first = std::max(begin, stretch.below + 1), last = std::min(end, stretch.above - 1);
  if (from <= to)
    see_stack({from, to, view.wall_range, view.range, columns_.decay_.data()}, first, last, wall_.data(), seen_.data());
  if (from > view.from || to < view.to || first > begin || last < end) add_uncertain(view, stretch);
  add_stack(terms, begin, end, view.with_corner, wall_.data(), seen_.data(), out);
}

/// Targets at which the gates leave a term of the element at height z.
std::uint64_t LateralSweep::in_range(const View& view, int z) noexcept {
  return view.targets & (bits(z, z + view.wall_range) | (view.with_corner & bits(z - view.range, z + view.range)));
}

/// Adds to wall_ and seen_ what does not lie in the common stretch of free heights at both ends.
void LateralSweep::add_uncertain(const View& view, const FreeStretch& stretch) noexcept {
  const std::uint64_t certain = bits(stretch.below + 1, stretch.above - 1);
  for (int z = view.from; z <= view.to; ++z) {
    std::uint64_t lanes = in_range(view, z);
    if (z > stretch.below && z < stretch.above) lanes &= ~certain;
    if (!lanes) continue;
    for (lanes = seen_from(view, z, lanes); lanes; lanes &= lanes - 1) {
      const int n = std::countr_zero(lanes);
      const auto at = static_cast<std::size_t>(n);
      if (n >= z && n - z <= view.wall_range)
        wall_[at] += columns_.step_[static_cast<std::size_t>(n - z + columns_.kLayers)];
      seen_[at] += 1;
    }
  }
}

/// Those of `targets` that see the element at height z.
std::uint64_t LateralSweep::seen_from(const View& view, int z, std::uint64_t targets) const noexcept {
  // Words about the element: bit kCentre is its own layer.
  constexpr int kCentre = LineFromAbove::kCentre;
  const int up = kCentre - z, down = z - kCentre + kBelow;
  std::uint64_t open = moved(targets, up);
  if (moved(open, -up) != targets) return looked_at(view, z, targets);
  const int low = std::min(std::countr_zero(open), kCentre), high = std::max(63 - std::countl_zero(open), kCentre);
  const std::uint64_t band = bits(low, high);
  const ElementSegment& s = *view.segment;
  LineFromAbove line(s.x - x_ + 0.5 * s.m_x, s.y - y_ + 0.5 * s.m_y, view.range);
  for (const auto& [crossing, column] : std::span(hiding_).first(hiding_count_)) {
    std::uint64_t inside = static_cast<std::uint64_t>(down >= 0 ? column >> down : column << -down) & band;
    if (!inside || !line.cross(crossing)) continue;
    while (inside) {
      const int first = std::countr_zero(inside), last = first + std::countr_one(inside >> first) - 1;
      inside &= ~bits(first, last);
      open &= ~line.hidden(first - kCentre, last - kCentre);
    }
    if (!open) return 0;
  }
  return moved(open, -up);
}

/// As seen_from(), line by line.
std::uint64_t LateralSweep::looked_at(const View& view, int z, std::uint64_t targets) const noexcept {
  const ElementSegment& s = *view.segment;
  const auto& grid = *columns_.grid_;
  const Vec3 c_W = grid.center(Index3(s.x, s.y, first_z_ + z)) + 0.5 * grid.resolution() * Vec3(s.m_x, s.m_y, 0);
  std::uint64_t seen = targets;
  for (; targets; targets &= targets - 1) {
    const Vec3 p_W = grid.center(Index3(x_, y_, first_z_ + std::countr_zero(targets)));
    if (!columns_.sight_.line_of_sight(columns_.sight_.viewpoint(p_W), c_W)) seen &= ~(targets & -targets);
  }
  return seen;
}

}  // namespace backwash::field
