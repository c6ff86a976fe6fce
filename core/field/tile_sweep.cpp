// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <bit>
#include <utility>

#include "core/field/sight.hpp"
#include "core/field/whole_field.hpp"

namespace backwash::field {

/// Evaluates tiles one after the other, with a window onto the surroundings of their column: at each position within
/// the stencils' radius, the words (bit x' + 8 y': voxel (x + x', y + y')) of all layers, z running fastest.
class TileSweep {
  using Tile = WholeField::Tile;
  using Lanes = WholeField::Lanes;
  using Term = WholeField::Term;
  using Offset = WholeField::Stencil::Offset;

 public:
  explicit TileSweep(const WholeField& whole)
      : whole_(whole),
        grid_(*whole.grid_),
        layers_(static_cast<std::size_t>(grid_.size().z())),
        positions_(static_cast<std::size_t>(whole.width_) * static_cast<std::size_t>(whole.width_)),
        occupied_(layers_ * positions_ + 2 * kPadding),
        scratch_(layers_ * positions_),
        touched_(positions_) {}

  void run(const Tile& tile) {
    if (tile.first.head<2>() != corner_) open_window(tile.first);
    tile_ = tile;
    sum_.fill({}), uniform_.fill({});
    for (std::size_t kind = 0; kind < WholeField::kClasses; ++kind)
      for (const Column& column : columns_[kind]) evaluate(kind, column);
  }

  Variance sigma(std::size_t z, unsigned lane) const noexcept {
    const Term &s = sum_[64 * z + lane], &u = uniform_[z];
    const auto& base = whole_.model_.base;
    return {base.horizontal + u.xx + s.xx, u.xy + s.xy, 0,
            base.horizontal + u.yy + s.yy, 0,           base.vertical + u.zz + s.zz};
  }

 private:
  static constexpr std::size_t kPadding = WholeField::kEdge;  // words read before and after those of a column
  /// The elements of one class at one position: words of the layers low … high.
  struct Column {
    std::uint32_t position;
    int low, high;
    std::size_t first;  // of words_
  };

  template <typename Visit>
  static void for_each_lane(std::uint64_t lanes, const Visit& visit) {
    for (; lanes; lanes &= lanes - 1) visit(static_cast<unsigned>(std::countr_zero(lanes)));
  }
  static void add(Term& sum, const Term& t, double factor) noexcept {
    sum.xx += factor * t.xx, sum.xy += factor * t.xy, sum.yy += factor * t.yy, sum.zz += factor * t.zz;
  }

  void open_window(const Index3& first);
  void open_occupied();
  void open_columns(std::size_t kind);
  void scatter(std::size_t kind, int y, int z);
  void evaluate(std::size_t kind, const Column& column);
  void fixed(std::size_t kind, const Offset& offset, Lanes lanes, int low, int high);
  void turned(const Offset& offset, const Lanes& lanes, int low, int high);
  bool hidden(const Offset& offset, const WholeField::Turned& element, std::size_t z, unsigned lane) const;
  Lanes corners_seen(std::size_t kind, const Offset& offset, const Lanes& lanes, int low, int high);

  /// The words of the tile in occupied_.
  const std::uint64_t* here() const noexcept {
    return occupied_.data() + kPadding + positions_ / 2 * layers_ + static_cast<std::size_t>(tile_.first.z());
  }
  /// Lanes whose path meets no occupied voxel; only words low … high are not zero.
  Lanes clear_lanes(const Offset& offset, const std::vector<std::int32_t>& steps, Lanes lanes, int low,
                    int high) const {
    const std::uint64_t* words = here();
    const std::int32_t* step = steps.data() + offset.first;
    const std::int32_t* const end = steps.data() + offset.last;
    if (low == high) {
      std::uint64_t left = lanes[static_cast<std::size_t>(low)];
      words += low;
      for (; end - step >= 4 && left; step += 4)
        left &= ~(words[step[0]] | words[step[1]] | words[step[2]] | words[step[3]]);
      for (; step != end; ++step) left &= ~words[*step];
      lanes[static_cast<std::size_t>(low)] = left;
      return lanes;
    }
    for (int n = 0; step != end; ++step, ++n) {
      const std::uint64_t* word = words + *step;
      for (std::size_t z = 0; z < lanes.size(); ++z) lanes[z] &= ~word[z];
      if (n % 4 == 3 && lanes == Lanes{}) break;
    }
    return lanes;
  }
  std::size_t place(const Index3& o, std::size_t z, unsigned lane) const noexcept {
    const int l = static_cast<int>(lane);
    return whole_.column_major(tile_.first + o + Index3(l % 8, l / 8, static_cast<int>(z)));
  }

  const WholeField& whole_;
  const map::OccupancyGrid& grid_;
  std::size_t layers_, positions_;
  Eigen::Vector2i corner_{-1, -1};  // of the window's middle, voxels
  std::vector<std::uint64_t> occupied_;
  std::array<std::vector<Column>, WholeField::kClasses> columns_;
  std::vector<std::uint64_t> words_;    // of the columns
  std::vector<std::uint64_t> scratch_;  // of the columns while they are made; zero between
  std::vector<std::uint32_t> touched_;  // per position: 1 + its column, 0: none yet
  Tile tile_{};
  std::array<Term, 512> sum_;
  std::array<Term, WholeField::kEdge> uniform_;  // what all voxels of a layer have in common
  std::array<double, 512> wall_, corner_factor_;
};

void TileSweep::open_window(const Index3& first) {
  corner_ = first.head<2>();
  open_occupied();
  words_.clear();
  for (std::size_t kind = 0; kind < WholeField::kClasses; ++kind) open_columns(kind);
}

/// Slides a byte along each row of voxels, and spreads it over the eight positions along y that hold it.
void TileSweep::open_occupied() {
  const int width = whole_.width_, x0 = corner_.x() - whole_.radius_, y0 = corner_.y() - whole_.radius_;
  std::ranges::fill(occupied_, 0);
  for (int z = 0; z < grid_.size().z(); ++z)
    for (int y = std::max(0, y0); y < std::min(grid_.size().y(), y0 + width + 7); ++y) {
      const std::size_t start = grid_.linear(Index3(0, y, z));
      const auto bit = [&](int x) -> std::uint64_t {
        if (x < 0 || x >= grid_.size().x()) return 0;
        return grid_.at(start + static_cast<std::size_t>(x)) == map::Cell::occupied ? 0x80 : 0;
      };
      std::uint64_t byte = 0;
      for (int x = x0; x < x0 + 7; ++x) byte = byte >> 1 | bit(x);
      const int row = y - y0, first = std::max(0, row - 7), last = std::min(width - 1, row);
      for (int column = 0; column < width; ++column) {
        byte = byte >> 1 | bit(x0 + column + 7);
        if (!byte) continue;
        for (int wy = first; wy <= last; ++wy)
          occupied_[kPadding + static_cast<std::size_t>(wy * width + column) * layers_ + static_cast<std::size_t>(z)] |=
              byte << 8 * (row - wy);
      }
    }
}

void TileSweep::open_columns(std::size_t kind) {
  columns_[kind].clear();
  const int y0 = corner_.y() - whole_.radius_;
  for (int z = 0; z < grid_.size().z(); ++z)
    for (int y = std::max(0, y0); y < std::min(grid_.size().y(), y0 + whole_.width_ + 7); ++y) scatter(kind, y, z);
  for (Column& column : columns_[kind]) {
    column.first = words_.size();
    for (int z = column.low; z <= column.high; ++z)
      words_.push_back(std::exchange(scratch_[column.position * layers_ + static_cast<std::size_t>(z)], 0));
    touched_[column.position] = 0;
  }
}

/// Puts the elements of one row into all the words that hold them.
void TileSweep::scatter(std::size_t kind, int y, int z) {
  const auto& board = whole_.boards_[kind];
  if (board.x.empty()) return;
  const int width = whole_.width_, x0 = corner_.x() - whole_.radius_, row = y - corner_.y() + whole_.radius_;
  const auto line = static_cast<std::size_t>(z * grid_.size().y() + y);
  const auto end = board.x.begin() + board.row_first[line + 1];
  for (auto x = std::lower_bound(board.x.begin() + board.row_first[line], end, x0); x != end && *x < x0 + width + 7;
       ++x)
    for (int ly = std::max(0, row - width + 1); ly <= std::min(7, row); ++ly)
      for (int lx = std::max(0, *x - x0 - width + 1); lx <= std::min(7, *x - x0); ++lx) {
        const auto position = static_cast<std::uint32_t>((row - ly) * width + *x - x0 - lx);
        if (!touched_[position]) {
          columns_[kind].push_back({position, z, z, 0});
          touched_[position] = static_cast<std::uint32_t>(columns_[kind].size());
        }
        columns_[kind][touched_[position] - 1].high = z;
        scratch_[position * layers_ + static_cast<std::size_t>(z)] |= std::uint64_t{1} << (lx + 8 * ly);
      }
}

void TileSweep::evaluate(std::size_t kind, const Column& column) {
  const auto& stencil = whole_.stencils_[kind];
  const int depth = stencil.high_z - stencil.low_z + 1, z0 = tile_.first.z();
  const std::int32_t* number = stencil.number.data() + static_cast<std::ptrdiff_t>(column.position) * depth;
  const std::uint64_t* words = words_.data() + column.first;
  const int from = std::max(stencil.low_z, column.low - z0 - 7), to = std::min(stencil.high_z, column.high - z0);
  for (int dz = from; dz <= to; ++dz) {
    const std::int32_t offset = number[dz - stencil.low_z];
    if (offset < 0) continue;
    int low = std::max(0, column.low - z0 - dz), high = std::min(7, column.high - z0 - dz);
    Lanes lanes{};
    for (int z = low; z <= high; ++z)
      lanes[static_cast<std::size_t>(z)] = words[z0 + dz + z - column.low] & tile_.lanes[static_cast<std::size_t>(z)];
    while (low <= high && !lanes[static_cast<std::size_t>(low)]) ++low;
    while (low <= high && !lanes[static_cast<std::size_t>(high)]) --high;
    if (low > high) continue;
    const Offset& of = stencil.offsets[static_cast<std::size_t>(offset)];
    if (kind == WholeField::kTurned)
      turned(of, lanes, low, high);
    else
      fixed(kind, of, lanes, low, high);
  }
}

/// Lanes whose element has a corner within its gates; their factors go to corner_factor_.
TileSweep::Lanes TileSweep::corners_seen(std::size_t kind, const Offset& offset, const Lanes& lanes, int low,
                                         int high) {
  const int height = whole_.height_;
  const double* row = whole_.corners_.data() + offset.corner_row * static_cast<std::size_t>(2 * height + 1) + height;
  const Index3 outside = offset.o + WholeField::kNormals[kind];
  Lanes seen{};
  for (auto z = static_cast<std::size_t>(low); z <= static_cast<std::size_t>(high); ++z)
    for_each_lane(lanes[z], [&](unsigned lane) {
      const int floor = whole_.floor_[place(outside, z, lane)], up = tile_.first.z() + static_cast<int>(z) - floor;
      if (floor == WholeField::kNoFloor || up < -height || up > height || row[up] == 0) return;
      corner_factor_[64 * z + lane] = row[up], seen[z] |= std::uint64_t{1} << lane;
    });
  return seen;
}

void TileSweep::fixed(std::size_t kind, const Offset& offset, Lanes lanes, int low, int high) {
  Lanes cornered{};
  if (kind != WholeField::kUp) cornered = corners_seen(kind, offset, lanes, low, high);
  const bool constant = offset.constant.xx != 0 || offset.constant.yy != 0 || offset.constant.zz != 0;
  if (!constant) lanes = cornered;
  if (lanes == Lanes{}) return;
  lanes = clear_lanes(offset, whole_.stencils_[kind].steps, lanes, low, high);
  const auto& lambda = whole_.model_.corner.lambda;
  const double area = grid_.resolution() * grid_.resolution();
  const Term corner =
      WholeField::term(Variance::about_normal(WholeField::kNormals[kind].cast<double>(), area * lambda.normal,
                                              area * lambda.tangential, area * lambda.vertical));
  for (auto z = static_cast<std::size_t>(low); z <= static_cast<std::size_t>(high); ++z) {
    Term* sum = sum_.data() + 64 * z;
    if (constant && lanes[z] == tile_.lanes[z])
      add(uniform_[z], offset.constant, 1);
    else if (constant)
      for_each_lane(lanes[z], [&](unsigned lane) { add(sum[lane], offset.constant, 1); });
    for_each_lane(lanes[z] & cornered[z],
                  [&](unsigned lane) { add(sum[lane], corner, corner_factor_[64 * z + lane]); });
  }
}

void TileSweep::turned(const Offset& offset, const Lanes& lanes, int low, int high) {
  constexpr double kInPlane = 1e-9;  // m
  const double a = grid_.resolution(), a2 = a * a;
  const Index3& o = offset.o;
  const double flat2 = o.head<2>().squaredNorm() + 0.25;
  const auto element = [&](std::size_t z, unsigned lane) -> const WholeField::Turned& {
    return whole_.turned_[static_cast<std::size_t>(whole_.turned_at_[place(o, z, lane)])];
  };
  Lanes wanted{};
  for (auto z = static_cast<std::size_t>(low); z <= static_cast<std::size_t>(high); ++z)
    for_each_lane(lanes[z], [&](unsigned lane) {
      const auto& e = element(z, lane);
      const double along = o.x() * e.m_x + o.y() * e.m_y, d2 = a2 * (flat2 + along);
      if (-a * (along + 0.5) <= kInPlane) return;
      double wall = 0, corner = 0;
      if (along >= offset.wall_low && along <= offset.wall_high) {
        const double x = -along * whole_.decay_steps_;
        const auto n = static_cast<std::size_t>(x);
        const double t = x - static_cast<double>(n);
        wall = offset.wall_factor * ((1 - t) * whole_.decay_[n] + t * whole_.decay_[n + 1]);
      }
      if (e.floor != WholeField::kNoFloor && whole_.terms_.in_wall_range(d2 + a2 * o.z() * o.z()))
        corner = whole_.terms_.corner_factor(d2, a * (tile_.first.z() + static_cast<int>(z) - e.floor - 0.5));
      if (wall == 0 && corner == 0) return;
      wanted[z] |= std::uint64_t{1} << lane;
      wall_[64 * z + lane] = wall, corner_factor_[64 * z + lane] = corner;
    });
  if (wanted == Lanes{}) return;
  const Lanes clear = clear_lanes(offset, whole_.stencils_[WholeField::kTurned].steps, wanted, low, high);
  for (auto z = static_cast<std::size_t>(low); z <= static_cast<std::size_t>(high); ++z)
    for_each_lane(wanted[z], [&](unsigned lane) {
      const auto& e = element(z, lane);
      if (!(clear[z] >> lane & 1) && hidden(offset, e, z, lane)) return;
      add(sum_[64 * z + lane], e.wall, wall_[64 * z + lane]);
      if (corner_factor_[64 * z + lane] != 0) add(sum_[64 * z + lane], e.corner, corner_factor_[64 * z + lane]);
    });
}

bool TileSweep::hidden(const Offset& offset, const WholeField::Turned& element, std::size_t z, unsigned lane) const {
  const auto& stencil = whole_.stencils_[WholeField::kTurned];
  const Vec3 c = offset.o.cast<double>() + 0.5 * Vec3(element.m_x, element.m_y, 0);
  const auto segment = open_part(Vec3::Constant(-0.5), 1, Vec3::Zero(), c);
  if (!segment) return false;
  const std::uint64_t* words = here() + z;
  for (std::size_t n = offset.first; n < offset.last; ++n)
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
