// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound/block_extents.hpp"

namespace backwash::reach {

BlockExtents::BlockExtents(const Reachability& reach, const BoundField& bounds, const Index3& size, double resolution)
    : bounds_(bounds),
      horizontal_(reach.horizontal.h_inf),
      vertical_(reach.vertical.h_inf),
      per_voxel_(1 / resolution),
      most_(half_widths(bounds.largest())) {
  extents_.count = (size + Index3::Constant(kEdge - 1)) / kEdge;
  extents_.rows.resize(static_cast<std::size_t>(extents_.count.y() * extents_.count.z()));
  own_ = extents_;
}

template <class Find>
const Vec3& BlockExtents::Blocks::at(const Index3& b, const Find& find) {
  auto& row = rows[static_cast<std::size_t>(b.z() * count.y() + b.y())];
  if (row.empty()) row.assign(static_cast<std::size_t>(count.x()), Vec3::Constant(-1));
  Vec3& here = row[static_cast<std::size_t>(b.x())];
  if (here.z() < 0) here = find(b);
  return here;
}

Vec3 BlockExtents::half_widths(const DisturbanceBound& w_bar) const noexcept {
  return {horizontal_ * w_bar.w[kX], horizontal_ * w_bar.w[kY], vertical_ * w_bar.w[kZ]};
}

/// By what blows in the block itself.
const Vec3& BlockExtents::own(const Index3& block) {
  return own_.at(block, [this](const Index3& b) {
    return half_widths(bounds_.max_over_voxels(b * kEdge, b * kEdge + Index3::Constant(kEdge - 1)));
  });
}

// By induction over the iteration from below: its boxes of voxels stay within those of the half widths so far, hence
// its bounds below the maximum there, hence its half widths below the next ones. Products and sums round monotonely.
// First by whole blocks, which is quick, then by voxels.
Vec3 BlockExtents::found(const Index3& block) {
  const auto wide = [this](const Vec3& h) { return !((h * per_voxel_).maxCoeff() <= kMost); };
  const auto voxels = [this](const Vec3& h) -> Index3 { return (h * per_voxel_ + Vec3::Constant(0.5)).cast<int>(); };
  if (wide(most_)) return most_;
  const Index3 low = block * kEdge, high = low + Index3::Constant(kEdge - 1), by = voxels(most_);
  Vec3 h = Vec3::Zero();
  map::for_each_voxel({(low - by).cwiseMax(0) / kEdge, ((high + by) / kEdge).cwiseMin(own_.count - Index3::Ones())},
                      [&](const Index3& b) { h = h.cwiseMax(own(b)); });
  const Index3 nearer = voxels(h);
  return half_widths(bounds_.max_over_voxels(low - nearer, high + nearer));
}

const Vec3& BlockExtents::at(const Index3& v) {
  return extents_.at(v / kEdge, [this](const Index3& block) { return found(block); });
}

}  // namespace backwash::reach
