// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/scan/seen_window.hpp"

#include <algorithm>
#include <utility>

namespace backwash::map {
namespace {

constexpr int kBits = 21, kHalf = 1 << (kBits - 1);  // of a part's place along an axis

bool before(const Index3& a, const Index3& b) noexcept {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

std::size_t SeenWindow::parts_of(const Index3& size) noexcept {
  const Index3 along = (size.array() + kEdge - 2) / kEdge + 1;
  return static_cast<std::size_t>(along.x()) * static_cast<std::size_t>(along.y()) *
         static_cast<std::size_t>(along.z());
}

SeenWindow::Key SeenWindow::key(const Index3& v) noexcept {
  const auto part = [&](int axis) { return static_cast<Key>((v[axis] >> kShift) + kHalf) << axis * kBits; };
  return part(0) | part(1) | part(2);
}

Index3 SeenWindow::low(Key key) noexcept {
  const auto part = [&](int axis) {
    return (static_cast<int>(key >> axis * kBits & ((Key{1} << kBits) - 1)) - kHalf) * kEdge;
  };
  return {part(0), part(1), part(2)};
}

std::size_t SeenWindow::within(const Index3& v) noexcept {
  const auto part = [&](int axis) { return static_cast<std::size_t>(v[axis] & (kEdge - 1)) << axis * kShift; };
  return part(0) | part(1) | part(2);
}

std::vector<Index3> SeenWindow::say(std::span<const Index3> voxels, Cell cell) {
  std::vector<Index3> changed;
  Part* part = nullptr;
  Key last = 0;
  for (const Index3& v : voxels) {
    if (const Key k = key(v); !part || k != last) {
      auto& owned = parts_[last = k];
      if (!owned) owned = std::make_unique<Part>();  // unknown throughout
      part = owned.get();
    }
    if (Cell& said = (*part)[within(v)]; said != cell) {
      said = cell;
      changed.push_back(v);
    }
  }
  return changed;
}

std::vector<Index3> SeenWindow::occupied(std::span<const Index3> voxels, std::int64_t stamp_ns) {
  std::vector<Index3> sorted(voxels.begin(), voxels.end());
  std::ranges::sort(sorted, before);
  const auto [same, fresh] = recent_.try_emplace(stamp_ns);
  if (!fresh && same->second != sorted) forgotten_ns_ = std::max(forgotten_ns_, stamp_ns);
  same->second = std::move(sorted);
  if (recent_.size() > kRecent) {
    forgotten_ns_ = std::max(forgotten_ns_, recent_.begin()->first);
    recent_.erase(recent_.begin());
  }
  return say(voxels, Cell::occupied);
}

std::vector<Index3> SeenWindow::freed(std::span<const Index3> voxels, std::int64_t stamp_ns) {
  const auto since = recent_.lower_bound(stamp_ns);
  const bool forgotten = stamp_ns <= forgotten_ns_;
  if (!forgotten && since == recent_.end()) return say(voxels, Cell::free);
  const auto listed = [&](const Index3& v) {
    return std::any_of(since, recent_.end(),
                       [&](const auto& r) { return std::ranges::binary_search(r.second, v, before); });
  };
  std::vector<Index3> left;
  for (const Index3& v : voxels)
    if (!listed(v) && !(forgotten && at(v) == Cell::occupied)) left.push_back(v);
  return say(left, Cell::free);
}

void SeenWindow::restart() noexcept {
  recent_.clear();
  forgotten_ns_ = INT64_MIN;
}

Cell SeenWindow::at(const Index3& v) const noexcept {
  const auto found = parts_.find(key(v));
  return found == parts_.end() ? Cell::unknown : (*found->second)[within(v)];
}

SeenWindow::Evicted SeenWindow::evict(const VoxelBox& window) {
  Evicted gone;
  if (parts_.size() <= most_) return gone;
  std::vector<std::pair<int, Key>> far;  // voxels between a part and the window along the axis where it is most
  for (const auto& [k, part] : parts_) {
    const Index3 from = low(k), to = from.array() + (kEdge - 1);
    const int apart = (window.low - to).cwiseMax(from - window.high).maxCoeff();
    if (apart > 0) far.emplace_back(apart, k);
  }
  const std::size_t count = std::min(parts_.size() - most_, far.size());
  std::ranges::sort(far, std::greater());
  for (std::size_t n = 0; n < count; ++n) {
    const auto found = parts_.find(far[n].second);
    const Index3 from = low(found->first);
    for_each_voxel({from, from.array() + (kEdge - 1)}, [&](const Index3& v) {
      if (const Cell said = (*found->second)[within(v)]; said != Cell::unknown) gone.emplace_back(v, said);
    });
    parts_.erase(found);
  }
  return gone;
}

void SeenWindow::forget_free() {
  for (auto at = parts_.begin(); at != parts_.end();) {
    std::ranges::replace(*at->second, Cell::free, Cell::unknown);
    at = std::ranges::count(*at->second, Cell::occupied) == 0 ? parts_.erase(at) : std::next(at);
  }
}

}  // namespace backwash::map
