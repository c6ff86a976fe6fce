// SPDX-License-Identifier: BSD-3-Clause
// An estimator and a mapper in one, whose vehicle goes along an endless corridor: odometry at 100 Hz, and its window's
// two clouds five times a second, for tests/system/window_memory.sh.
//   window_walker DOMAIN NAMESPACE X,Y,Z METRES SPEED       X, Y, Z: edges of the window, m; voxels of 0.1 m
// Stands until a line comes on stdin; then it goes, and says "at METRES" each second.
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "core/types/geometry.hpp"
#include "services/dds/topics.hpp"

namespace dds = backwash::dds;
using backwash::Index3;
using backwash::Vec3;
using namespace std::chrono_literals;

namespace {

constexpr double kVoxel = 0.1, kHalfWidth = 1.5, kHeight = 2.4;  // m

/// Floor, ceiling, walls, and a pillar at each fourth metre: what it has left is not what comes.
bool blocked(const Vec3& p) {
  const double along = p.x() - 4 * std::floor(p.x() / 4);
  return std::abs(p.y()) > kHalfWidth || p.z() < 0 || p.z() > kHeight || (along < 0.3 && p.y() > 1);
}

void send(dds::Writer<dds::PointCloud>& writer, std::vector<float>& points,
          const builtin_interfaces_msg_dds__Time_& stamp) {
  static const std::string frame = "map", names[] = {"x", "y", "z"};
  static dds::PointField fields[3];
  for (std::uint32_t n = 0; n < 3; ++n) fields[n] = {dds::c_string(names[n]), 4 * n, 7, 1};
  dds::PointCloud m{};
  m.header = {stamp, dds::c_string(frame)};
  m.height = 1;
  m.point_step = 12;
  m.width = static_cast<std::uint32_t>(points.size() / 3);
  m.row_step = m.width * m.point_step;
  m.fields = {3, 3, fields, false};
  m.data = {m.row_step, m.row_step, reinterpret_cast<std::uint8_t*>(points.data()), false};
  writer.write(m);
}

}  // namespace

int main(int argc, char** argv) {
  double x = 0, y = 0, z = 0;
  if (argc != 6 || std::sscanf(argv[3], "%lf,%lf,%lf", &x, &y, &z) != 3) return 64;
  const double metres = std::stod(argv[4]), speed = std::stod(argv[5]);
  const dds::Participant participant(static_cast<std::uint32_t>(std::stoi(argv[1])), "lo");
  const std::string name_space = argv[2], map = "map", body = "base_link";
  auto odometry = dds::make_writer<dds::Odometry>(participant, name_space);
  const auto clouds = [&](const char* name) {
    return dds::Writer<dds::PointCloud>(participant, dds::TopicOf<dds::PointCloud>::type(),
                                        dds::topic(name_space, name), dds::Delivery::scans);
  };
  auto occupied = clouds("window_occupied"), free = clouds("window_free");
  const Index3 half = (Vec3(x, y, z) / (2 * kVoxel)).array().round().cast<int>();
  std::atomic<bool> goes = false;
  std::jthread started([&goes] { goes = std::getchar() != EOF; });
  double at = 0;
  auto due = std::chrono::steady_clock::now();
  for (int n = 0; at < metres; ++n) {
    if (goes) at += 0.01 * speed;
    dds::Odometry m{};
    m.header = {dds::wall_clock(), dds::c_string(map)};
    m.child_frame_id = dds::c_string(body);
    m.pose.pose = {{at, 0, 1}, {0, 0, 0, 1}};
    m.twist.twist.linear.x = goes ? speed : 0;
    odometry.write(m);
    if (goes && n % 20 == 0) {
      std::vector<float> walls, air;
      const Index3 low = Index3(static_cast<int>(std::lround(at / kVoxel)), 0, 10) - half;
      for (int k = 0; k < 2 * half.z(); ++k)
        for (int j = 0; j < 2 * half.y(); ++j)
          for (int i = 0; i < 2 * half.x(); ++i) {
            const Vec3 p = kVoxel * ((low + Index3(i, j, k)).cast<double>() + Vec3::Constant(0.5));
            auto& points = blocked(p) ? walls : air;
            for (const double c : p) points.push_back(static_cast<float>(c));
          }
      const auto stamp = dds::wall_clock();
      send(free, air, stamp);
      send(occupied, walls, stamp);
    }
    if (goes && n % 100 == 0) {
      std::printf("at %.1f\n", at);
      std::fflush(stdout);
    }
    due += 10ms;
    std::this_thread::sleep_until(due);
  }
  return 0;
}
