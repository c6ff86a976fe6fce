// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/disturbance_field.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <optional>

#include "core/map/lattice.hpp"

namespace backwash::field {
namespace {

std::vector<Element> elements_of(const map::OccupancyGrid& grid, Element::Kind kind, bool unknown_floor = false) {
  std::vector<Element> elements = surface_elements(grid, unknown_floor);
  std::erase_if(elements, [kind](const Element& e) { return e.kind != kind; });
  return elements;
}

bool nonzero(const Variance& v) noexcept { return v.xx != 0 || v.yy != 0 || v.zz != 0; }

/// Elements with a term, until their lines of sight are looked at together: where the box about all of them is empty,
/// which one look shows, all are seen.
class PendingTerms {
 public:
  PendingTerms(const SightMap& sight, const Vec3& p_W) : sight_(sight), view_(sight.viewpoint(p_W)) {}

  /// Takes an element's term in; calls add(first, second) for those of the seen ones at some time, in their order.
  template <typename Add>
  void take(const Vec3& c_W, const Variance& first, const Variance& second, const Add& add) {
    PendingTerm& term = pending_[count_++];
    term = {sight_.open_part(view_, c_W), first, second};
    if (term.line) {
      const Vec3 &from = term.line->from, to = from + term.line->delta;
      low_ = low_.cwiseMin(from.cwiseMin(to));
      high_ = high_.cwiseMax(from.cwiseMax(to));
    }
    if (count_ == pending_.size()) settle(add);
  }
  template <typename Add>
  void settle(const Add& add) {
    const bool all = low_.x() > high_.x() || sight_.empty(low_, high_);
    for (const PendingTerm& c : std::span(pending_).first(count_))
      if (all || !c.line || sight_.clear(view_, *c.line)) add(c.first, c.second);
    count_ = 0;
    low_.setConstant(kFar);
    high_.setConstant(-kFar);
  }

 private:
  static constexpr double kFar = 1e300;
  struct PendingTerm {
    std::optional<LineSegment> line;
    Variance first, second;
  };
  const SightMap& sight_;
  SightMap::Viewpoint view_;
  std::array<PendingTerm, 8> pending_;
  std::size_t count_ = 0;
  Vec3 low_ = Vec3::Constant(kFar), high_ = Vec3::Constant(-kFar);
};

}  // namespace

ProximityField::ProximityField(const map::OccupancyGrid& grid, const Model& model)
    : grid_(&grid),
      model_(model),
      terms_(model, grid.resolution()),
      sight_(grid),
      up_(grid, elements_of(grid, Element::Kind::up, model.unknown_floor)),
      lateral_(grid, elements_of(grid, Element::Kind::lateral)) {}

Breakdown ProximityField::at(const Vec3& p_W) const {
  Breakdown b;
  b.base = Variance::horizontal_vertical(model_.base.horizontal, model_.base.vertical);
  // The terms first: most elements in the boxes are outside every gate, and the line of sight is the dear part.
  PendingTerms pending(sight_, p_W);
  const auto add_ground = [&](const Variance& ground, const Variance&) { b.ground += ground; };
  const auto& g = model_.ground;
  std::optional<double> slope;
  if (g.theta_max < 1.5) slope = std::tan(g.theta_max + 1e-6);
  up_.for_each_near(p_W, {g.l_max, g.r0, g.l_footprint_max, slope}, [&](const Element& e) {
    const Variance ground = terms_.ground(e, p_W);
    if (nonzero(ground)) pending.take(e.c_W, ground, {}, add_ground);
  });
  pending.settle(add_ground);
  const auto add_lateral = [&](const Variance& corner, const Variance& wall) {
    b.corner += corner;
    b.wall += wall;
  };
  lateral_.for_each_near(p_W, {.ball = model_.wall.l_max}, [&](const Element& e) {
    const Variance corner = terms_.corner(e, p_W), wall = terms_.wall(e, p_W);
    if (nonzero(corner) || nonzero(wall)) pending.take(e.c_W, corner, wall, add_lateral);
  });
  pending.settle(add_lateral);
  return b;
}

DisturbanceField::DisturbanceField(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels)
    : origin_W_(grid.origin()),
      resolution_(grid.resolution()),
      size_(grid.size()),
      listed_((grid.cell_count() + kWord - 1) / kWord) {
  for (const std::size_t n : voxels) listed_[n / kWord] |= std::uint64_t{1} << n % kWord;
  std::uint32_t count = 0;
  before_.reserve(listed_.size());
  for (const std::uint64_t word : listed_) {
    before_.push_back(count);
    count += static_cast<std::uint32_t>(std::popcount(word));
  }
  sigma_.assign(count, {-1, 0, 0, 0});
}

DisturbanceField::DisturbanceField(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels,
                                   const DisturbanceField& old, const map::VoxelBox& anew)
    : DisturbanceField(grid, voxels) {
  for (const std::size_t n : voxels)
    if (old.has(n) && !anew.contains(map::voxel(size_, n))) sigma_[slot(n)] = old.sigma_[old.slot(n)];
}

void DisturbanceField::fill(const ProximityField& exact, std::span<const std::size_t> voxels) {
  for (const std::size_t n : voxels) set(n, exact.at(exact.grid().center(exact.grid().voxel(n))).sigma());
}

void DisturbanceField::fill(const WholeField& whole, std::size_t begin, std::size_t end) {
  whole.evaluate(begin, end, [this](std::size_t n, const Variance& s) { set(n, s); });
}

void DisturbanceField::scale(const Extension& extension, std::span<const std::size_t> voxels) {
  for (const std::size_t n : voxels) {
    if (!has(n)) continue;
    const auto factor = static_cast<float>(std::exp(extension.at(map::voxel(size_, n)).ln_variance));
    for (float& s : sigma_[slot(n)]) s *= factor;
  }
}

void DisturbanceField::set(std::size_t n, const Variance& s) noexcept {
  assert(listed(n) && s.xz == 0 && s.yz == 0);
  sigma_[slot(n)] = {static_cast<float>(s.xx), static_cast<float>(s.xy), static_cast<float>(s.yy),
                     static_cast<float>(s.zz)};
}

std::size_t DisturbanceField::slot(std::size_t n) const noexcept {
  const std::uint64_t lower = (std::uint64_t{1} << n % kWord) - 1;
  return before_[n / kWord] + static_cast<std::size_t>(std::popcount(listed_[n / kWord] & lower));
}

bool DisturbanceField::has(const Index3& v) const noexcept {
  return map::inside(size_, v) && has(map::linear(size_, v));
}

Variance DisturbanceField::at(const Index3& v) const noexcept { return at(map::linear(size_, v)); }

Variance DisturbanceField::at(std::size_t n) const noexcept {
  const Stored& s = sigma_[slot(n)];
  return {s[0], s[1], 0, s[2], 0, s[3]};
}

Variance DisturbanceField::interpolated(const Vec3& p_W, const Variance& fallback) const noexcept {
  const Vec3 x = (p_W - origin_W_) / resolution_ - Vec3::Constant(0.5);  // voxel centres at the integers
  // Beyond one voxel around the grid nothing is stored; also keeps the conversion to int within its range.
  if (!((x.array() > -1).all() && (x.array() < size_.array().cast<double>()).all())) return fallback;
  Variance sum;
  double total = 0;
  map::for_corners(x, [&](const Index3& v, const Vec3& share) {
    if (!has(v)) return;
    sum += share.prod() * at(v);
    total += share.prod();
  });
  return total > 0 ? (1 / total) * sum : fallback;
}

}  // namespace backwash::field
