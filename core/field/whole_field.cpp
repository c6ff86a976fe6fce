// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/whole_field.hpp"

#include <algorithm>
#include <cmath>

#include "core/field/sight_path.hpp"

namespace backwash::field {
namespace {

constexpr double kInPlane = 1e-9;  // m: a point in an element's own plane does not see it, whatever the rounding

}  // namespace

const std::array<Index3, WholeField::kClasses> WholeField::kNormals{
    Index3(0, 0, 1), Index3(1, 0, 0),  Index3(-1, 0, 0), Index3(0, 1, 0), Index3(0, -1, 0),
    Index3(1, 0, 0), Index3(-1, 0, 0), Index3(0, 1, 0),  Index3(0, -1, 0)};

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
  const Index3 edge(kEdge, kEdge, kLayers);
  const Index3 count = (grid_->size() + edge - Index3::Ones()).array() / edge.array();
  std::vector<int> number(static_cast<std::size_t>(count.prod()), -1);
  for (const std::size_t n : voxels) {
    const Index3 q = grid_->voxel(n), tile = q.array() / edge.array(), in = q - tile.cwiseProduct(edge);
    int& of_tile = number[static_cast<std::size_t>((tile.z() * count.y() + tile.y()) * count.x() + tile.x())];
    if (of_tile < 0) {
      of_tile = static_cast<int>(tiles_.size());
      tiles_.push_back({tile.cwiseProduct(edge), in.z(), in.z(), {}});
    }
    Tile& t = tiles_[static_cast<std::size_t>(of_tile)];
    t.low = std::min(t.low, in.z()), t.high = std::max(t.high, in.z());
    t.lanes[static_cast<std::size_t>(in.z())] |= std::uint64_t{1} << (in.x() + kEdge * in.y());
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
    if (kind == kTurned) {
      while (kNormals[kind].cast<double>().dot(e.normal) < e.normal.cwiseAbs().maxCoeff()) ++kind;
      const auto about = [&](const auto& k) {
        const Variance t = e.area * Variance::about_normal(e.normal, k.normal, k.tangential, k.vertical);
        return std::array{static_cast<float>(t.xx), static_cast<float>(t.xy), static_cast<float>(t.yy),
                          static_cast<float>(t.zz)};
      };
      turned_at_[column_major(v)] = static_cast<std::int32_t>(turned_.size());
      turned_.push_back({e.normal.x(), e.normal.y(), about(model_.wall.k1), about(model_.corner.lambda), kNoFloor});
      if (e.corner_W)
        turned_.back().floor = static_cast<std::int16_t>(std::lround((e.corner_W->z() - grid_->origin().z()) / a) - 1);
    }
    boards_[kind].x.push_back(v.x());
    const bool axis = kind != kUp && kind < kTurned;
    boards_[kind].floor.push_back(axis              ? floor_[column_major(v + kNormals[kind])]
                                  : kind >= kTurned ? static_cast<std::int16_t>(turned_.back().floor)
                                                    : static_cast<std::int16_t>(kNoFloor));
    ++boards_[kind].row_first[static_cast<std::size_t>(v.z() * grid_->size().y() + v.y()) + 1];
  }
  std::vector<Turned> in_columns;
  for (std::int32_t& n : turned_at_) {
    if (n < 0) continue;
    in_columns.push_back(turned_[static_cast<std::size_t>(n)]);
    n = static_cast<std::int32_t>(in_columns.size()) - 1;
  }
  turned_ = std::move(in_columns);
  for (Board& board : boards_)
    for (std::size_t row = 0; row < rows; ++row) board.row_first[row + 1] += board.row_first[row];
}

void WholeField::add_stencils() {
  const double a = grid_->resolution();
  const int wall = static_cast<int>(model_.wall.l_max / a + 0.5) + 1, highest = grid_->size().z() - 1;
  const int ground = static_cast<int>(std::max(model_.ground.l_max, model_.ground.l_footprint_max) / a) + 1;
  for (std::size_t kind = 0; kind < kClasses; ++kind) {
    Stencil& stencil = stencils_[kind];
    if (boards_[kind].x.empty()) continue;
    const int low = -std::min(kind == kUp ? ground : wall, highest), high = kind == kUp ? -1 : -low;
    for (int y = -radius_; y <= radius_; ++y)
      for (int x = -radius_; x <= radius_; ++x) {
        stencil.first.push_back(static_cast<std::uint32_t>(stencil.offsets.size()));
        for (int z = low; z <= high; ++z) add_offset(stencil, kind, Index3(x, y, z));
      }
    stencil.first.push_back(static_cast<std::uint32_t>(stencil.offsets.size()));
  }
}

/// Sets the terms that an element at an offset may have; nothing if none.
std::optional<WholeField::Stencil::Gates> WholeField::set_terms(Stencil::Offset& offset, std::size_t kind) const {
  const double a = grid_->resolution();
  const Vec3 m = kNormals[kind].cast<double>(), o = offset.o.cast<double>(), c = a * (o + 0.5 * m);
  const double flat = o.head<2>().norm();
  Stencil::Gates gates{static_cast<std::int16_t>(offset.o.z()), 1, 0, true, 0, 0};
  if (kind < kTurned && m.dot(c) >= -kInPlane) return std::nullopt;  // the vehicle is at 0
  if (kind == kUp) {
    offset.constant = term(terms_.ground({Element::Kind::up, c, m, a * a, {}}, Vec3::Zero()));
    if (offset.constant.xx == 0 && offset.constant.zz == 0) return std::nullopt;
    return gates;
  }
  double nearest2 = c.squaredNorm(), corner2 = c.head<2>().squaredNorm();
  if (kind < kTurned) {
    const double wall = terms_.wall_factor(c.squaredNorm(), c.z());
    gates.wall = wall != 0;
    const auto& k1 = model_.wall.k1;
    offset.constant = term(wall * a * a * Variance::about_normal(m, k1.normal, k1.tangential, k1.vertical));
    const Index3 doubled = 2 * offset.o + kNormals[kind];
    offset.corner_row = static_cast<std::size_t>(doubled.head<2>().squaredNorm());
  } else {
    const double r2_at_0 = o.squaredNorm() + 0.25;  // |r|² = a² (|o|² + o·m + 1/4)
    const auto gate = terms_.wall_gate(c.z());
    offset.wall_low = gate.low / (a * a) - r2_at_0, offset.wall_high = gate.high / (a * a) - r2_at_0;
    offset.wall_factor = std::exp(-model_.wall.k2 * a * a * r2_at_0);
    gates.wall = offset.wall_low <= -0.5 && offset.wall_high >= -flat - 1e-9;
    corner2 = std::pow(a * (flat - 0.5), 2), nearest2 = corner2 + c.z() * c.z();
  }
  if (!terms_.in_wall_range(nearest2 * (1 - 1e-12))) return std::nullopt;
  // A corner at the horizontal distance d or farther: l_c and φ bound its height.
  const double l2 = std::pow(model_.corner.l_max + 1e-6, 2) - corner2;
  const int highest = l2 < 0 ? -height_ - 1 : std::min(height_, static_cast<int>(std::sqrt(l2) / a + 1.5));
  int lowest = -height_;
  if (const double phi = model_.corner.phi_max; phi < 1.57)
    lowest = static_cast<int>(std::min(height_ + 1.0, 0.999 * std::sqrt(corner2) / std::tan(phi) / a + 0.5));
  gates.corner_low = static_cast<std::int16_t>(lowest), gates.corner_high = static_cast<std::int16_t>(highest);
  if (!gates.wall && lowest > highest) return std::nullopt;
  return gates;
}

void WholeField::add_offset(Stencil& stencil, std::size_t kind, const Index3& o) {
  Stencil::Offset offset{};
  offset.o = o;
  const Vec3 m = kNormals[kind].cast<double>();
  const auto normals = kind < kTurned ? NormalRange{m, m} : facing_normals(o, kNormals[kind]);
  if (!normals) return;
  auto gates = set_terms(offset, kind);
  if (!gates) return;
  gates->first = static_cast<std::uint32_t>(stencil.steps.size());
  for (const Index3& cell : cells_on_path(o, *normals)) {
    stencil.steps.push_back((cell.y() * width_ + cell.x()) * grid_->size().z() + cell.z());
    if (kind >= kTurned) stencil.cells.push_back(cell);
  }
  gates->last = static_cast<std::uint32_t>(stencil.steps.size());
  stencil.gates.push_back(*gates);
  stencil.offsets.push_back(offset);
}

void WholeField::add_tables() {
  const double a = grid_->resolution();
  const int rows = static_cast<int>(std::pow(2 * model_.wall.l_max / a + 2, 2)) + 1;
  for (int d2 = 0; d2 < rows; ++d2)
    for (int up = -height_; up <= height_; ++up)
      corners_.push_back(terms_.corner_factor(0.25 * a * a * d2, a * (up - 0.5)));
  const auto& lambda = model_.corner.lambda;
  for (std::size_t kind = 1; kind < kTurned; ++kind)
    axis_corner_[kind] =
        term(a * a *
             Variance::about_normal(kNormals[kind].cast<double>(), lambda.normal, lambda.tangential, lambda.vertical));
  // Linear interpolation with steps of k_w2 a² x = 0.001 errs by 0.001²/8.
  const double rate = model_.wall.k2 * a * a;
  decay_steps_ = std::ceil(rate / 0.001) + 1;
  for (int n = 0; n <= (radius_ + 1) * decay_steps_; ++n) decay_.push_back(std::exp(rate * n / decay_steps_));
}

}  // namespace backwash::field
