// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/element_buckets.hpp"

namespace backwash::field {

ElementBuckets::ElementBuckets(const map::OccupancyGrid& grid, std::vector<Element> elements)
    : origin_W_(grid.origin() -
                Vec3::Constant(grid.resolution())),  // oblique elements may stand out of the grid by a/2
      count_(((grid.size().cast<double>().array() + 2) * grid.resolution() / kEdge).ceil().cast<int>()) {
  const auto bucket = [this](const Element& e) {
    const Index3 b = bucket_of(e.c_W);
    return column(b.x(), b.y()) + static_cast<std::size_t>(b.z());
  };
  first_.assign(column(0, count_.y()) + 1, 0);
  for (const Element& e : elements) ++first_[bucket(e) + 1];
  for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
  std::ranges::stable_sort(elements, {}, bucket);
  elements_ = std::move(elements);
  places_.reserve(elements_.size());
  for (const Element& e : elements_) places_.push_back({e.c_W, e.normal});
}

}  // namespace backwash::field
