// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap/ros_messages.hpp"

#include <Eigen/Geometry>

#include <cmath>

#include "core/log/mcap/cdr_writer.hpp"
#include "core/reach/bound/tube_boxes.hpp"

namespace backwash::log::ros {
namespace {

constexpr std::size_t kCovariance = 36;

void put(CdrWriter& cdr, const Vec3& v) {
  cdr.number(v.x());
  cdr.number(v.y());
  cdr.number(v.z());
}

void put_time(CdrWriter& cdr, std::int64_t stamp_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  cdr.number(static_cast<std::int32_t>(stamp_ns / kSecond));
  cdr.number(static_cast<std::uint32_t>(stamp_ns % kSecond));
}

void put_header(CdrWriter& cdr, std::int64_t stamp_ns, std::string_view frame) {
  put_time(cdr, stamp_ns);
  cdr.text(frame);
}

void put_pose(CdrWriter& cdr, const Vec3& p_W, const std::array<double, 4>& q) {
  put(cdr, p_W);
  for (const std::size_t n : {1u, 2u, 3u, 0u}) cdr.number(q[n]);  // x, y, z, w
}

void put_pose(CdrWriter& cdr, const Setpoint& c) {
  put_pose(cdr, c.p_W, {std::cos(c.yaw / 2), 0, 0, std::sin(c.yaw / 2)});
}

/// A marker but for its place and points.
struct Marker {
  enum Type : std::int32_t { kCube = 1, kLineStrip = 4, kCubeList = 6 } type = kCube;
  std::int32_t id = 0;
  bool delete_all = false;
  Vec3 center_W = Vec3::Zero(), scale = Vec3::Zero();  ///< m
  std::array<float, 4> color{};                        ///< red, green, blue, opacity
  std::vector<Vec3> points_W;
};

void put(CdrWriter& cdr, std::int64_t stamp_ns, const Marker& m) {
  constexpr std::int32_t kAdd = 0, kDeleteAll = 3;
  put_header(cdr, stamp_ns, kMapFrame);
  cdr.text("backwash");
  for (const std::int32_t n : {m.id, static_cast<std::int32_t>(m.type), m.delete_all ? kDeleteAll : kAdd})
    cdr.number(n);
  put_pose(cdr, m.center_W, {1, 0, 0, 0});
  put(cdr, m.scale);
  for (const float part : m.color) cdr.number(part);
  cdr.number(std::int32_t{0});
  cdr.number(std::uint32_t{0});  // lifetime: for ever
  cdr.number(std::uint8_t{0});   // not locked to its frame
  cdr.count(m.points_W.size());
  for (const Vec3& p : m.points_W) put(cdr, p);
  cdr.count(0);  // colours of points
  cdr.text("");  // texture: its name, header, format, data
  put_header(cdr, 0, "");
  cdr.text("");
  cdr.count(0);
  cdr.count(0);  // its coordinates
  cdr.text("");  // text
  cdr.text("");  // mesh: its name, file name, data
  cdr.text("");
  cdr.count(0);
  cdr.number(std::uint8_t{0});
}

Bytes markers_of(std::int64_t stamp_ns, std::span<const Marker> markers) {
  CdrWriter cdr;
  cdr.count(markers.size());
  for (const Marker& m : markers) put(cdr, stamp_ns, m);
  return cdr.bytes();
}

using Color = std::array<float, 4>;  // red, green, blue, opacity

/// Of a plan that is shown: width of its line, m, the most boxes of its tube, and their colours.
constexpr double kLineWidth = 0.02;
constexpr std::size_t kMostBoxes = 100;
constexpr Color kLineColor{0.1F, 0.4F, 0.9F, 1}, kTubeColor{0.9F, 0.6F, 0.1F, 0.25F};

/// foxglove_msgs/Color.
void put(CdrWriter& cdr, const Color& color) {
  for (const float part : color) cdr.number(static_cast<double>(part));
}

/// Of two velocities in W that of the body's axes.
Vec3 in_body(const std::array<double, 4>& q, const Vec3& v_W) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).conjugate() * v_W;
}

/// Whether a face of an occupied voxel can be seen.
bool at_surface(const map::OccupancyGrid& grid, const Index3& v) {
  for (int axis = 0; axis < 3; ++axis)
    for (const int step : {-1, 1}) {
      Index3 beside = v;
      beside[axis] += step;
      if (!grid.occupied(beside)) return true;
    }
  return false;
}

}  // namespace

Bytes odometry(std::int64_t stamp_ns, const Moving& vehicle, const Frames& frames) {
  CdrWriter cdr;
  put_header(cdr, stamp_ns, frames.in);
  cdr.text(frames.of);
  put_pose(cdr, vehicle.state.p_W, vehicle.q);
  for (std::size_t n = 0; n < kCovariance; ++n) cdr.number(0.0);
  put(cdr, in_body(vehicle.q, vehicle.state.v_W));
  put(cdr, Vec3::Zero());
  for (std::size_t n = 0; n < kCovariance; ++n) cdr.number(n >= 21 && n % 7 == 0 ? -1.0 : 0.0);  // 21, 28, 35: angular
  return cdr.bytes();
}

Bytes transform(std::int64_t stamp_ns, const Moving& vehicle, const Frames& frames) {
  CdrWriter cdr;
  cdr.count(1);
  put_header(cdr, stamp_ns, frames.in);
  cdr.text(frames.of);
  put_pose(cdr, vehicle.state.p_W, vehicle.q);
  return cdr.bytes();
}

Bytes pose(std::int64_t stamp_ns, const Setpoint& command) {
  CdrWriter cdr;
  put_header(cdr, stamp_ns, kMapFrame);
  put_pose(cdr, command);
  return cdr.bytes();
}

Bytes path(std::int64_t stamp_ns, std::span<const Setpoint> commands) {
  CdrWriter cdr;
  put_header(cdr, stamp_ns, kMapFrame);
  cdr.count(commands.size());
  for (const Setpoint& c : commands) {
    put_header(cdr, stamp_ns, kMapFrame);
    put_pose(cdr, c);
  }
  return cdr.bytes();
}

Bytes markers(std::int64_t stamp_ns, std::span<const Setpoint> commands, const reach::ReachTube& tube) {
  std::vector<Marker> all(2);
  all[0].delete_all = true;
  Marker& line = all[1];
  line.type = Marker::kLineStrip;
  line.id = 1;
  line.scale.x() = kLineWidth;
  line.color = kLineColor;
  for (const Setpoint& c : commands) line.points_W.push_back(c.p_W);
  for (const auto& [low, high] : reach::tube_boxes(tube, kMostBoxes)) {
    Marker box;
    box.id = static_cast<std::int32_t>(all.size());
    box.center_W = (low + high) / 2;
    box.scale = high - low;
    box.color = kTubeColor;
    all.push_back(std::move(box));
  }
  return markers_of(stamp_ns, all);
}

Bytes scene(std::int64_t stamp_ns, std::span<const Setpoint> commands, const reach::ReachTube& tube) {
  constexpr std::uint8_t kLineStrip = 0, kNo = 0;
  const auto boxes = reach::tube_boxes(tube, kMostBoxes);
  CdrWriter cdr;
  cdr.count(0);  // deletions
  cdr.count(1);
  put_header(cdr, stamp_ns, kMapFrame);
  cdr.text("plan");
  cdr.number(std::int32_t{0});
  cdr.number(std::uint32_t{0});  // lifetime: until it is replaced
  cdr.number(kNo);               // not locked to its frame
  cdr.count(0);
  cdr.count(0);  // metadata, arrows
  cdr.count(boxes.size());
  for (const auto& [low, high] : boxes) {
    put_pose(cdr, (low + high) / 2, {1, 0, 0, 0});
    put(cdr, high - low);
    put(cdr, kTubeColor);
  }
  cdr.count(0);
  cdr.count(0);  // spheres, cylinders
  cdr.count(1);
  cdr.number(kLineStrip);
  put_pose(cdr, Vec3::Zero(), {1, 0, 0, 0});
  cdr.number(kLineWidth);
  cdr.number(kNo);  // in m, not in pixels
  cdr.count(commands.size());
  for (const Setpoint& c : commands) put(cdr, c.p_W);
  put(cdr, kLineColor);
  cdr.count(0);
  cdr.count(0);  // colours of points, indices
  cdr.count(0);
  cdr.count(0);
  cdr.count(0);  // triangles, texts, models
  return cdr.bytes();
}

Bytes voxels(std::int64_t stamp_ns, const map::OccupancyGrid& grid) {
  Marker cubes;
  cubes.type = Marker::kCubeList;
  cubes.scale.setConstant(grid.resolution());
  cubes.color = {0.55F, 0.55F, 0.6F, 1};
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == map::Cell::occupied && at_surface(grid, grid.voxel(n)))
      cubes.points_W.push_back(grid.center(grid.voxel(n)));
  return markers_of(stamp_ns, std::span(&cubes, 1));
}

Bytes vector(std::int64_t stamp_ns, const Vec3& v_W) {
  CdrWriter cdr;
  put_header(cdr, stamp_ns, kMapFrame);
  put(cdr, v_W);
  return cdr.bytes();
}

Bytes text(std::string_view text) {
  CdrWriter cdr;
  cdr.text(text);
  return cdr.bytes();
}

Bytes line(std::int64_t stamp_ns, Level level, std::string_view text) {
  CdrWriter cdr;
  put_time(cdr, stamp_ns);
  cdr.number(static_cast<std::uint8_t>(level));
  for (const std::string_view part : {std::string_view("backwashd"), text, std::string_view(), std::string_view()})
    cdr.text(part);
  cdr.number(std::uint32_t{0});
  return cdr.bytes();
}

Bytes octets(std::size_t octets) {
  CdrWriter cdr;
  cdr.count(0);                  // dimensions
  cdr.number(std::uint32_t{0});  // offset
  cdr.count(octets);
  return cdr.bytes();
}

std::optional<std::span<const std::uint8_t>> octets_of(std::span<const std::uint8_t> message) noexcept {
  constexpr std::array<std::uint8_t, 12> kHead{0, 1};  // as above: no dimensions, no offset
  constexpr std::size_t kLength = sizeof(std::uint32_t);
  if (message.size() < kHead.size() + kLength || !std::equal(kHead.begin(), kHead.end(), message.begin())) return {};
  const auto rest = message.subspan(kHead.size() + kLength);
  return little<std::uint32_t>(message.data() + kHead.size()) == rest.size() ? std::optional(rest) : std::nullopt;
}

}  // namespace backwash::log::ros
