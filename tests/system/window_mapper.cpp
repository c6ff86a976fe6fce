// SPDX-License-Identifier: BSD-3-Clause
// A mapper whose occupancy window moves along, as ROG-Map or nvblox are: what is occupied and what is free around the
// vehicle, five times a second, on rt/NAMESPACE/window_occupied and window_free, in two clouds with one stamp.
//   window_mapper DOMAIN NAMESPACE MAP X,Y,Z [CUBE …]    X, Y, Z: edges of the window, m
// CUBE: x,y,z,edge,from,to: a cube that the map does not have, from when the vehicle has passed x = from until it has
//                           passed x = to.
//   window_mapper DOMAIN NAMESPACE MAP X,Y,Z FAULT       sends what looks like something else, for 3 s: frame,
//   distances,
//                                                        finer, nan
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/map/load_map.hpp"
#include "core/map/voxel_box.hpp"
#include "services/dds/topics.hpp"

namespace dds = backwash::dds;
namespace map = backwash::map;
using backwash::Index3;
using backwash::Vec3;
using namespace std::chrono_literals;

namespace {

struct Cube {
  Vec3 center;
  double edge, from, to;
  bool there = false, gone = false;
  void look(double vehicle_x) {
    there = there || vehicle_x >= from;
    gone = gone || vehicle_x > to;
  }
  bool holds(const Vec3& p) const { return there && !gone && (p - center).cwiseAbs().maxCoeff() < edge / 2; }
};

/// A topic of clouds, with the columns that a fault gives it.
class Clouds {
 public:
  Clouds(const dds::Participant& participant, const std::string& topic, std::string fault)
      : fault_(std::move(fault)),
        frame_(fault_ == "frame" ? "camera_init" : "map"),
        writer_(participant, dds::TopicOf<dds::PointCloud>::type(), topic, dds::Delivery::scans) {}
  void send(std::vector<float> points, const builtin_interfaces_msg_dds__Time_& stamp) {
    std::uint32_t columns = 3;
    if (fault_ == "distances") {
      std::vector<float> with;
      for (std::size_t n = 0; n < points.size(); n += 3) {
        with.insert(with.end(), points.begin() + static_cast<std::ptrdiff_t>(n),
                    points.begin() + static_cast<std::ptrdiff_t>(n + 3));
        with.push_back(0.01f * static_cast<float>(n % 300));
      }
      points = std::move(with);
      columns = 4;
    }
    if (fault_ == "finer")
      for (float& x : points) x *= 0.5f;
    if (fault_ == "nan" && !points.empty()) points[1] = std::numeric_limits<float>::quiet_NaN();
    for (std::uint32_t n = 0; n < columns; ++n) fields_[n] = {dds::c_string(kNames[n]), 4 * n, 7, 1};
    dds::PointCloud m{};
    m.header = {stamp, dds::c_string(frame_)};
    m.height = 1;
    m.point_step = 4 * columns;
    m.width = static_cast<std::uint32_t>(points.size()) / columns;
    m.row_step = m.width * m.point_step;
    m.fields = {columns, columns, fields_.data(), false};
    m.data = {m.row_step, m.row_step, reinterpret_cast<std::uint8_t*>(points.data()), false};
    writer_.write(m);
  }

 private:
  inline static const std::array<std::string, 4> kNames{"x", "y", "z", "intensity"};
  std::string fault_, frame_;
  std::array<dds::PointField, 4> fields_{};
  dds::Writer<dds::PointCloud> writer_;
};

std::vector<double> numbers(const char* text) {
  std::vector<double> values;
  for (char* end = nullptr; *text; text = *end ? end + 1 : end) values.push_back(std::strtod(text, &end));
  return values;
}

void add(std::vector<float>& points, const Vec3& p) {
  for (const double x : p) points.push_back(static_cast<float>(x));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return 64;
  const auto grid = map::load_map(argv[3]);
  const auto edges = numbers(argv[4]);
  if (!grid || edges.size() != 3) return 66;
  std::vector<Cube> cubes;
  std::string fault;
  for (int n = 5; n < argc; ++n) {
    const auto v = numbers(argv[n]);
    if (v.size() == 6)
      cubes.push_back({{v[0], v[1], v[2]}, v[3], v[4], v[5], false, false});
    else
      fault = argv[n];
  }
  const dds::Participant participant(static_cast<std::uint32_t>(std::stoi(argv[1])), "lo");
  const std::string name_space = argv[2];
  auto odometry = dds::make_reader<dds::Odometry>(participant, name_space);
  Clouds occupied(participant, dds::topic(name_space, "window_occupied"), fault);
  Clouds free(participant, dds::topic(name_space, "window_free"), fault);
  const Vec3 half = Vec3(edges[0], edges[1], edges[2]) / 2;
  std::optional<Vec3> vehicle;
  for (int n = 0; fault.empty() || n < 15; ++n) {
    std::this_thread::sleep_for(200ms);
    odometry.take([&](const dds::Odometry& m) {
      const auto& p = m.pose.pose.position;
      vehicle = Vec3(p.x, p.y, p.z);
    });
    if (!vehicle) continue;
    for (Cube& cube : cubes) cube.look(vehicle->x());
    std::vector<float> walls, air;
    map::for_each_voxel(
        map::common({grid->index(*vehicle - half), grid->index(*vehicle + half)}, map::all_of(grid->size())),
        [&](const Index3& v) {
          const Vec3 p = grid->center(v);
          bool blocked = grid->occupied(v);
          for (const Cube& cube : cubes) blocked = blocked || cube.holds(p);
          if (blocked)
            add(walls, p);
          else if (grid->free(v))
            add(air, p);
        });
    const auto stamp = dds::wall_clock();
    free.send(air, stamp);
    occupied.send(walls, stamp);
  }
  return 0;
}
