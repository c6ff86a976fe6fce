// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/tile_sweep.hpp"

#include <algorithm>
#include <bit>

#include "core/field/sight.hpp"

namespace backwash::field {

void TileSweep::evaluate(std::size_t kind, const Column& column) {
  const auto& stencil = whole_.stencils_[kind];
  const int z0 = tile_.first.z();
  for (std::uint32_t n = stencil.first[column.position]; n < stencil.first[column.position + 1]; ++n) {
    const Gates& gates = stencil.gates[n];
    const int shift = z0 + gates.z - column.low;  // from a layer of the tile to a word of the column
    int low = std::max(tile_.low, -shift), high = std::min(tile_.high, column.high - column.low - shift);
    if (!gates.wall) {
      if (column.floors.high == WholeField::kNoFloor) continue;
      low = std::max(low, gates.corner_low + std::max<int>(column.floors.low, 0) - z0);
      high = std::min(high, gates.corner_high + column.floors.high - z0);
    }
    if (low > high) continue;
    const std::uint64_t* words = words_.data() + column.first + shift;
    std::uint64_t any = 0;
    for (int z = low; z <= high; ++z) {
      const auto layer = static_cast<std::size_t>(z);
      any |= lanes_[layer] = words[z] & tile_.lanes[layer];
    }
    if (!any) continue;
    while (!lanes_[static_cast<std::size_t>(low)]) ++low;
    while (!lanes_[static_cast<std::size_t>(high)]) --high;
    const View view{&gates, floors_.data() + column.first + shift + low, static_cast<std::size_t>(low),
                    static_cast<std::size_t>(high)};
    std::fill_n(lanes_.begin() + high + 1, kBlock - 1, 0);
    clear(stencil.steps, view);
    const Offset& offset = stencil.offsets[n];
    if (kind == WholeField::kUp)
      ground(offset, view);
    else if (kind < WholeField::kTurned)
      axis(kind, offset, view);
    else
      turned(kind, offset, view);
  }
}

void TileSweep::ground(const Offset& offset, const View& view) {
  for (std::size_t z = view.low; z <= view.high; ++z) {
    Term* sum = sum_.data() + 64 * z;
    if (clear_[z] == tile_.lanes[z])
      add(uniform_[z], offset.constant, 1);
    else
      for_each_lane(clear_[z], [&](unsigned lane) { add(sum[lane], offset.constant, 1); });
  }
}

void TileSweep::axis(std::size_t kind, const Offset& offset, const View& view) {
  const int height = whole_.height_;
  const double* factors =
      whole_.corners_.data() + offset.corner_row * static_cast<std::size_t>(2 * height + 1) + height;
  for (std::size_t z = view.low; z <= view.high; ++z) {
    if (!clear_[z]) continue;
    const Floors& floors = view.floors[z - view.low];
    const int layer = tile_.first.z() + static_cast<int>(z);
    Term* sum = sum_.data() + 64 * z;
    const auto factor = [&](int floor) {
      const int up = layer - floor;
      return floor == WholeField::kNoFloor || up < -height || up > height ? 0 : factors[up];
    };
    if (floors.low == floors.high || !may_have_corner(*view.gates, floors, layer)) {
      Term both = offset.constant;
      add(both, whole_.axis_corner_[kind], factor(floors.low == floors.high ? floors.low : WholeField::kNoFloor));
      if (clear_[z] == tile_.lanes[z])
        add(uniform_[z], both, 1);
      else
        for_each_lane(clear_[z], [&](unsigned lane) { add(sum[lane], both, 1); });
    } else {
      const auto from =
          static_cast<std::ptrdiff_t>(z) + whole_.column_place(tile_.first + offset.o + WholeField::kNormals[kind]);
      for_each_lane(clear_[z], [&](unsigned lane) {
        if (view.gates->wall) add(sum[lane], offset.constant, 1);
        const double f = factor(whole_.floor_[static_cast<std::size_t>(from + lane_step_[lane])]);
        if (f != 0) add(sum[lane], whole_.axis_corner_[kind], f);
      });
    }
  }
}

void TileSweep::turned(std::size_t kind, const Offset& offset, const View& view) {
  constexpr double kInPlane = 1e-9;  // m
  const double a = grid_.resolution(), a2 = a * a;
  const Index3& o = offset.o;
  const double flat2 = o.head<2>().squaredNorm() + 0.25;
  const std::ptrdiff_t first = whole_.column_place(tile_.first + o);
  for (std::size_t z = view.low; z <= view.high; ++z) {
    const int layer = tile_.first.z() + static_cast<int>(z);
    if (!lanes_[z]) continue;
    const bool with_corner = may_have_corner(*view.gates, view.floors[z - view.low], layer);
    if (!view.gates->wall && !with_corner) continue;
    const std::ptrdiff_t from = first + static_cast<std::ptrdiff_t>(z);
    for_each_lane(lanes_[z], [&](unsigned lane) {
      const auto& e =
          whole_
              .turned_[static_cast<std::size_t>(whole_.turned_at_[static_cast<std::size_t>(from + lane_step_[lane])])];
      const double along = o.x() * e.m_x + o.y() * e.m_y, d2 = a2 * (flat2 + along);
      if (-a * (along + 0.5) <= kInPlane) return;
      double wall = 0, corner = 0;
      if (along >= offset.wall_low && along <= offset.wall_high) wall = offset.wall_factor * whole_.decay(-along);
      if (with_corner && e.floor != WholeField::kNoFloor && whole_.terms_.in_wall_range(d2 + a2 * o.z() * o.z()))
        corner = whole_.terms_.corner_factor(d2, a * (layer - e.floor - 0.5));
      if (wall == 0 && corner == 0) return;
      if (!(clear_[z] >> lane & 1) && hidden(kind, offset, *view.gates, e, z, lane)) return;
      Term& sum = sum_[64 * z + lane];
      if (wall != 0) add(sum, e.wall, wall);
      if (corner != 0) add(sum, e.corner, corner);
    });
  }
}

bool TileSweep::hidden(std::size_t kind, const Offset& offset, const Gates& gates, const WholeField::Turned& element,
                       std::size_t z, unsigned lane) const {
  const auto& stencil = whole_.stencils_[kind];
  const Vec3 c = offset.o.cast<double>() + 0.5 * Vec3(element.m_x, element.m_y, 0);
  const auto segment = open_part(Vec3::Constant(-0.5), 1, Vec3::Zero(), c);
  if (!segment) return false;
  const std::uint64_t* words = here() + z;
  for (std::size_t n = gates.first; n < gates.last; ++n)
    if (words[stencil.steps[n]] >> lane & 1 && meets(*segment, stencil.cells[n])) return true;
  return false;
}

void WholeField::evaluate(std::size_t begin, std::size_t end,
                          const std::function<void(std::size_t, const Variance&)>& store) const {
  TileSweep sweep(*this);
  for (std::size_t n = begin; n < end; ++n) {
    const Tile& tile = tiles_[n];
    sweep.run(tile);
    for (std::size_t z = 0; z < tile.lanes.size(); ++z)
      for (std::uint64_t lanes = tile.lanes[z]; lanes; lanes &= lanes - 1) {
        const int lane = std::countr_zero(lanes);
        const Index3 q = tile.first + Index3(lane % kEdge, lane / kEdge, static_cast<int>(z));
        store(grid_->linear(q), sweep.sigma(z, static_cast<unsigned>(lane)));
      }
  }
}

}  // namespace backwash::field
