// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/whole_field.hpp"

#include <algorithm>
#include <cmath>

#include "core/field/sight_path.hpp"

namespace backwash::field {
namespace {

constexpr double kInPlane = 1e-9;  // m: a point in an element's own plane does not see it, whatever the rounding

}  // namespace

const std::array<Index3, WholeField::kClasses> WholeField::kNormals{Index3(0, 0, 1), Index3(1, 0, 0),  Index3(-1, 0, 0),
                                                                    Index3(0, 1, 0), Index3(0, -1, 0), Index3(0, 0, 0)};

WholeField::WholeField(const map::OccupancyGrid& grid, const Model& model, std::span<const std::size_t> voxels)
    : grid_(&grid), model_(model), terms_(model, grid.resolution()) {
  const auto& g = model.ground;
  const double a = grid.resolution(), cone = g.l_max * (g.theta_max < 1.5 ? std::sin(g.theta_max) : 1.0);
  const double ground = std::max(cone, std::min(g.r0, g.l_footprint_max));
  radius_ = static_cast<int>(std::max(ground / a, model.wall.l_max / a + 0.5) + 1e-6) + 1;
  width_ = 2 * radius_ + 1;
  height_ = static_cast<int>(model_.corner.l_max / a) + 2;
  add_tiles(voxels);
  add_elements();
  add_stencils();
  add_tables();
}

void WholeField::add_tiles(std::span<const std::size_t> voxels) {
  const Index3 count = (grid_->size().array() + (kEdge - 1)) / kEdge;
  std::vector<Lanes> lanes(static_cast<std::size_t>(count.prod()), Lanes{});
  for (const std::size_t n : voxels) {  // tiles of one column are neighbours: they share a window
    const Index3 q = grid_->voxel(n), tile = q / kEdge, in = q - kEdge * tile;
    const int place = (tile.y() * count.x() + tile.x()) * count.z() + tile.z();
    lanes[static_cast<std::size_t>(place)][static_cast<std::size_t>(in.z())] |= std::uint64_t{1}
                                                                                << (in.x() + kEdge * in.y());
  }
  for (int n = 0; n < count.prod(); ++n) {
    const Index3 tile(n / count.z() % count.x(), n / count.z() / count.x(), n % count.z());
    if (const Lanes& of_tile = lanes[static_cast<std::size_t>(n)]; of_tile != Lanes{})
      tiles_.push_back({kEdge * tile, of_tile});
  }
}

void WholeField::add_elements() {
  const double a = grid_->resolution();
  const auto rows = static_cast<std::size_t>(grid_->size().y()) * static_cast<std::size_t>(grid_->size().z());
  for (Board& board : boards_) board.row_first.assign(rows + 1, 0);
  turned_at_.assign(grid_->cell_count(), -1);
  floor_.assign(grid_->cell_count(), kNoFloor);
  for (std::size_t n = 0; n < grid_->cell_count(); ++n) {
    const Index3 v = grid_->voxel(n), below = v - Index3(0, 0, 1);
    if (v.z() == 0 || grid_->at(n) != map::Cell::free) continue;
    const std::size_t place = column_major(v);
    floor_[place] = grid_->occupied(below) ? static_cast<std::int16_t>(below.z()) : floor_[place - 1];
  }
  for (const Element& e : surface_elements(*grid_)) {  // in the order of the rows
    const Index3 v = grid_->index(e.c_W - 0.5 * a * e.normal);
    std::size_t kind = 0;
    while (kind < kTurned && kNormals[kind].cast<double>() != e.normal) ++kind;
    boards_[kind].x.push_back(v.x());
    ++boards_[kind].row_first[static_cast<std::size_t>(v.z() * grid_->size().y() + v.y()) + 1];
    if (kind != kTurned) continue;
    const auto about = [&](const auto& k) {
      return term(Variance::about_normal(e.normal, e.area * k.normal, e.area * k.tangential, e.area * k.vertical));
    };
    const int floor = e.corner_W ? static_cast<int>(std::lround((e.corner_W->z() - grid_->origin().z()) / a)) - 1 : -1;
    turned_at_[column_major(v)] = static_cast<std::int32_t>(turned_.size());
    turned_.push_back({e.normal.x(), e.normal.y(), about(model_.wall.k1), about(model_.corner.lambda), floor});
  }
  for (Board& board : boards_)
    for (std::size_t row = 0; row < rows; ++row) board.row_first[row + 1] += board.row_first[row];
}

void WholeField::add_stencils() {
  const double a = grid_->resolution();
  const int wall = static_cast<int>(model_.wall.l_max / a + 0.5) + 1, highest = grid_->size().z() - 1;
  const int ground = static_cast<int>(std::max(model_.ground.l_max, model_.ground.l_footprint_max) / a) + 1;
  const auto layer = static_cast<std::size_t>(width_) * static_cast<std::size_t>(width_);
  for (std::size_t kind = 0; kind < kClasses; ++kind) {
    Stencil& stencil = stencils_[kind];
    if (boards_[kind].x.empty()) continue;
    const int reach_z = std::min(kind == kUp ? ground : wall, highest), reach = kind == kUp ? radius_ : wall;
    stencil.low_z = -reach_z, stencil.high_z = kind == kUp ? -1 : reach_z;
    stencil.number.assign(layer * static_cast<std::size_t>(std::max(0, stencil.high_z - stencil.low_z + 1)), -1);
    for (int z = stencil.low_z; z <= stencil.high_z; ++z)
      for (int y = -std::min(reach, radius_); y <= std::min(reach, radius_); ++y)
        for (int x = -std::min(reach, radius_); x <= std::min(reach, radius_); ++x)
          add_offset(stencil, kind, Index3(x, y, z));
  }
}

void WholeField::add_offset(Stencil& stencil, std::size_t kind, const Index3& o) {
  const double a = grid_->resolution();
  const Vec3 m = kNormals[kind].cast<double>(), c = a * (o.cast<double>() + 0.5 * m);  // the vehicle is at 0
  Stencil::Offset offset{o, 0, 0, {}, 0, 0, 0, 0};
  NormalRange normals{m, m};
  if (kind == kTurned) {
    const double nearest = a * std::max(0.0, o.cast<double>().norm() - 0.5);
    if (o.head<2>().isZero() || !terms_.in_wall_range(nearest * nearest)) return;
    normals = facing_normals(o);
    const double r2_at_0 = o.squaredNorm() + 0.25;  // |r|² = a² (|o|² + o·m + 1/4)
    const auto gate = terms_.wall_gate(a * o.z());
    offset.wall_low = gate.low / (a * a) - r2_at_0, offset.wall_high = gate.high / (a * a) - r2_at_0;
    offset.wall_factor = std::exp(-model_.wall.k2 * a * a * r2_at_0);
  } else {
    if (m.dot(c) >= -kInPlane) return;
    if (kind == kUp) {
      offset.constant = term(terms_.ground({Element::Kind::up, c, m, a * a, {}}, Vec3::Zero()));
      if (offset.constant.xx == 0 && offset.constant.zz == 0) return;
    } else {
      if (!terms_.in_wall_range(c.squaredNorm())) return;
      offset.constant = term(terms_.wall({Element::Kind::lateral, c, m, a * a, {}}, Vec3::Zero()));
      const Index3 doubled = 2 * o + kNormals[kind];
      offset.corner_row = static_cast<std::size_t>(doubled.head<2>().squaredNorm());
    }
  }
  offset.first = static_cast<std::uint32_t>(stencil.steps.size());
  for (const Index3& cell : cells_on_path(o, normals)) {
    stencil.steps.push_back((cell.y() * width_ + cell.x()) * grid_->size().z() + cell.z());
    if (kind == kTurned) stencil.cells.push_back(cell);
  }
  offset.last = static_cast<std::uint32_t>(stencil.steps.size());
  const int depth = stencil.high_z - stencil.low_z + 1;
  const int place = ((o.y() + radius_) * width_ + o.x() + radius_) * depth + o.z() - stencil.low_z;
  stencil.number[static_cast<std::size_t>(place)] = static_cast<std::int32_t>(stencil.offsets.size());
  stencil.offsets.push_back(offset);
}

void WholeField::add_tables() {
  const double a = grid_->resolution();
  const int rows = static_cast<int>(std::pow(2 * model_.wall.l_max / a + 2, 2)) + 1;
  for (int d2 = 0; d2 < rows; ++d2)
    for (int up = -height_; up <= height_; ++up)
      corners_.push_back(terms_.corner_factor(0.25 * a * a * d2, a * (up - 0.5)));
  // Linear interpolation with steps of k_w2 a² x = 0.001 errs by 0.001²/8.
  const double rate = model_.wall.k2 * a * a;
  decay_steps_ = std::ceil(rate / 0.001) + 1;
  for (int n = 0; n <= (radius_ + 1) * decay_steps_; ++n) decay_.push_back(std::exp(rate * n / decay_steps_));
}

}  // namespace backwash::field
