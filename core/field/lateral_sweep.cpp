// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "core/field/kernels.hpp"
#include "core/field/lateral_columns.hpp"
#include "core/field/sight.hpp"

namespace backwash::field {
namespace {

constexpr double kInPlane = 1e-9;  // m: a point in an element's own plane does not see it, whatever the rounding

/// Bits low … high of a word; none if low > high or all are outside it.
std::uint64_t bits(int low, int high) noexcept {
  low = std::max(low, 0), high = std::min(high, 63);
  return low > high ? 0 : ~std::uint64_t{0} >> (63 - high + low) << low;
}

int ceil_to_int(double x) noexcept { return -floor_to_int(-x); }

}  // namespace

LateralSweep::LateralSweep(const LateralColumns& columns)
    : columns_(columns),
      width_(2 * columns.radius_ + 1),
      lines_(static_cast<std::size_t>(LateralColumns::kFrequent * width_ * width_)) {}

void LateralSweep::add(int x, int y, int first_z, std::uint64_t targets, LateralColumns::Sums& sums) {
  if (!targets) return;
  const View view{
      x, y, first_z, targets, first_z + std::countr_zero(targets), first_z + 63 - std::countl_zero(targets)};
  const int radius = columns_.radius_, rows = columns_.grid_->size().y();
  for (int row = std::max(0, y - radius); row <= std::min(rows - 1, y + radius); ++row) {
    const auto first = columns_.segments_.begin() + columns_.row_first_[static_cast<std::size_t>(row)];
    const auto last = columns_.segments_.begin() + columns_.row_first_[static_cast<std::size_t>(row) + 1];
    for (auto s = std::lower_bound(first, last, x - radius, [](const Segment&t, int v) { return t.x < v; });
         s != last && s->x <= x + radius; ++s) {
      if (s->low > view.high + radius || s->high < view.low - radius) continue;
      add(view, *s, row - y, sums);
    }
  }
}

LateralSweep::Line& LateralSweep::line(const Segment& segment, int dx, int dy) {
  if (segment.normal < 0) {
    make(other_, segment, dx, dy);
    return other_;
  }
  const int place = (segment.normal * width_ + dy + columns_.radius_) * width_ + dx + columns_.radius_;
  Line& kept = lines_[static_cast<std::size_t>(place)];
  if (!kept.made) make(kept, segment, dx, dy);
  return kept;
}

void LateralSweep::make(Line& line, const Segment& segment, int dx, int dy) const {
  const double a = columns_.grid_->resolution(), a2 = a * a;
  const double along = dx * segment.m_x + dy * segment.m_y;
  line.made = true;
  line.flat2 = dx * dx + dy * dy + 0.25 + along;
  line.d2 = a2 * line.flat2;
  line.in_range = -a * (along + 0.5) > kInPlane && columns_.terms_.in_wall_range(line.d2);
  if (!line.in_range) return;
  line.range = 0;
  while (columns_.terms_.in_wall_range(line.d2 + a2 * (line.range + 1) * (line.range + 1))) ++line.range;
  line.wall_range = -1;
  for (std::size_t n = 0; n < columns_.wall_low_.size(); ++n) {
    if (line.d2 < columns_.wall_low_[n] || line.d2 > columns_.wall_high_[n]) break;
    line.wall_range = static_cast<int>(n);
  }
  line.decay = std::exp(-columns_.model_.wall.k2 * line.d2);
  line.corner.clear();
  if (segment.normal >= 0 || segment.floor != LateralColumns::kNoFloor) add_corner(line);
  line.crossed = false;
}

/// The factors of ProximityModel::corner_factor(d_c², h_c) at the heights where they are not zero.
void LateralSweep::add_corner(Line& line) const {
  const auto& k = columns_.model_.corner;
  const double a = columns_.grid_->resolution(), d = std::sqrt(line.d2);
  const double h2 = (k.l_max + 1e-6) * (k.l_max + 1e-6) - line.d2;
  if (h2 < 0) return;
  const double highest = std::sqrt(h2), pi = std::numbers::pi;
  const double least = k.phi_max < pi / 2 ? d / std::tan(k.phi_max) : -highest;
  line.corner_low = ceil_to_int(least / a + 0.5 - 1e-6);
  const int last = floor_to_int(highest / a + 0.5);
  const auto sixth = [](double x) { return x * x * x * x * x * x; };
  for (int up = line.corner_low; up <= last; ++up) {
    const double h = a * (up - 0.5), height = std::abs(h);
    const double at = (d - height) / (d + height) * 2048 + 2048;
    const auto n = static_cast<std::size_t>(at);
    const double acute = columns_.arc_[n] + (at - static_cast<double>(n)) * (columns_.arc_[n + 1] - columns_.arc_[n]);
    const double phi = h > 0 ? acute : pi - acute;
    const bool inside = columns_.terms_.in_corner_range(line.d2 + h * h) && phi < k.phi_max;
    line.corner.push_back(inside ? (k.phi_max - phi) / std::max(line.d2 + sixth(h), sixth(0.5 * a)) : 0);
  }
}

/// Columns of closed boxes that the line to c meets before its last 2 voxel edges, for the farthest element.
void LateralSweep::add_crossings(Line& line, double c_x, double c_y, int dx, int dy) const {
  line.crossings.clear();
  const double longest = std::sqrt(line.flat2 + line.range * line.range);
  if (longest <= 2 + kTouch) return;
  const double end = 1 - 2 / longest;
  const bool x_leads = std::abs(dx) >= std::abs(dy);
  const double lead = x_leads ? c_x : c_y, side = x_leads ? c_y : c_x;
  const int slabs = std::abs(x_leads ? dx : dy), along = lead < 0 ? -1 : 1;
  const double per_size = 1 / std::abs(lead), per_side = side != 0 ? 1 / side : 0, half = 0.5 + kTouch;
  for (int s = 0; s <= slabs; ++s) {
    const double t0 = std::max(0.0, (s - half) * per_size), t1 = std::min(end, (s + half) * per_size);
    if (t0 > t1) break;
    const int low = ceil_to_int(std::min(t0 * side, t1 * side) - half);
    const int high = floor_to_int(std::max(t0 * side, t1 * side) + half);
    for (int w = low; w <= high; ++w) {
      double in = t0, out = t1;
      if (side != 0) {
        const double first = (w - half) * per_side, second = (w + half) * per_side;
        in = std::max(in, std::min(first, second)), out = std::min(out, std::max(first, second));
      }
      if (in > out) continue;
      const int x = x_leads ? along * s : w, y = x_leads ? w : along * s;
      line.crossings.push_back({x, y, static_cast<std::ptrdiff_t>(y) * columns_.grid_->size().x() + x, in, out});
    }
  }
}

/// Whether the box about all lines of sight from the view to the segment is empty.
bool LateralSweep::surely_clear(const View& view, const Segment& segment, const Line& line, int dx,
                                int dy) const noexcept {
  const int corners = segment.floor == LateralColumns::kNoFloor ? 0 : static_cast<int>(line.corner.size());
  const int down = corners ? line.range : line.wall_range, up = corners ? line.range : 0;
  const double share = std::max(0.0, 1 - 2 / std::sqrt(line.flat2 + line.range * line.range));
  const double x = view.x + 0.5, y = view.y + 0.5;
  const double to_x = x + share * (dx + 0.5 * segment.m_x), to_y = y + share * (dy + 0.5 * segment.m_y);
  const int low = std::min(view.low, std::max(segment.low, view.low - down));
  const int high = std::max(view.high, std::min(segment.high, view.high + up));
  return columns_.sight_.empty(Vec3(std::min(x, to_x), std::min(y, to_y), low + 0.5),
                               Vec3(std::max(x, to_x), std::max(y, to_y), high + 0.5));
}

LateralColumns::Stretch LateralSweep::common_stretch(const View& view, const Line& line, int z) const noexcept {
  const Index3& size = columns_.grid_->size();
  const auto home = static_cast<std::ptrdiff_t>(columns_.column(view.x, view.y));
  const auto* layer = columns_.stretches_.data() + columns_.grid_->linear(Index3(0, 0, z));
  LateralColumns::Stretch common{INT16_MIN, INT16_MAX};
  for (const Crossing& c : line.crossings) {
    if (static_cast<unsigned>(view.x + c.dx) >= static_cast<unsigned>(size.x()) ||
        static_cast<unsigned>(view.y + c.dy) >= static_cast<unsigned>(size.y()))
      continue;
    const auto& here = layer[home + c.column];
    common.below = std::max(common.below, here.below), common.above = std::min(common.above, here.above);
  }
  return common;
}

void LateralSweep::add(const View& view, const Segment& segment, int dy, LateralColumns::Sums& sums) {
  const int dx = segment.x - view.x;
  const double along = dx * segment.m_x + dy * segment.m_y;
  if (along >= -0.5 || dx * dx + dy * dy + 0.25 + along > columns_.range2_) return;  // behind it, or too far away
  Line& l = line(segment, dx, dy);
  if (!l.in_range) return;
  const int corners = segment.floor == LateralColumns::kNoFloor ? 0 : static_cast<int>(l.corner.size());
  const int corner_low = segment.floor + l.corner_low, corner_high = corner_low + corners - 1;
  // Layers whose voxels may have a term.
  int low = std::max(view.low, segment.low - (corners ? l.range : 0));
  int high = std::min(view.high, segment.high + std::max(l.wall_range, corners ? l.range : 0));
  if (l.wall_range < 0) low = std::max(low, corner_low), high = std::min(high, corner_high);
  if (low > high || (l.wall_range < 0 && !corners)) return;
  View part = view;
  part.targets &= bits(low - view.first_z, high - view.first_z);
  if (!part.targets) return;
  part.low = view.first_z + std::countr_zero(part.targets),
  part.high = view.first_z + 63 - std::countl_zero(part.targets);

  const bool clear = surely_clear(part, segment, l, dx, dy);
  if (!clear && !l.crossed) {
    add_crossings(l, dx + 0.5 * segment.m_x, dy + 0.5 * segment.m_y, dx, dy);
    l.crossed = true;
  }
  const int middle = std::clamp((part.low + part.high) / 2, segment.low, segment.high);
  const auto stretch = clear ? LateralColumns::Stretch{INT16_MIN, INT16_MAX} : common_stretch(part, l, middle);
  const int from = std::max<int>(segment.low, stretch.below + 1), to = std::min<int>(segment.high, stretch.above - 1);
  const int first = std::max<int>(part.low, stretch.below + 1), last = std::min<int>(part.high, stretch.above - 1);
  const int z0 = view.first_z;
  const int begin = part.low - z0, end = part.high - z0;
  std::fill(wall_.begin() + begin, wall_.begin() + end + 1, 0),
      std::fill(seen_.begin() + begin, seen_.begin() + end + 1, 0);
  if (from <= to)
    see_stack({from - z0, to - z0, l.wall_range, l.range, columns_.decay_.data()}, first - z0, last - z0, wall_.data(),
              seen_.data());
  const int down = corners ? l.range : l.wall_range, up = corners ? l.range : 0;  // to the elements
  const int lowest = std::min(part.low, std::max(segment.low, part.low - down));
  const int highest = std::max(part.high, std::min(segment.high, part.high + up));
  if (stretch.below >= lowest || stretch.above <= highest) add_uncertain(part, segment, l, stretch);

  const auto &w = segment.wall, &c = segment.corner;
  const int corner_begin = std::clamp(corner_low - z0, begin, end + 1);
  const int corner_end = std::clamp(corner_high - z0 + 1, corner_begin, end + 1);
  std::fill(seen_.begin() + begin, seen_.begin() + corner_begin, 0);
  std::fill(seen_.begin() + corner_end, seen_.begin() + end + 1, 0);
  for (int n = corner_begin; n < corner_end; ++n)
    seen_[static_cast<std::size_t>(n)] *= l.corner[static_cast<std::size_t>(n - (corner_low - z0))];
  add_terms({l.decay * w.xx, l.decay * w.xy, l.decay * w.yy, l.decay * w.zz}, {c.xx, c.xy, c.yy, c.zz}, wall_.data(),
            seen_.data(), begin, end, sums.xx.data(), sums.xy.data(), sums.yy.data(), sums.zz.data());
}

/// Adds to wall_ and seen_ what does not lie in the common stretch of free heights at both ends.
void LateralSweep::add_uncertain(const View& view, const Segment& segment, const Line& line,
                                 const LateralColumns::Stretch& stretch) {
  const Index3& size = columns_.grid_->size();
  const auto home = static_cast<std::ptrdiff_t>(columns_.column(view.x, view.y));
  const int corners = segment.floor == LateralColumns::kNoFloor ? 0 : static_cast<int>(line.corner.size());
  const int down = corners ? line.range : line.wall_range, up = corners ? line.range : 0;  // to the elements
  const int low = std::min(view.low, std::max(segment.low, view.low - down));
  const int high = std::max(view.high, std::min(segment.high, view.high + up));
  const auto* layer = columns_.stretches_.data() + columns_.grid_->linear(Index3(0, 0, low));
  active_.clear();
  for (const Crossing& c : line.crossings) {
    if (static_cast<unsigned>(view.x + c.dx) >= static_cast<unsigned>(size.x()) ||
        static_cast<unsigned>(view.y + c.dy) >= static_cast<unsigned>(size.y()))
      continue;
    if (layer[home + c.column].above <= high) active_.push_back(c);
  }
  const int z0 = view.first_z;
  const int corner_low = segment.floor + line.corner_low - z0;
  const std::uint64_t with_corner = corners ? bits(corner_low, corner_low + corners - 1) : 0;
  const auto free = [&](int dz) { return bits(stretch.below + 1 - dz - z0, stretch.above - 1 - dz - z0); };
  const int dz_end = std::min(up, segment.high - view.low);
  for (int dz = std::max(-down, segment.low - view.high); dz <= dz_end; ++dz) {
    std::uint64_t lanes = view.targets & bits(segment.low - dz - z0, segment.high - dz - z0) & ~(free(0) & free(dz));
    const bool has_wall = dz <= 0 && -dz <= line.wall_range;
    if (!has_wall) lanes &= with_corner;
    if (!lanes) continue;
    lanes &= ~blocked(view, line, dz, lanes);
    const double decay =
        has_wall ? columns_.decay_[static_cast<std::size_t>(1 - dz)] - columns_.decay_[static_cast<std::size_t>(-dz)]
                 : 0;
    for (; lanes; lanes &= lanes - 1) {
      const auto n = static_cast<std::size_t>(std::countr_zero(lanes));
      wall_[n] += decay, seen_[n] += 1;
    }
  }
}

/// Lanes whose line to the element dz voxels higher meets an occupied voxel of the active columns; some of them only,
/// when all of `lanes` are among them.
std::uint64_t LateralSweep::blocked(const View& view, const Line& line, int dz, std::uint64_t lanes) const noexcept {
  const double length = std::sqrt(line.flat2 + dz * dz), end = 1 - 2 / length, half = 0.5 + kTouch;
  if (length <= 2 + kTouch) return 0;
  const auto home = static_cast<std::ptrdiff_t>(columns_.column(view.x, view.y));
  const int lowest = -64, highest = columns_.grid_->size().z();
  std::uint64_t met = 0;
  for (std::size_t n = active_.size(); n-- > 0;) {  // what hides an element is most often near it
    const Crossing& c = active_[n];
    if (c.t_in > end) continue;
    const double in = dz * c.t_in, out = dz * std::min(c.t_out, end);
    const int first = ceil_to_int(std::min(in, out) - half), last = floor_to_int(std::max(in, out) + half);
    for (int s = first; s <= last; ++s) {
      const int z = view.first_z + s;
      if (z >= lowest && z <= highest) met |= columns_.occupied(static_cast<std::size_t>(home + c.column), z);
    }
    if ((lanes & ~met) == 0) break;
  }
  return met;
}

}  // namespace backwash::field
