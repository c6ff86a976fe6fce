// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/lateral_columns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include "core/field/lateral/lateral_kernels.hpp"
#include "core/field/sight/sight.hpp"
#include "core/field/surface.hpp"

namespace backwash::field {
namespace {

using Direction = std::pair<double, double>;  ///< m_x, m_y: equal in every bit for one direction

/// Number of the equal sector of the circle that holds a direction; `sectors` is a multiple of 4, so that no component
/// changes sign within one.
int sector_of(double m_x, double m_y, int sectors) {
  const double turn = std::atan2(m_y, m_x) / (2 * std::numbers::pi) + 0.5;
  return std::min(static_cast<int>(turn * sectors), sectors - 1);
}

}  // namespace

LateralColumns::LateralColumns(const map::OccupancyGrid& grid, const Model& model)
    : grid_(&grid),
      model_(model),
      terms_(model, grid.resolution()),
      range2_(std::pow(model.wall.l_max / grid.resolution() + 1e-6, 2)),
      radius_(static_cast<int>(model.wall.l_max / grid.resolution() + 0.5 + 1e-6) + 1),
      pitch_(kWindow + 2 * radius_),
      lines_((add_segments(), bundle_normals()), radius_, range2_) {  // of the segments' normals
  if (model.wall.l_max / grid.resolution() > kCentre) sight_.emplace(grid);
  add_arrays();
  add_tables();
}

void LateralColumns::add_segments() {
  struct Piece {
    int y, x, sector;
    Direction direction;
    int z, floor;
    Vec3 normal;
    double area;
    auto key() const { return std::tie(y, x, sector, direction, z); }
  };
  const double a = grid_->resolution();
  std::vector<Piece> pieces;
  for (const Element& e : surface_elements(*grid_)) {
    if (e.kind != Element::Kind::lateral) continue;
    const Index3 v = grid_->index(e.c_W - 0.5 * a * e.normal);
    const int floor =
        e.corner_W ? static_cast<int>(std::lround((e.corner_W->z() - grid_->origin().z()) / a)) - 1 : kNoFloor;
    const int sector = sector_of(e.normal.x(), e.normal.y(), kSectors);
    pieces.push_back({v.y(), v.x(), sector, {e.normal.x(), e.normal.y()}, v.z(), floor, e.normal, e.area});
  }
  std::ranges::sort(pieces, [](const Piece& p, const Piece& q) { return p.key() < q.key(); });
  const auto nx = static_cast<std::size_t>(grid_->size().x()), ny = static_cast<std::size_t>(grid_->size().y());
  column_first_.assign(nx * ny + 1, 0);
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    const Piece& p = pieces[n];
    if (n > 0) {
      const Piece& q = pieces[n - 1];
      const bool above = std::tie(p.y, p.x, p.direction, p.floor) == std::tie(q.y, q.x, q.direction, q.floor);
      if (above && p.z == q.z + 1) {
        segments_.back().high = static_cast<std::int16_t>(p.z);
        continue;
      }
    }
    const auto about = [&](const auto& k) {
      const Variance t = p.area * Variance::about_normal(p.normal, k.normal, k.tangential, k.vertical);
      return Tensor{static_cast<float>(t.xx), static_cast<float>(t.xy), static_cast<float>(t.yy),
                    static_cast<float>(t.zz)};
    };
    const auto z = static_cast<std::int16_t>(p.z), floor = static_cast<std::int16_t>(p.floor);
    segments_.push_back({p.normal.x(), p.normal.y(), about(model_.wall.k1), about(model_.corner.lambda), p.x, p.y, z, z,
                         floor, static_cast<std::int16_t>(p.sector)});
    ++column_first_[static_cast<std::size_t>(p.y) * nx + static_cast<std::size_t>(p.x) + 1];
  }
  for (std::size_t n = 1; n < column_first_.size(); ++n) column_first_[n] += column_first_[n - 1];
}

/// The normals of each sector of the circle that has any; segments, numbered by sectors, get the numbers of bundles.
std::vector<SightLines::Bundle> LateralColumns::bundle_normals() {
  std::map<std::int16_t, SightLines::Bundle> of_sector;
  for (const ElementSegment& s : segments_) {
    auto& [low, high] =
        of_sector.try_emplace(s.bundle, SightLines::Bundle{{s.m_x, s.m_y}, {s.m_x, s.m_y}}).first->second;
    low = {std::min(low[0], s.m_x), std::min(low[1], s.m_y)};
    high = {std::max(high[0], s.m_x), std::max(high[1], s.m_y)};
  }
  std::vector<SightLines::Bundle> bundles;
  std::array<std::int16_t, kSectors> number{};
  for (const auto& [sector, bundle] : of_sector) {
    number[static_cast<std::size_t>(sector)] = static_cast<std::int16_t>(bundles.size());
    bundles.push_back(bundle);
  }
  for (ElementSegment& s : segments_) s.bundle = number[static_cast<std::size_t>(s.bundle)];
  return bundles;
}

/// What the kernels read of the segments; a vector more than there are.
void LateralColumns::add_arrays() {
  constexpr std::size_t kLanes = 16;
  const std::size_t count = segments_.size() + kLanes;
  x_.assign(count, 0);
  low_ = high_ = x_;
  m_x_.assign(count, 0);
  m_y_ = m_x_;
  for (std::size_t n = 0; n < segments_.size(); ++n) {
    const ElementSegment& s = segments_[n];
    x_[n] = s.x;
    low_[n] = s.low;
    high_[n] = s.high;
    m_x_[n] = static_cast<float>(s.m_x);
    m_y_[n] = static_cast<float>(s.m_y);
  }
}

void LateralColumns::add_tables() {
  for (const ColumnOffset& column : lines_.crossings()) places_.push_back(column.y * pitch_ + column.x);
  const double a = grid_->resolution(), a2 = a * a;
  for (int n = 0; n <= radius_ + 1; ++n) {
    step_.push_back(std::exp(-model_.wall.k2 * a2 * n * n));
    const auto gate = terms_.wall_gate(-a * n);
    wall_low_.push_back(gate.low <= gate.high ? gate.low - a2 * n * n : std::numeric_limits<double>::infinity());
  }
  for (int dy = 0; dy <= radius_; ++dy) {
    const double beyond = std::max(0.0, dy - 0.5), left = range2_ - beyond * beyond;
    half_width_.push_back(left < 0 ? -1 : std::min(radius_, static_cast<int>(std::sqrt(left) + 0.5)));
  }
  below_.resize(kLayers);
  above_.resize(kLayers);
  for (int n = 0; n < kLayers; ++n)
    for (int part = 0; part < SightLines::kParts; ++part) {
      const double highest = n * (part + 1.0) / SightLines::kParts + 0.5 + kTouch;
      const auto up = static_cast<std::size_t>(n), at = static_cast<std::size_t>(part);
      below_[up][at] = bits(kCentre - floor_to_int(highest), 63);
      above_[up][at] = bits(0, kCentre + floor_to_int(highest));
    }
  corner_l2_ = std::pow((model_.corner.l_max + 1e-9) / a, 2);
  const double phi_max = model_.corner.phi_max;
  cot_phi_max_ = phi_max < std::numbers::pi / 2 ? 1 / std::tan(phi_max) : 0;
  const auto count = static_cast<std::size_t>((range2_ + 1) * kCells);
  for (std::size_t n = 0; n < count; ++n) {
    const double low = static_cast<double>(n) / kCells, high = static_cast<double>(n + 1) / kCells;
    // Each bound changes in one sense.
    reaches_.push_back({exact_reach(low), bounds_of(low) == bounds_of(high)});
  }
}

/// Reach before the wall's range and the corner's heights are cut to the others.
LateralColumns::Reach LateralColumns::bounds_of(double flat2) const noexcept {
  const double a = grid_->resolution(), d2 = a * a * flat2;
  const auto root = [](double x) { return x < 0 ? -1.0 : std::sqrt(x); };
  const double longest = (model_.wall.l_max + 1e-9) / a, highest = root(corner_l2_ - flat2);
  int wall = -1;
  while (wall + 1 < static_cast<int>(wall_low_.size()) && wall_low_[static_cast<std::size_t>(wall + 1)] <= d2) ++wall;
  const double least = model_.corner.phi_max < std::numbers::pi / 2 ? std::sqrt(flat2) * cot_phi_max_ : -1e4;
  const auto number = [](int n) { return static_cast<std::int16_t>(std::clamp(n, -10000, 10000)); };
  return {number(floor_to_int(root(longest * longest - flat2))), number(wall),
          number(std::max(ceil_to_int(least + 0.5 - 1e-6), ceil_to_int(0.5 - highest))),
          number(floor_to_int(highest + 0.5))};
}

LateralColumns::Reach LateralColumns::exact_reach(double flat2) const noexcept {
  Reach reach = bounds_of(flat2);
  reach.wall_range = std::min(reach.wall_range, reach.range);
  if (corner_l2_ < flat2 || reach.range < 0) {
    reach.first_up = 0;
    reach.last_up = -1;
  }
  return reach;
}

}  // namespace backwash::field
