// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral_columns.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

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
      sight_(grid),
      range2_(std::pow(model.wall.l_max / grid.resolution() + 1e-6, 2)),
      radius_(static_cast<int>(model.wall.l_max / grid.resolution() + 0.5 + 1e-6) + 1),
      pitch_(kWindow + 2 * radius_),
      lines_((add_segments(), bundle_normals()), radius_, range2_) {  // of the segments' normals
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

void LateralColumns::add_tables() {
  constexpr double kSteps = 0x1p40;
  const double a = grid_->resolution(), a2 = a * a;
  decay_.push_back(0);
  step_.assign(kLayers, 0);
  for (int n = 0; n <= radius_ + 1; ++n) {
    step_.push_back(std::round(kSteps * std::exp(-model_.wall.k2 * a2 * n * n)) / kSteps);
    decay_.push_back(decay_.back() + step_.back());
    const auto gate = terms_.wall_gate(-a * n);
    wall_low_.push_back(gate.low - a2 * n * n), wall_high_.push_back(gate.high - a2 * n * n);
  }
  step_.resize(step_.size() + kLayers, 0);
  const double phi_max = model_.corner.phi_max;
  cot_phi_max_ = phi_max < std::numbers::pi / 2 ? 1 / std::tan(phi_max) : 0;
  const auto count = static_cast<std::size_t>(range2_) + 2;
  least_reach_.assign(count, {-1, -1});
  std::vector<Reach> at(count + 1);
  for (std::size_t n = 0; n <= count; ++n) at[n] = reach_of(static_cast<double>(n));
  for (std::size_t n = 0; n < count; ++n)
    least_reach_[n] = {std::min(at[n].range, at[n + 1].range), std::min(at[n].wall_range, at[n + 1].wall_range)};
}

}  // namespace backwash::field
