// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>

#include "core/field/disturbance_field.hpp"
#include "core/report/figures.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/site/field_volume.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct FieldOptions {
  std::string map, model, vehicle, points, slice, volume, out;
  std::optional<Vec3> at;
  bool interpolated = false, json = false, force = false;
};

/// Σ at a point; parts only where it was evaluated exactly. Nothing where no stored voxel is near, or no free one for
/// the exact.
struct Value {
  Vec3 p_W;
  std::optional<Variance> sigma;
  std::optional<field::Breakdown> parts;
  Vec3 push_W = Vec3::Zero();  ///< mean push of an extended model, with the parts, m/s²
};

std::vector<Vec3> read_points(const std::string& path) {
  const auto table = read_table(path, "");
  for (const char* name : {"x_m", "y_m", "z_m"}) {
    if (!table.has(name)) throw Failure(kBadData, path + ":1: no column '" + name + "'; the columns are x_m,y_m,z_m");
  }
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < table.column("x_m").size(); ++i) {
    points.emplace_back(table.column("x_m")[i], table.column("y_m")[i], table.column("z_m")[i]);
  }
  if (points.empty()) throw Failure(kBadData, path + ":1: has no point below its first line; give one or more");
  return points;
}

report::Slice read_slice(const std::string& text) {
  char axis = 0, rest = 0;
  report::Slice slice{};
  if (std::sscanf(text.c_str(), "%c=%lf%c", &axis, &slice.coordinate, &rest) != 2 || axis < 'x' || axis > 'z') {
    throw Failure(kUsage, "--slice: '" + text + "' must be x=, y= or z= and a number in metres, as in z=0.5");
  }
  if (!std::isfinite(slice.coordinate)) throw Failure(kUsage, "--slice: '" + text + "' is not finite; give a number");
  slice.axis = axis - 'x';
  return slice;
}

/// Centres of the free voxels that a slice cuts, moved into its plane.
std::vector<Vec3> slice_points(const map::OccupancyGrid& grid, const report::Slice& slice) {
  Vec3 on_plane = grid.origin();
  on_plane[slice.axis] = slice.coordinate;
  const int layer = grid.index(on_plane)[slice.axis];
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    const Index3 v = grid.voxel(i);
    if (v[slice.axis] != layer || !grid.free(v)) continue;
    points.push_back(grid.center(v));
    points.back()[slice.axis] = slice.coordinate;
  }
  return points;
}

/// What is wrong with a slice that cuts no free voxel.
std::string empty_slice(const FieldOptions& options, const map::OccupancyGrid& grid, const report::Slice& slice) {
  const double low = grid.origin()[slice.axis];
  const double high = low + grid.resolution() * grid.size()[slice.axis];
  return options.map + ":1: no free voxel in the slice " + options.slice + "; the map spans " + "xyz"[slice.axis] +
         " from " + to_text(low, 2) + " to " + to_text(high, 2) + " m";
}

/// The eight voxels around a point whose centres trilinear interpolation uses.
std::vector<Index3> corners(const map::OccupancyGrid& grid, const Vec3& p) {
  const Index3 low = grid.index(p - Vec3::Constant(0.5 * grid.resolution()));
  std::vector<Index3> around;
  around.reserve(8);
  for (int n = 0; n < 8; ++n) around.push_back(low + Index3(n & 1, n >> 1 & 1, n >> 2 & 1));
  return around;
}

std::vector<Value> interpolated(const field::ProximityField& exact, const std::vector<Vec3>& points) {
  const auto& grid = exact.grid();
  std::vector<char> wanted(grid.cell_count());
  for (const auto& p : points) {
    for (const auto& v : corners(grid, p)) {
      if (grid.free(v)) wanted[grid.linear(v)] = 1;
    }
  }
  std::vector<std::size_t> voxels;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i]) voxels.push_back(i);
  }
  field::DisturbanceField stored(grid, voxels);
  const field::WholeField whole(grid, exact.model(), voxels);
  run_shown(whole.block_count(), [&](std::size_t begin, std::size_t end) { stored.fill(whole, begin, end); });
  field::Extension extension(grid, exact.model());
  extension.fill(grid, voxels);
  if (extension.by_place()) stored.scale(extension, voxels);
  const double everywhere = std::exp(extension.moving(Vec3::Zero()).ln_variance);
  std::vector<Value> values;
  for (const auto& p : points) {
    values.push_back({p, std::nullopt, std::nullopt, Vec3::Zero()});
    for (const auto& v : corners(grid, p)) {
      if (stored.has(v)) values.back().sigma = everywhere * stored.interpolated(p, Variance{});
    }
  }
  return values;
}

/// What the model's extension says at a point, hovering.
Air air_at(const field::ProximityField& exact, const Vec3& p_W) {
  const auto& effects = exact.model().extension;
  if (effects.empty()) return {};
  Air air = field::air_around(effects, field::around(exact.grid(), p_W));
  const Air everywhere = field::air_moving(effects, Vec3::Zero());
  air.push_W += everywhere.push_W;
  air.ln_variance += everywhere.ln_variance;
  return air;
}

std::vector<Value> evaluated(const field::ProximityField& exact, const std::vector<Vec3>& points) {
  std::vector<Value> values(points.size());
  run_shown(points.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      values[i].p_W = points[i];
      if (!exact.grid().free(exact.grid().index(points[i]))) continue;
      const auto parts = exact.at(points[i]);
      const auto air = air_at(exact, points[i]);
      values[i] = {points[i], std::exp(air.ln_variance) * parts.sigma(), parts, air.push_W};
    }
  });
  return values;
}

/// Throws Failure 69 for a place that no air is known of.
void check_free(const map::OccupancyGrid& grid, const Vec3& p_W, const std::string& map) {
  const Index3 v = grid.index(p_W);
  if (grid.free(v)) return;
  const char* const is = grid.occupied(v) ? "occupied" : grid.inside(v) ? "unknown" : "outside the map";
  throw Failure(kUnavailable, map + ":1: --at " + to_text(p_W) + " is " + is + "; choose a point of free space");
}

void print_json(const std::vector<Value>& values, bool extended) {
  Json points = Json::array();
  for (const auto& value : values) {
    Json entry = {{"p", services::to_json(value.p_W)},
                  {"sigma", value.sigma ? services::to_json(*value.sigma) : Json()}};
    if (value.parts) {
      entry["ground"] = services::to_json(value.parts->ground);
      entry["corner"] = services::to_json(value.parts->corner);
      entry["wall"] = services::to_json(value.parts->wall);
      entry["base"] = services::to_json(value.parts->base);
      if (extended) entry["push"] = services::to_json(value.push_W);
    }
    points.push_back(std::move(entry));
  }
  print(Json{{"points", std::move(points)}});
}

void print_table(const std::vector<Value>& values) {
  std::printf("%9s %9s %9s  %10s %10s %10s %10s %10s %10s   variance in (m/s2)2\n", "x_m", "y_m", "z_m", "xx", "xy",
              "xz", "yy", "yz", "zz");
  for (const auto& value : values) {
    const auto& p = value.p_W;
    std::printf("%9.3f %9.3f %9.3f  ", p.x(), p.y(), p.z());
    if (!value.sigma) {
      std::printf("no free voxel around this point\n");
      continue;
    }
    const auto& s = *value.sigma;
    std::printf("%10.6f %10.6f %10.6f %10.6f %10.6f %10.6f\n", s.xx, s.xy, s.xz, s.yy, s.yz, s.zz);
  }
}

void write_picture(const FieldOptions& options, const map::OccupancyGrid& grid, const report::Slice& slice,
                   const std::vector<Value>& values) {
  std::vector<report::FieldSample> samples;
  for (const auto& value : values) {
    if (value.sigma) samples.push_back({value.p_W, *value.sigma});
  }
  write_file(options.out, report::picture_file(report::field_slice(grid, slice, samples), options.out), options.force);
}

int run(const FieldOptions& options) {
  if (options.points.empty() + options.slice.empty() + options.volume.empty() + !options.at != 3) {
    throw Failure(kUsage, "give exactly one of --points, --slice, --volume and --at");
  }
  if (!options.out.empty() && options.slice.empty()) throw Failure(kUsage, "--out is a picture of a --slice; give one");
  check_outputs({options.out, options.volume}, options.force);
  if (!options.out.empty() && !options.out.ends_with(".svg") && !options.out.ends_with(".png"))
    throw Failure(kUsage, "--out " + options.out + " is no picture that can be drawn; name it .svg or .png");
  std::optional<report::Slice> slice;
  if (!options.slice.empty()) slice = read_slice(options.slice);
  const auto grid = read_map(options.map);
  auto model = read_model(options.model);
  if (!options.vehicle.empty()) model.ground.r0 = read_vehicle(options.vehicle).body.diagonal_radius;

  if (!options.volume.empty()) {
    progress("evaluating every free voxel");
    write_npz(options.volume, options.force, grid, field_volume(grid, model));
    const auto& size = grid.size();
    options.json ? print(Json{{"volume", options.volume}, {"shape", {size.z(), size.y(), size.x(), 6}}})
                 : static_cast<void>(std::printf("written: %s\n", options.volume.c_str()));
    return kOk;
  }
  std::vector<Vec3> points;
  if (options.at) {
    check_free(grid, *options.at, options.map);
    points = {*options.at};
  }
  if (!options.points.empty()) points = read_points(options.points);
  if (slice) points = slice_points(grid, *slice);
  if (slice && points.empty()) throw Failure(kBadData, empty_slice(options, grid, *slice));

  progress("evaluating " + std::to_string(points.size()) + " points");
  const field::ProximityField exact(grid, model);
  const auto values = options.interpolated || slice ? interpolated(exact, points) : evaluated(exact, points);
  if (!options.out.empty()) write_picture(options, grid, *slice, values);
  options.json ? print_json(values, !model.extension.empty()) : print_table(values);
  return kOk;
}

}  // namespace

Verb field_verb(Command& app) {
  auto options = std::make_shared<FieldOptions>();
  auto& command = app.add_subcommand("field", "Variance of the disturbance at points or in a slice of a map");
  command.add_option("--map", options->map, "OctoMap file or builtin:NAME").required();
  command.add_option("--model", options->model, "model file or builtin:NAME").required();
  command.add_option("--vehicle", options->vehicle,
                     "vehicle file or builtin:NAME: its diagonal_radius takes r0's place");
  command.add_option("--points", options->points, "CSV with the columns x_m,y_m,z_m");
  command.add_option("--slice", options->slice, "plane, as in z=0.5: the free voxels it cuts");
  command.add_option("--volume", options->volume, "file for numpy.load: every free voxel");
  add_point(command, "--at", options->at, "one point, m");
  command.add_flag("--interpolated", options->interpolated, "from the stored field instead of exactly (slices always)");
  command.add_option("--out", options->out, "picture of the slice, .svg or .png");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --out and --volume");
  command.footer(
      "Example:\n  backwash field --map builtin:apartment --model builtin:quad-5in --slice z=1.0 --out slice.svg");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
