// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/way.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <new>
#include <queue>
#include <utility>

namespace backwash::plan {
namespace {

// Of the heuristic: shortcuts straighten the way, and fewer blocks are looked at. Single voxels are tried last.
constexpr float kWeight = 1.5f, kWeightOfVoxels = 2.5f;
constexpr std::size_t kBetweenClocks = 256;  ///< blocks

/// Cubes of `edge` voxels, numbered with x fastest.
class Blocks {
 public:
  Blocks(const SafeView& space, int edge)
      : space_(&space), edge_(edge), size_((space.space().size() + Index3::Constant(edge - 1)) / edge) {}

  std::size_t count() const noexcept {
    return static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y()) *
           static_cast<std::size_t>(size_.z());
  }
  std::size_t linear(const Index3& b) const noexcept {
    const auto nx = static_cast<std::size_t>(size_.x()), ny = static_cast<std::size_t>(size_.y());
    return static_cast<std::size_t>(b.x()) +
           nx * (static_cast<std::size_t>(b.y()) + ny * static_cast<std::size_t>(b.z()));
  }
  Index3 of(const Vec3& p_W) const noexcept { return space_->space().index(p_W) / edge_; }
  bool inside(const Index3& b) const noexcept { return (b.array() >= 0).all() && (b.array() < size_.array()).all(); }
  Vec3 centre(const Index3& b) const noexcept {
    const auto& s = space_->space();
    return s.origin() + s.resolution() * (edge_ * (b.cast<double>() + Vec3::Constant(0.5)));
  }
  /// Whether all voxels of the box about two cubes may be passed.
  bool clear(const Index3& a, const Index3& b) const noexcept {
    const Index3 high = edge_ * a.cwiseMax(b) + Index3::Constant(edge_ - 1);
    return space_->clear(edge_ * a.cwiseMin(b), high.cwiseMin(space_->space().size() - Index3::Ones()));
  }
  bool single() const noexcept { return edge_ == 1; }

 private:
  const SafeView* space_;
  int edge_;
  Index3 size_;
};

Index3 step_of(std::uint32_t number) noexcept {
  const int n = static_cast<int>(number);
  return Index3(n % 3, n / 3 % 3, n / 9) - Index3::Ones();
}

/// A* from one cube to another.
class BlockSearch {
 public:
  BlockSearch(const Blocks& blocks, const Index3& from, const Index3& to)
      : blocks_(blocks),
        from_(from),
        to_(to),
        cells_(static_cast<Cell*>(std::calloc(blocks.count(), sizeof(Cell))), &std::free) {
    if (!cells_) throw std::bad_alloc();
    cells_[blocks_.linear(from)] = {0, kStart};
    open_.push({0, from});
  }

  enum class State { open, arrived, closed };
  /// Expands a cube.
  State expand() {
    if (open_.empty()) return State::closed;
    const Index3 b = open_.top().block;
    open_.pop();
    if (b == to_) return State::arrived;
    Cell& here = cells_[blocks_.linear(b)];
    if (here.number & kClosed) return State::open;
    here.number |= kClosed;
    for (std::uint32_t n = 0; n < 27; ++n)
      if (const Index3 u = b + step_of(n); n != kNoStep && blocks_.inside(u)) consider(b, u, n, here.g);
    return State::open;
  }
  /// The cubes from `from` to `to`. Precondition: arrived.
  std::vector<Index3> chain() const {
    std::vector<Index3> cubes;
    for (Index3 b = to_; b != from_; b -= step_of((cells_[blocks_.linear(b)].number & kNumber) - 1)) cubes.push_back(b);
    cubes.push_back(from_);
    std::ranges::reverse(cubes);
    return cubes;
  }

 private:
  static constexpr std::uint32_t kNoStep = 13, kStart = 28, kNumber = 31, kClosed = 32;
  struct Cell {
    float g;               ///< length of the way here, cubes
    std::uint32_t number;  ///< 0: not seen yet; else 1 + the step that led here, and kClosed once expanded
  };
  struct Open {
    float f;
    Index3 block;
    bool operator>(const Open& o) const noexcept { return f > o.f; }
  };

  /// Length of the shortest way in empty space, cubes.
  float empty_way(const Index3& b) const noexcept {
    const Index3 d = (b - to_).cwiseAbs();
    const int most = d.maxCoeff(), least = d.minCoeff(), middle = d.sum() - most - least;
    return static_cast<float>(most - middle) + std::sqrt(2.0f) * static_cast<float>(middle - least) +
           std::sqrt(3.0f) * static_cast<float>(least);
  }
  void consider(const Index3& b, const Index3& u, std::uint32_t step, float g_before) {
    Cell& there = cells_[blocks_.linear(u)];
    const float g = g_before + std::sqrt(static_cast<float>((u - b).squaredNorm()));
    if (there.number & kClosed || (there.number != 0 && there.g <= g)) return;
    const bool leaves = b == from_ && !blocks_.single(), arrives = u == to_ && !blocks_.single();
    if (!arrives && !blocks_.clear(leaves ? u : b, u)) return;
    there = {g, step + 1};
    open_.push({g + (blocks_.single() ? kWeightOfVoxels : kWeight) * empty_way(u), u});
  }

  const Blocks& blocks_;
  Index3 from_, to_;
  std::unique_ptr<Cell[], decltype(&std::free)> cells_;  // zero pages, which cost nothing where no way is looked for
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open_;
};

}  // namespace

Way way_over_blocks(const SafeView& space, const Vec3& from_W, const Vec3& to_W, int edge, std::size_t most_expanded,
                    std::chrono::steady_clock::time_point deadline) {
  const Blocks blocks(space, edge);
  const Index3 from = blocks.of(from_W), to = blocks.of(to_W);
  std::array<BlockSearch, 2> both{BlockSearch(blocks, from, to), BlockSearch(blocks, to, from)};
  Way way{Way::Status::given_up, {}, 0};
  for (std::size_t turn = 0; way.expanded < most_expanded; turn = 1 - turn, ++way.expanded) {
    if (way.expanded % kBetweenClocks == 0 && std::chrono::steady_clock::now() > deadline) return way;
    const auto state = both[turn].expand();
    if (state == BlockSearch::State::open) continue;
    way.status = state == BlockSearch::State::closed ? Way::Status::none : Way::Status::found;
    if (way.status == Way::Status::none) return way;
    for (const Index3& b : both[turn].chain()) way.points.push_back(blocks.centre(b));
    if (turn == 1) std::ranges::reverse(way.points);
    if (way.points.size() == 1) way.points.push_back(to_W);
    way.points.front() = from_W;
    way.points.back() = to_W;
    return way;
  }
  return way;
}

}  // namespace backwash::plan
