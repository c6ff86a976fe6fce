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

}  // namespace

LateralColumns::LateralColumns(const map::OccupancyGrid& grid, const Model& model)
    : grid_(&grid),
      model_(model),
      terms_(model, grid.resolution()),
      sight_(grid),
      range2_(std::pow(model.wall.l_max / grid.resolution() + 1e-6, 2)),
      radius_(static_cast<int>(model.wall.l_max / grid.resolution() + 0.5 + 1e-6) + 1),
      words_((static_cast<std::size_t>(grid.size().z()) + 63) / 64 + 3) {
  add_segments();
  number_normals();
  add_columns();
  add_tables();
}

void LateralColumns::add_segments() {
  struct Piece {
    int y, x;
    Direction direction;
    int z, floor;
    Vec3 normal;
    double area;
    auto key() const { return std::tie(y, x, direction, z); }
  };
  const double a = grid_->resolution();
  std::vector<Piece> pieces;
  for (const Element& e : surface_elements(*grid_)) {
    if (e.kind != Element::Kind::lateral) continue;
    const Index3 v = grid_->index(e.c_W - 0.5 * a * e.normal);
    const int floor =
        e.corner_W ? static_cast<int>(std::lround((e.corner_W->z() - grid_->origin().z()) / a)) - 1 : kNoFloor;
    pieces.push_back({v.y(), v.x(), {e.normal.x(), e.normal.y()}, v.z(), floor, e.normal, e.area});
  }
  std::ranges::sort(pieces, [](const Piece& p, const Piece& q) { return p.key() < q.key(); });
  row_first_.assign(static_cast<std::size_t>(grid_->size().y()) + 1, 0);
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    const Piece& p = pieces[n];
    if (n > 0) {
      const Piece& q = pieces[n - 1];
      const bool above = std::tie(p.y, p.x, p.direction, p.floor) == std::tie(q.y, q.x, q.direction, q.floor);
      if (above && p.z == q.z + 1) {
        segments_.back().high = p.z;
        continue;
      }
    }
    const auto about = [&](const auto& k) {
      const Variance t = p.area * Variance::about_normal(p.normal, k.normal, k.tangential, k.vertical);
      return Tensor{t.xx, t.xy, t.yy, t.zz};
    };
    segments_.push_back(
        {p.x, p.z, p.z, p.floor, -1, p.normal.x(), p.normal.y(), about(model_.wall.k1), about(model_.corner.lambda)});
    ++row_first_[static_cast<std::size_t>(p.y) + 1];
  }
  for (std::size_t y = 1; y < row_first_.size(); ++y) row_first_[y] += row_first_[y - 1];
}

void LateralColumns::number_normals() {
  std::map<Direction, int> count;
  for (const Segment& s : segments_) ++count[{s.m_x, s.m_y}];
  std::vector<std::pair<int, Direction>> frequent;
  for (const auto& [normal, n] : count) frequent.emplace_back(-n, normal);
  std::ranges::sort(frequent);
  std::map<Direction, int> number;
  for (const auto& [n, normal] : frequent)
    if (number.size() < kFrequent) number.emplace(normal, static_cast<int>(number.size()));
  for (Segment& s : segments_)
    if (const auto found = number.find({s.m_x, s.m_y}); found != number.end()) s.normal = found->second;
}

void LateralColumns::add_columns() {
  const Index3& size = grid_->size();
  const auto columns = static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y());
  const auto layers = static_cast<std::size_t>(size.z());
  stretches_.assign(grid_->cell_count(), {INT16_MIN, INT16_MAX});
  bits_.assign(columns * words_, 0);
  for (std::size_t z = 0; z < layers; ++z)
    for (std::size_t column = 0, n = z * columns; column < columns; ++column, ++n)
      if (grid_->at(n) == map::Cell::occupied) {
        stretches_[n].below = static_cast<std::int16_t>(z);
        bits_[column * words_ + (z + 64) / 64] |= std::uint64_t{1} << z % 64;
      } else if (z > 0) {
        stretches_[n].below = stretches_[n - columns].below;
      }
  for (std::size_t z = layers; z-- > 0;)
    for (std::size_t column = 0, n = z * columns; column < columns; ++column, ++n)
      if (stretches_[n].below == static_cast<int>(z))
        stretches_[n].above = static_cast<std::int16_t>(z);
      else if (z + 1 < layers)
        stretches_[n].above = stretches_[n + columns].above;
}

void LateralColumns::add_tables() {
  const double a = grid_->resolution(), a2 = a * a;
  decay_.push_back(0);
  for (int n = 0; n <= radius_ + 1; ++n) {
    decay_.push_back(decay_.back() + std::exp(-model_.wall.k2 * a2 * n * n));
    const auto gate = terms_.wall_gate(-a * n);
    wall_low_.push_back(gate.low - a2 * n * n), wall_high_.push_back(gate.high - a2 * n * n);
  }
  constexpr int kSteps = 4096;  // linear interpolation errs by 2e-8 rad
  for (int n = 0; n <= kSteps + 1; ++n) arc_.push_back(std::numbers::pi / 4 + std::atan(2.0 * n / kSteps - 1));
}

}  // namespace backwash::field
