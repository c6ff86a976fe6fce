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
  using Gates = WholeField::Stencil::Gates;

 public:
  explicit TileSweep(const WholeField& whole)
      : whole_(whole),
        grid_(*whole.grid_),
        layers_(static_cast<std::size_t>(grid_.size().z())),
        positions_(static_cast<std::size_t>(whole.width_) * static_cast<std::size_t>(whole.width_)),
        occupied_(layers_ * positions_ + kBlock),
        scratch_(layers_ * positions_),
        scratch_floors_(layers_ * positions_, kNoFloors),
        row_bytes_(static_cast<std::size_t>(whole.width_)),
        row_floors_(static_cast<std::size_t>(whole.width_), kNoFloors),
        touched_(positions_) {
    for (int lane = 0; lane < 64; ++lane)
      lane_step_[static_cast<std::size_t>(lane)] =
          whole.column_place(Index3(lane % 8, lane / 8, 0)) - whole.column_place(Index3::Zero());
  }

  void run(const Tile& tile) {
    if (tile.first.head<2>() != corner_) open_window(tile.first);
    tile_ = tile;
    std::fill(sum_.begin() + 64 * tile.low, sum_.begin() + 64 * (tile.high + 1), Term{});
    uniform_.fill({});
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
  static constexpr std::size_t kBlock = 4;  // layers; words past a view's last layer are read, and must be empty
  /// Lowest and highest of the floors under some elements' corners.
  struct Floors {
    std::int16_t low, high;
    void take(std::int16_t floor) noexcept { take({floor, floor}); }
    void take(const Floors& o) noexcept { low = std::min(low, o.low), high = std::max(high, o.high); }
  };
  static constexpr Floors kNoFloors{INT16_MAX, INT16_MIN};
  /// The elements of one class at one position: words of the layers low … high.
  struct Column {
    std::uint32_t position;
    int low, high;
    Floors floors;
    std::size_t first;  // of words_ and floors_: that of layer `low`
  };
  /// What one offset sees: elements seen from each layer of the tile; none outside low … high.
  struct View {
    const Gates* gates;
    const Floors* floors;   // of the elements seen from layer `low`; others follow
    std::size_t low, high;  // layers of the tile
  };

  template <typename Visit>
  static void for_each_lane(std::uint64_t lanes, const Visit& visit) {
    for (; lanes; lanes &= lanes - 1) visit(static_cast<unsigned>(std::countr_zero(lanes)));
  }
  static void add(Term& sum, const Term& t, double factor) noexcept {
    sum.xx += factor * t.xx, sum.xy += factor * t.xy, sum.yy += factor * t.yy, sum.zz += factor * t.zz;
  }

  static void add(Term& sum, const std::array<float, 4>& t, double factor) noexcept {
    sum.xx += factor * t[0], sum.xy += factor * t[1], sum.yy += factor * t[2], sum.zz += factor * t[3];
  }

  void open_window(const Index3& first);
  void open_occupied();
  void open_columns(std::size_t kind);
  void scatter(std::size_t kind, int y, int z);
  void evaluate(std::size_t kind, const Column& column);
  /// Whether an element with a floor within limits may have a corner term in a layer of the map.
  static bool may_have_corner(const Gates& gates, const Floors& floors, int z) noexcept {
    return floors.high != WholeField::kNoFloor && z - floors.high <= gates.corner_high &&
           z - std::max<int>(floors.low, 0) >= gates.corner_low;
  }
  void ground(const Offset& offset, const View& view);
  void axis(std::size_t kind, const Offset& offset, const View& view);
  void turned(std::size_t kind, const Offset& offset, const View& view);
  bool hidden(std::size_t kind, const Offset& offset, const Gates& gates, const WholeField::Turned& element,
              std::size_t z, unsigned lane) const;

  /// The words of the tile in occupied_.
  const std::uint64_t* here() const noexcept {
    return occupied_.data() + positions_ / 2 * layers_ + static_cast<std::size_t>(tile_.first.z());
  }
  /// Puts the lanes whose path meets no occupied voxel into clear_: the layers of a block together, in registers.
  void clear(const std::vector<std::int32_t>& steps, const View& view) noexcept {
    const std::int32_t* const begin = steps.data() + view.gates->first;
    const std::int32_t* const end = steps.data() + view.gates->last;
    std::size_t z = view.low;
    for (; z + 1 <= view.high; z += kBlock) clear_block<kBlock>(begin, end, z);
    if (z == view.high) clear_block<1>(begin, end, z);
  }
  template <std::size_t count>
  void clear_block(const std::int32_t* step, const std::int32_t* end, std::size_t z) noexcept {
    const std::uint64_t* words = here() + z;
    std::array<std::uint64_t, count> left;
    std::copy_n(lanes_.begin() + static_cast<std::ptrdiff_t>(z), count, left.begin());
    const auto meet = [&](const std::uint64_t* word) {
      for (std::size_t n = 0; n < count; ++n) left[n] &= ~word[n];
    };
    for (; end - step >= 4; step += 4) {
      for (int n = 0; n < 4; ++n) meet(words + step[n]);
      std::uint64_t any = 0;
      for (const std::uint64_t word : left) any |= word;
      if (!any) break;
    }
    if (end - step < 4)
      for (; step != end; ++step) meet(words + *step);
    std::copy_n(left.begin(), count, clear_.begin() + static_cast<std::ptrdiff_t>(z));
  }
  const WholeField& whole_;
  const map::OccupancyGrid& grid_;
  std::size_t layers_, positions_;
  Eigen::Vector2i corner_{-1, -1};  // of the window's middle, voxels
  std::vector<std::uint64_t> occupied_;
  std::array<std::vector<Column>, WholeField::kClasses> columns_;
  std::vector<std::uint64_t> words_;          // of the columns
  std::vector<Floors> floors_;                // the same
  std::vector<std::uint64_t> scratch_;        // of the columns while they are made; zero between
  std::vector<Floors> scratch_floors_;        // the same
  std::vector<std::uint64_t> row_bytes_;      // the same
  std::vector<Floors> row_floors_;            // the same
  std::array<std::ptrdiff_t, 64> lane_step_;  // in column_place
  std::vector<std::uint32_t> touched_;        // per position: 1 + its column, 0: none yet
  Tile tile_{};
  std::array<std::uint64_t, WholeField::kLayers + kBlock> lanes_{},
      clear_{};  // of the offset in hand: elements, and those whose path is clear; between the view's limits
  std::array<Term, 64 * WholeField::kLayers> sum_;
  std::array<Term, WholeField::kLayers> uniform_;  // what all voxels of a layer have in common
};

void TileSweep::open_window(const Index3& first) {
  corner_ = first.head<2>();
  open_occupied();
  words_.clear(), floors_.clear();
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
          occupied_[static_cast<std::size_t>(wy * width + column) * layers_ + static_cast<std::size_t>(z)] |=
              byte << 8 * (row - wy);
      }
    }
}

void TileSweep::open_columns(std::size_t kind) {
  columns_[kind].clear();
  const int y0 = corner_.y() - whole_.radius_;
  for (int z = 0; z < grid_.size().z(); ++z)
    for (int y = std::max(0, y0); y < std::min(grid_.size().y(), y0 + whole_.width_ + 7); ++y) scatter(kind, y, z);
  std::ranges::sort(columns_[kind], {}, &Column::position);
  for (Column& column : columns_[kind]) {
    column.first = words_.size();
    for (int z = column.low; z <= column.high; ++z) {
      const std::size_t n = column.position * layers_ + static_cast<std::size_t>(z);
      words_.push_back(std::exchange(scratch_[n], 0));
      floors_.push_back(std::exchange(scratch_floors_[n], kNoFloors));
    }
    touched_[column.position] = 0;
  }
}

/// Slides a byte along the elements of one row and puts it into the words of the eight positions along y that hold it.
void TileSweep::scatter(std::size_t kind, int y, int z) {
  const auto& board = whole_.boards_[kind];
  if (board.x.empty()) return;
  const auto& stencil = whole_.stencils_[kind];
  const int width = whole_.width_, x0 = corner_.x() - whole_.radius_, row = y - corner_.y() + whole_.radius_;
  const auto line = static_cast<std::size_t>(z * grid_.size().y() + y);
  const auto end = board.x.begin() + board.row_first[line + 1];
  int low = width, high = -1;
  for (auto x = std::lower_bound(board.x.begin() + board.row_first[line], end, x0); x != end && *x < x0 + width + 7;
       ++x) {
    const std::int16_t floor = board.floor[static_cast<std::size_t>(x - board.x.begin())];
    const int first = std::max(0, *x - x0 - 7), last = std::min(width - 1, *x - x0);
    low = std::min(low, first), high = std::max(high, last);
    for (int wx = first; wx <= last; ++wx) {
      row_bytes_[static_cast<std::size_t>(wx)] |= std::uint64_t{1} << (*x - x0 - wx);
      row_floors_[static_cast<std::size_t>(wx)].take(floor);
    }
  }
  for (int wx = low; wx <= high; ++wx) {
    const std::uint64_t byte = std::exchange(row_bytes_[static_cast<std::size_t>(wx)], 0);
    const Floors floors = std::exchange(row_floors_[static_cast<std::size_t>(wx)], kNoFloors);
    if (!byte) continue;
    for (int ly = std::max(0, row - width + 1); ly <= std::min(7, row); ++ly) {
      const auto position = static_cast<std::uint32_t>((row - ly) * width + wx);
      if (stencil.first[position] == stencil.first[position + 1]) continue;
      if (!touched_[position]) {
        columns_[kind].push_back({position, z, z, kNoFloors, 0});
        touched_[position] = static_cast<std::uint32_t>(columns_[kind].size());
      }
      Column& column = columns_[kind][touched_[position] - 1];
      const std::size_t n = position * layers_ + static_cast<std::size_t>(z);
      column.high = z, column.floors.take(floors);
      scratch_[n] |= byte << 8 * ly;
      scratch_floors_[n].take(floors);
    }
  }
}

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
