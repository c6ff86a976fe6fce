// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/site/map_input.hpp"

#include <cmath>
#include <numbers>

#include "core/map/free_space.hpp"
#include "core/map/lattice_box.hpp"
#include "core/map/scan/voxelise.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"
#include "services/maps/geometry.hpp"

namespace backwash::services {
namespace {

constexpr double kResolution = 0.1;                // m, of what has none of its own: as the built-in worlds
constexpr double kFinest = 0.001, kCoarsest = 10;  // m: what readers of OctoMap files take
constexpr double kLargestBuilding = 1000;          // m: what is larger is told in another unit

/// The rotation that turns an axis of the file up.
Mat3 upright(const std::string& up) {
  Mat3 R = Mat3::Identity();
  if (up == "y") R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  if (up == "-y") R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  if (up == "x") R << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  if (up == "-x") R << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  if (up == "-z") R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  return R;
}

map::Placement placement(const MapOptions& options, const std::string& up_of_format) {
  map::Placement place = options.place;
  place.scale = options.scale.value_or(1);
  place.R_W = place.R_W * upright(options.up.empty() ? up_of_format : options.up);
  return place;
}

/// The unknown grid over a box of W, or over --crop in its place.
map::OccupancyGrid grid_over(const MapOptions& options, std::pair<Vec3, Vec3> box, double resolution) {
  if (options.crop) box = *options.crop;
  auto grid = map::grid_around(box.first, box.second, resolution);
  if (!grid) throw Failure(kBadData, options.file + ": " + grid.error());
  return std::move(*grid);
}

MadeMap from_octomap(const MapOptions& options) {
  const auto source = read_map(options.file);
  const auto place = placement(options, "z");
  const double resolution = options.resolution.value_or(place.scale * source.resolution());
  if (resolution < kFinest || resolution > kCoarsest)
    throw Failure(kUsage, options.file + ": --scale makes voxels of " + to_text(resolution, 4) +
                              " m; OctoMap's are 0.001 to 10 m: give a --resolution");
  const auto box =
      map::placed_box(place, source.origin(), source.origin() + source.resolution() * source.size().cast<double>());
  MadeMap made{grid_over(options, box, resolution), "octomap", 0, 0, 0, 0, {}};
  map::regrid(source, place, made.grid);
  return made;
}

/// Throws Failure where 32 bits do not tell the place of a voxel.
void check_precision(const MapOptions& options, const maps::Geometry& geometry, double resolution, double scale) {
  double farthest = 0;
  for (const Vec3& p : geometry.points) farthest = std::max(farthest, p.cwiseAbs().maxCoeff());
  const double off = scale * farthest * std::exp2(-24);
  if (geometry.single && off > resolution / 10)
    throw Failure(kBadData, options.file + ": coordinates up to " + to_text(farthest, 0) +
                                " in 32 bits are off by up to " + to_text(off, 3) +
                                " m; export it nearer to its origin, or a cloud with 64 bits");
}

void check_extent(const MapOptions& options, const std::pair<Vec3, Vec3>& box) {
  const Vec3 extent = box.second - box.first;
  if (options.scale || extent.maxCoeff() <= kLargestBuilding) return;
  throw Failure(kBadData, options.file + ": is " + to_text(extent.x(), 0) + " x " + to_text(extent.y(), 0) + " x " +
                              to_text(extent.z(), 0) +
                              " in its own unit; --scale 0.001 if that is mm, 0.01 if cm, 1 if it is m");
}

/// Frees what rays pass from where the cloud was seen.
void free_rays(const MapOptions& options, const maps::Geometry& geometry, MadeMap& made) {
  std::vector<Vec3> sensors = options.sensors;
  if (sensors.empty()) sensors = geometry.sensors;
  for (const Vec3& sensor : sensors)
    if (!made.grid.inside(made.grid.index(sensor)))
      throw Failure(kUnavailable, options.file + ": a sensor at " + to_text(sensor) +
                                      " is outside the map; a wider --crop, or another place");
  if (sensors.empty()) return;
  const auto through = map::free_by_rays(made.grid, geometry.points, sensors);
  made.freed = through.unknown + through.occupied;
  if (through.occupied > 0)
    made.notes.push_back(std::to_string(through.occupied) +
                         " voxels in which something had been are free: later scans saw through them");
}

void add_mesh(const maps::Geometry& geometry, MadeMap& made) {
  std::size_t on_faces = 0;
  for (const auto& corners : geometry.triangles) {
    const map::Triangle triangle = {geometry.points[corners[0]], geometry.points[corners[1]],
                                    geometry.points[corners[2]]};
    map::add_triangle(made.grid, triangle);
    on_faces += map::on_faces(made.grid, triangle);
  }
  const double half = made.grid.resolution() / 2;
  if (on_faces > 0)
    made.notes.push_back(std::to_string(on_faces) + " of " + std::to_string(geometry.triangles.size()) +
                         " triangles lie on faces of voxels and occupy both sides; an --origin that is " +
                         to_text(half, 3) + " m off along those axes makes one layer of them");
}

MadeMap from_geometry(const MapOptions& options) {
  auto read = maps::read_geometry(options.file, options.topic, options.body_radius);
  if (!read)
    throw Failure(read.error().kind == map::MapError::Kind::not_found ? kNoInput : kBadData, read.error().message);
  maps::Geometry& geometry = *read;
  progress("voxels of " + options.file);  // not before: what shows it is a thread, and a mesh is read by a fork
  const double resolution = options.resolution.value_or(kResolution);
  const auto place = placement(options, geometry.up);
  check_precision(options, geometry, resolution, place.scale);
  std::pair<Vec3, Vec3> box{place(geometry.points[0]), place(geometry.points[0])};
  const auto put = [&](Vec3& p) {
    p = place(p);
    box = {box.first.cwiseMin(p), box.second.cwiseMax(p)};
  };
  for (Vec3& p : geometry.points) put(p);
  for (Vec3& sensor : geometry.sensors) put(sensor);
  if (geometry.triangles.empty())
    for (const Vec3& sensor : options.sensors) box = {box.first.cwiseMin(sensor), box.second.cwiseMax(sensor)};
  check_extent(options, box);
  // A surface on an outer face occupies the voxels beyond, too, and a point on one may lie there.
  const Vec3 rim = Vec3::Constant(2 * map::kOnFace * resolution);
  const bool mesh = !geometry.triangles.empty();
  MadeMap made{grid_over(options, {box.first - rim, box.second + rim}, resolution),
               mesh ? "mesh" : "cloud",
               geometry.points.size(),
               geometry.triangles.size(),
               geometry.not_finite,
               0,
               geometry.notes};
  if (geometry.not_finite > 0)
    made.notes.push_back(std::to_string(geometry.not_finite) +
                         " points without finite coordinates were left out, the first is point " +
                         std::to_string(*geometry.first_not_finite));
  if (mesh && (!options.sensors.empty() || options.points_least > 1))
    throw Failure(kUsage, "--sensor and --points-least are of clouds; " + options.file + " is a mesh");
  if (mesh) {
    add_mesh(geometry, made);
  } else {
    map::add_points(made.grid, geometry.points, options.points_least);
    free_rays(options, geometry, made);
  }
  made.from = std::move(geometry);
  return made;
}

}  // namespace

MadeMap make_map(const MapOptions& options) {
  const bool named = options.file.ends_with(".bt") || options.file.ends_with(".ot");
  const bool octomap = named || options.file.starts_with("builtin:") || maps::is_octomap(options.file);
  if (octomap && (!options.sensors.empty() || options.points_least > 1))
    throw Failure(kUsage, "--sensor and --points-least are of clouds; " + options.file + " is none");
  return octomap ? from_octomap(options) : from_geometry(options);
}

}  // namespace backwash::services
