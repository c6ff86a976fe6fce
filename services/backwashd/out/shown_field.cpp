// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_field.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace backwash::daemon {

ShownField::ShownField(const plan::World& world, const Vec3& vehicle_W, std::string map_frame)
    : map_frame_(std::move(map_frame)) {
  const map::OccupancyGrid& grid = world.grid;
  const Vec3 around(kAround, kAround, 0);
  const Index3 last = grid.size() - Index3::Ones();
  const Index3 low = grid.index(vehicle_W - around).cwiseMax(0), high = grid.index(vehicle_W + around).cwiseMin(last);
  map::for_each_voxel({low, high}, [&](const Index3& v) {
    const auto w = world.bounds.at(v).w;
    if (!(w[kZ] > 0)) return;
    const Vec3 p_W = grid.center(v);
    const double level = std::max({w[kX], w[kY], w[kXyPlus], w[kXyMinus]});
    const std::array<float, kFields.size()> point = {static_cast<float>(p_W.x()), static_cast<float>(p_W.y()),
                                                     static_cast<float>(p_W.z()), static_cast<float>(level),
                                                     static_cast<float>(w[kZ])};
    const std::size_t at = data_.size();
    data_.resize(at + kPointBytes);
    std::memcpy(data_.data() + at, point.data(), kPointBytes);
  });

  constexpr std::uint8_t kFloat32 = 7;  // sensor_msgs/PointField
  for (std::size_t n = 0; n < kFields.size(); ++n) {
    names_[n] = kFields[n];
    fields_[n] = {names_[n].data(), static_cast<std::uint32_t>(n * sizeof(float)), kFloat32, 1};
  }
  cloud_.header.stamp = dds::wall_clock();
  cloud_.header.frame_id = map_frame_.data();
  cloud_.height = 1;
  cloud_.width = static_cast<std::uint32_t>(data_.size() / kPointBytes);
  cloud_.fields = {kFields.size(), kFields.size(), fields_.data(), false};
  cloud_.point_step = kPointBytes;
  cloud_.row_step = static_cast<std::uint32_t>(data_.size());
  cloud_.data = {cloud_.row_step, cloud_.row_step, data_.data(), false};
  cloud_.is_dense = true;
}

bool FieldShows::due(const plan::World& world, const Vec3& vehicle_W, std::int64_t now_ns) {
  constexpr std::int64_t kPeriod = 1'000'000'000;
  if (last_ns_ != 0 && now_ns - last_ns_ < kPeriod) return false;
  const bool same_layer = world_ && world.grid.index(vehicle_W).z() == world.grid.index(vehicle_W_).z();
  const bool near = (vehicle_W - vehicle_W_).head<2>().norm() < ShownField::kAround / 10;
  if (world_ == &world && same_layer && near) return false;
  world_ = &world;
  vehicle_W_ = vehicle_W;
  last_ns_ = now_ns;
  return true;
}

}  // namespace backwash::daemon
