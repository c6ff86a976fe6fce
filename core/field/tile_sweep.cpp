// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <bit>
#include <utility>

#include "core/field/sight.hpp"
#include "core/field/whole_field.hpp"

namespace backwash::field {

/// Evaluates tiles one after the other, with a picture of the surroundings of their column: words of 8 × 8 voxels at
/// every position around it.
class TileSweep {
  using Tile = WholeField::Tile;
  using Term = WholeField::Term;
  using Offset = WholeField::Stencil::Offset;

 public:
  explicit TileSweep(const WholeField& whole)
      : whole_(whole),
        grid_(*whole.grid_),
        layer_(static_cast<std::size_t>(whole.width_) * static_cast<std::size_t>(whole.width_)),
        occupied_(layer_ * static_cast<std::size_t>(grid_.size().z())),
        scratch_(layer_) {}

  void run(const Tile& tile) {
    if (tile.x != x_ || tile.y != y_) open_window(tile);
    tile_ = tile;
    sum_.fill({}), uniform_ = {};
    for (std::size_t kind = 0; kind < WholeField::kClasses; ++kind) {
      const auto& stencil = whole_.stencils_[kind];
      const int low = std::max(0, tile.z + stencil.low_z),
                high = std::min(grid_.size().z() - 1, tile.z + stencil.high_z);
      for (int z = low; z <= high; ++z) layer(kind, z);
    }
  }

  Variance sigma(unsigned lane) const {
    const Term& s = sum_[lane];
    const auto& base = whole_.model_.base;
    return {base.horizontal + uniform_.xx + s.xx, uniform_.xy + s.xy, 0, base.horizontal + uniform_.yy + s.yy, 0,
            base.vertical + uniform_.zz + s.zz};
  }

 private:
  /// Elements of one class at a position of a window's layer, one bit for each voxel of a tile there.
  struct Entry {
    std::uint32_t position;
    std::uint64_t lanes;
  };

  template <typename Visit>
  static void for_each_lane(std::uint64_t lanes, const Visit& visit) {
    for (; lanes; lanes &= lanes - 1) visit(static_cast<unsigned>(std::countr_zero(lanes)));
  }
  static void add(Term& sum, const Term& t, double factor) noexcept {
    sum.xx += factor * t.xx, sum.xy += factor * t.xy, sum.yy += factor * t.yy, sum.zz += factor * t.zz;
  }

  void open_window(const Tile& tile);
  void open_occupied(int z);
  void open_entries(std::size_t kind, int z);
  void layer(std::size_t kind, int z);
  void fixed(std::size_t kind, const Offset& offset, std::uint64_t lanes);
  void turned(const Offset& offset, std::uint64_t lanes);
  bool hidden(const Offset& offset, const WholeField::Turned& element, unsigned lane) const;

  /// The vehicle's word in occupied_.
  std::size_t here() const noexcept { return static_cast<std::size_t>(tile_.z) * layer_ + layer_ / 2; }
  std::uint64_t occupied_at(std::int32_t step) const noexcept {
    return occupied_[here() + static_cast<std::size_t>(static_cast<std::ptrdiff_t>(step))];
  }
  /// Lanes of `lanes` whose path meets no occupied voxel.
  std::uint64_t clear_lanes(const Offset& offset, const std::vector<std::int32_t>& steps, std::uint64_t lanes) const {
    const std::uint64_t* word = occupied_.data() + here();
    const std::int32_t* step = steps.data() + offset.first;
    const std::int32_t* const end = steps.data() + offset.last;
    for (; end - step >= 4 && lanes; step += 4)
      lanes &= ~(word[step[0]] | word[step[1]] | word[step[2]] | word[step[3]]);
    for (; step != end; ++step) lanes &= ~word[*step];
    return lanes;
  }
  std::size_t linear(const Index3& o, unsigned lane) const noexcept {
    const int l = static_cast<int>(lane);
    return grid_.linear(Index3(tile_.x + l % 8, tile_.y + l / 8, tile_.z) + o);
  }

  const WholeField& whole_;
  const map::OccupancyGrid& grid_;
  std::size_t layer_;  // words in a layer of the window
  int x_ = -1, y_ = -1;
  std::vector<std::uint64_t> occupied_;
  std::array<std::vector<Entry>, WholeField::kClasses> entries_;
  std::array<std::vector<std::size_t>, WholeField::kClasses> layer_first_;
  std::vector<std::uint64_t> scratch_;
  Tile tile_{};
  std::array<Term, 64> sum_;
  Term uniform_;
};

void TileSweep::open_window(const Tile& tile) {
  x_ = tile.x, y_ = tile.y;
  for (int z = 0; z < grid_.size().z(); ++z) open_occupied(z);
  for (std::size_t kind = 0; kind < WholeField::kClasses; ++kind) {
    entries_[kind].clear();
    layer_first_[kind].assign(1, 0);
    for (int z = 0; z < grid_.size().z(); ++z) {
      open_entries(kind, z);
      layer_first_[kind].push_back(entries_[kind].size());
    }
  }
}

/// Slides a byte along each row of voxels, then the bytes of eight rows along y.
void TileSweep::open_occupied(int z) {
  const int width = whole_.width_, x0 = x_ - whole_.radius_, y0 = y_ - whole_.radius_;
  std::uint64_t* words = occupied_.data() + static_cast<std::size_t>(z) * layer_;
  std::fill_n(words, layer_, 0);
  for (int row = 0; row < width + 7; ++row) {
    const int y = y0 + row;
    if (y < 0 || y >= grid_.size().y()) continue;
    const auto cells = grid_.cells().subspan(grid_.linear(Index3(0, y, z)), static_cast<std::size_t>(grid_.size().x()));
    const auto bit = [&](int x) {
      return x >= 0 && x < grid_.size().x() && cells[static_cast<std::size_t>(x)] == map::Cell::occupied ? 0x80u : 0u;
    };
    std::uint64_t byte = 0;
    for (int x = x0; x < x0 + 7; ++x) byte = byte >> 1 | bit(x);
    const int first = std::max(0, row - 7), last = std::min(width - 1, row);
    for (int column = 0; column < width; ++column) {
      byte = byte >> 1 | bit(x0 + column + 7);
      if (!byte) continue;
      for (int wy = first; wy <= last; ++wy)
        words[static_cast<std::size_t>(wy * width + column)] |= byte << 8 * (row - wy);
    }
  }
}

void TileSweep::open_entries(std::size_t kind, int z) {
  const auto& board = whole_.boards_[kind];
  const int width = whole_.width_, x0 = x_ - whole_.radius_, y0 = y_ - whole_.radius_;
  auto& entries = entries_[kind];
  const std::size_t first = entries.size();
  for (int y = std::max(0, y0); y < std::min(grid_.size().y(), y0 + width + 7); ++y) {
    const auto row = static_cast<std::size_t>(z * grid_.size().y() + y);
    const auto end = board.x.begin() + board.row_first[row + 1];
    for (auto x = std::lower_bound(board.x.begin() + board.row_first[row], end, x0); x != end && *x < x0 + width + 7;
         ++x)
      for (int ly = std::max(0, y - y0 - width + 1); ly <= std::min(7, y - y0); ++ly)
        for (int lx = std::max(0, *x - x0 - width + 1); lx <= std::min(7, *x - x0); ++lx) {
          const auto position = static_cast<std::uint32_t>((y - y0 - ly) * width + *x - x0 - lx);
          if (!scratch_[position]) entries.push_back({position, 0});
          scratch_[position] |= std::uint64_t{1} << (lx + 8 * ly);
        }
  }
  for (std::size_t n = first; n < entries.size(); ++n)
    entries[n].lanes = std::exchange(scratch_[entries[n].position], 0);
}

void TileSweep::layer(std::size_t kind, int z) {
  const auto& stencil = whole_.stencils_[kind];
  const auto& first = layer_first_[kind];
  const std::int32_t* number = stencil.number.data() + static_cast<std::size_t>(z - tile_.z - stencil.low_z) * layer_;
  for (std::size_t n = first[static_cast<std::size_t>(z)]; n < first[static_cast<std::size_t>(z) + 1]; ++n) {
    const Entry& entry = entries_[kind][n];
    const std::uint64_t lanes = entry.lanes & tile_.lanes;
    const std::int32_t offset = number[entry.position];
    if (!lanes || offset < 0) continue;
    if (kind == WholeField::kTurned)
      turned(stencil.offsets[static_cast<std::size_t>(offset)], lanes);
    else
      fixed(kind, stencil.offsets[static_cast<std::size_t>(offset)], lanes);
  }
}

void TileSweep::fixed(std::size_t kind, const Offset& offset, std::uint64_t lanes) {
  const bool lateral = kind != WholeField::kUp;
  std::array<double, 64> corner;
  std::uint64_t cornered = 0;
  if (lateral) {
    const int height = whole_.height_;
    const double* row = whole_.corners_.data() + offset.corner_row * static_cast<std::size_t>(2 * height + 1) + height;
    for_each_lane(lanes, [&](unsigned lane) {
      const int floor = whole_.floor_[linear(offset.o + WholeField::kNormals[kind], lane)], up = tile_.z - floor;
      if (floor == WholeField::kNoFloor || up < -height || up > height || row[up] == 0) return;
      corner[lane] = row[up], cornered |= std::uint64_t{1} << lane;
    });
  }
  const bool constant = offset.constant.xx != 0 || offset.constant.yy != 0 || offset.constant.zz != 0;
  lanes = clear_lanes(offset, whole_.stencils_[kind].steps, constant ? lanes : lanes & cornered);
  if (constant && lanes == tile_.lanes)
    add(uniform_, offset.constant, 1);
  else if (constant)
    for_each_lane(lanes, [&](unsigned lane) { add(sum_[lane], offset.constant, 1); });
  if (!(lanes & cornered)) return;
  const auto& lambda = whole_.model_.corner.lambda;
  const double area = grid_.resolution() * grid_.resolution();
  const Term t =
      WholeField::term(Variance::about_normal(WholeField::kNormals[kind].cast<double>(), area * lambda.normal,
                                              area * lambda.tangential, area * lambda.vertical));
  for_each_lane(lanes & cornered, [&](unsigned lane) { add(sum_[lane], t, corner[lane]); });
}

void TileSweep::turned(const Offset& offset, std::uint64_t lanes) {
  constexpr double kInPlane = 1e-9;  // m
  const double a = grid_.resolution(), a2 = a * a;
  const Index3& o = offset.o;
  const double flat2 = o.head<2>().squaredNorm();
  std::array<double, 64> wall, corner;
  std::uint64_t wanted = 0;
  const auto element = [&](unsigned lane) -> const WholeField::Turned& {
    return whole_.turned_[static_cast<std::size_t>(whole_.turned_at_[linear(o, lane)])];
  };
  for_each_lane(lanes, [&](unsigned lane) {
    const auto& e = element(lane);
    const double along = o.x() * e.m_x + o.y() * e.m_y, d2 = a2 * (flat2 + along + 0.25), r2 = d2 + a2 * o.z() * o.z();
    if (-a * (along + 0.5) <= kInPlane) return;
    wall[lane] = whole_.terms_.wall_factor(r2, a * o.z());
    const bool has_corner = e.floor != WholeField::kNoFloor && whole_.terms_.in_wall_range(r2);
    corner[lane] = has_corner ? whole_.terms_.corner_factor(d2, a * (tile_.z - e.floor - 0.5)) : 0;
    if (wall[lane] != 0 || corner[lane] != 0) wanted |= std::uint64_t{1} << lane;
  });
  if (!wanted) return;
  std::uint64_t visible = clear_lanes(offset, whole_.stencils_[WholeField::kTurned].steps, wanted);
  for_each_lane(wanted & ~visible, [&](unsigned lane) {
    if (!hidden(offset, element(lane), lane)) visible |= std::uint64_t{1} << lane;
  });
  for_each_lane(visible, [&](unsigned lane) {
    const auto& e = element(lane);
    add(sum_[lane], e.wall, wall[lane]);
    if (corner[lane] != 0) add(sum_[lane], e.corner, corner[lane]);
  });
}

bool TileSweep::hidden(const Offset& offset, const WholeField::Turned& element, unsigned lane) const {
  const auto& stencil = whole_.stencils_[WholeField::kTurned];
  const Vec3 c = offset.o.cast<double>() + 0.5 * Vec3(element.m_x, element.m_y, 0);
  const auto segment = open_part(Vec3::Constant(-0.5), 1, Vec3::Zero(), c);
  if (!segment) return false;
  for (std::size_t n = offset.first; n < offset.last; ++n)
    if (occupied_at(stencil.steps[n]) >> lane & 1 && meets(*segment, stencil.cells[n])) return true;
  return false;
}

void WholeField::evaluate(std::size_t begin, std::size_t end,
                          const std::function<void(std::size_t, const Variance&)>& store) const {
  TileSweep sweep(*this);
  for (std::size_t n = begin; n < end; ++n) {
    const Tile& tile = tiles_[n];
    sweep.run(tile);
    for (std::uint64_t lanes = tile.lanes; lanes; lanes &= lanes - 1) {
      const int lane = std::countr_zero(lanes);
      const Index3 q(tile.x + lane % kEdge, tile.y + lane / kEdge, tile.z);
      store(grid_->linear(q), sweep.sigma(static_cast<unsigned>(lane)));
    }
  }
}

}  // namespace backwash::field
