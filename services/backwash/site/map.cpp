// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <cstdio>

#include "core/map/free_space.hpp"
#include "core/map/octomap/octomap_file.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/site/map_info.hpp"
#include "services/backwash/site/map_input.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct MapVerbOptions {
  MapOptions map;
  std::string out;
  std::vector<Vec3> seeds;
  std::optional<double> body_radius;
  std::string vehicle;
  bool json = false, force = false;
};

/// Floods from the seeds; throws Failure 69 for one that is outside or occupied.
map::Flood flood(const MapVerbOptions& options, map::OccupancyGrid& grid) {
  std::vector<Index3> seeds;
  for (const Vec3& seed : options.seeds) {
    const Index3 v = grid.index(seed);
    if (!grid.inside(v) || grid.occupied(v))
      throw Failure(kUnavailable, options.map.file + ": --free-from " + to_text(seed) + " is " +
                                      (grid.inside(v) ? "occupied" : "outside the map") +
                                      "; choose a place in the air of the room");
    seeds.push_back(v);
  }
  return map::flood_free(grid, seeds);
}

constexpr const char* kSides[] = {"-x", "+x", "-y", "+y", "-z", "+z"};

/// What a flood that leaves the map means, a sentence a side.
void note_edges(const map::Flood& flood, MadeMap& made) {
  for (std::size_t side = 0; side < 6; ++side)
    if (const auto& edge = flood.edge[side])
      made.notes.push_back(std::string("the free space reaches the map's edge at ") + kSides[side] + ", first at " +
                           to_text(made.grid.center(*edge)) + ": a hole, or an open side");
}

void print_json(const MapVerbOptions& options, const MadeMap& made, const map::Flood& flood) {
  const auto count = count_cells(made.grid);
  Json edges = Json::array();
  for (std::size_t side = 0; side < 6; ++side)
    if (const auto& edge = flood.edge[side])
      edges.push_back({{"side", kSides[side]}, {"p", services::to_json(made.grid.center(*edge))}});
  Json json = {{"out", options.out},
               {"kind", made.kind},
               {"points", made.points},
               {"triangles", made.triangles},
               {"points_not_finite", made.not_finite}};
  json.update(extent_json(made.grid, count));
  json["freed_voxels"] = made.freed + flood.freed;
  json["edges"] = std::move(edges);
  json["notes"] = made.notes;
  print(json);
}

void print_text(const MapVerbOptions& options, const MadeMap& made) {
  if (made.kind == "mesh") std::printf("%zu triangles", made.triangles);
  if (made.kind == "cloud") std::printf("%zu points", made.points);
  std::printf("%s%s\n", made.kind == "octomap" ? "a map, written to " : " written to ", options.out.c_str());
  print_extent(made.grid, count_cells(made.grid));
  for (const auto& note : made.notes) std::printf("note: %s\n", note.c_str());
}

int run(MapVerbOptions options) {
  if (!options.out.ends_with(".bt"))
    throw Failure(kUsage, "--out " + options.out + " is a binary OctoMap file; name it .bt");
  check_output(options.out, options.force);
  const double radius = options.vehicle.empty() ? 0 : read_vehicle(options.vehicle).body.radius;
  options.map.body_radius = options.body_radius.value_or(radius);
  MadeMap made = make_map(options.map);
  const auto flooded = flood(options, made.grid);
  note_edges(flooded, made);
  const auto count = count_cells(made.grid);
  if (count.free + count.occupied == 0)
    throw Failure(kBadData,
                  options.map.file + ": nothing of it is in the map; a wider --crop, or fewer --points-least");
  if (count.free == 0)
    made.notes.push_back(
        "nothing is free: a vehicle can be nowhere; --free-from a place in the air, or --sensor of a scan");
  write_file(options.out, map::octomap_file(made.grid), options.force,
             [&](const std::string& written) { return lost_in(written, made, options.map.file); });
  options.json ? print_json(options, made, flooded) : print_text(options, made);
  return kOk;
}

Vec3 vector_of(const std::vector<double>& numbers, std::size_t from = 0) {
  return {numbers[from], numbers[from + 1], numbers[from + 2]};
}

/// Options of where a map's content goes.
void add_placement(Command& command, MapOptions& map) {
  command.add_option("--scale", map.scale, "m per unit of the file: 0.001 for mm; default 1").check(positive());
  command.add_option("--up", map.up, "axis of the file that points up; default z, of glTF y")
      .check(one_of({"x", "y", "z", "-x", "-y", "-z"}));
  const auto rotate = [&map](const std::string& text) {
    const auto turn = vector_of(read_numbers("--rotate", text, 3, "three angles yaw,pitch,roll in rad"));
    map.place.R_W = (Eigen::AngleAxisd(turn.x(), Vec3::UnitZ()) * Eigen::AngleAxisd(turn.y(), Vec3::UnitY()) *
                     Eigen::AngleAxisd(turn.z(), Vec3::UnitX()))
                        .toRotationMatrix();
  };
  command.add_text("--rotate", rotate, "turn about x, then y, then z, rad").type_name("YAW,PITCH,ROLL");
  const auto origin = [&map](const std::string& text) {
    map.place.origin = vector_of(read_numbers("--origin", text, 3, "three numbers x,y,z in metres"));
  };
  command.add_text("--origin", origin, "place that becomes (0, 0, 0), after scale and rotation, m").type_name("X,Y,Z");
  const auto crop = [&map](const std::string& text) {
    const auto box = read_numbers("--crop", text, 6, "six numbers x0,y0,z0,x1,y1,z1 in metres");
    if ((vector_of(box).array() >= vector_of(box, 3).array()).any())
      throw UsageError("--crop: '" + text + "' must have x0 < x1, y0 < y1 and z0 < z1");
    map.crop = {vector_of(box), vector_of(box, 3)};
  };
  command.add_text("--crop", crop, "box that the map covers, m; default what the file covers").type_name("LOW,HIGH");
}

Command& add_convert(Command& group, const std::shared_ptr<MapVerbOptions>& options) {
  auto& command = group.add_subcommand("convert", "A mesh, a point cloud or a map of others as a map to fly in");
  command
      .add_option("file", options->map.file,
                  "OctoMap (.bt, .ot), builtin:NAME, .ply, .pcd, .csv, .mcap, .obj, .gltf, .glb, .stl")
      .required();
  command.add_option("-o,--out", options->out, "binary OctoMap file, .bt").required();
  command.add_option("--resolution", options->map.resolution, "edge of a voxel, m; default an OctoMap's own, else 0.1")
      .check(within(0.001, 10));
  add_placement(command, options->map);
  const auto points_to = [](std::vector<Vec3>& places, const char* name) {
    return [&places, name](const std::string& text) {
      places.push_back(vector_of(read_numbers(name, text, 3, "three numbers x,y,z in metres")));
    };
  };
  command
      .add_text("--free-from", points_to(options->seeds, "--free-from"),
                "what is unknown and joined to this place is free, m; may be given again")
      .type_name("X,Y,Z")
      .trigger_on_parse();
  command
      .add_text("--sensor", points_to(options->map.sensors, "--sensor"),
                "a cloud: where it was seen from; the rays to its points are free, m")
      .type_name("X,Y,Z");
  command.add_option("--topic", options->map.topic, "a recording: of its clouds, where it has several");
  command.add_option("--body-radius", options->body_radius, "a recording: points so near are the vehicle's own, m")
      .check(positive());
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME with that radius");
  command.add_option("--points-least", options->map.points_least, "a cloud: points that make a voxel occupied")
      .check(within(1, 65535))
      .capture_default_str();
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --out");
  command.footer(
      "Example:\n  backwash map convert room.obj --up y --resolution 0.05 --free-from 2,2,1.2 -o room.bt\n"
      "  backwash map convert scan.pcd --points-least 3 --sensor 0,0,1.5 -o scan.bt");
  return command;
}

}  // namespace

Verb map_verb(Command& app) {
  auto& group = app.add_subcommand("map", "Maps of others: made, mended and looked at");
  group.require_subcommand();
  const auto options = std::make_shared<MapVerbOptions>();
  auto& convert = add_convert(group, options);
  const Verb info = map_info_verb(group);
  return {&group, [options, &convert, info] { return convert.parsed() ? run(*options) : info.run(); }};
}

}  // namespace backwash::services
