// SPDX-License-Identifier: BSD-3-Clause
#include <octomap/octomap.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "tests/study_worlds/effects.hpp"

namespace study_worlds {
namespace {

using Rng = std::mt19937_64;

double between(Rng& rng, double low, double high) { return std::uniform_real_distribution(low, high)(rng); }

double to_decimetre(double x) { return std::round(10 * x) / 10; }

Room draw_room(Rng& rng, bool empty, double larger) {
  Room room;
  const double x = larger * to_decimetre(between(rng, 3.2, 5.5)), y = larger * to_decimetre(between(rng, 3.0, 4.5));
  const double z = to_decimetre(between(rng, 2.3, 2.8));
  room.inside = {Vec3::Zero(), {x, y, z}};
  if (empty) return room;
  const double soffit = to_decimetre(between(rng, 1.7, 1.9)), edge = to_decimetre(between(rng, 0.3, 0.45) * x);
  room.solids.push_back({{0, 0, soffit}, {edge, y, z}});        // lowered ceiling at the low-x end
  room.solids.push_back({{x - 1.0, y - 1.2, 0}, {x, y, 0.7}});  // a table-high block in a corner
  return room;
}

Craft draw_craft(Rng& rng) {
  const bool large = between(rng, 0, 1) < 0.3;
  Craft c = large ? Craft{1.9, 38, 0.3, 0.089, 0.22, 0.25, 8, 5, 10, 5.5, 0.02, 0.06, "quad-7in"}
                  : Craft{0.9, 18, 0.3, 0.0635, 0.16, 0.18, 10, 5.5, 12, 6, 0.02, 0.05, "quad-5in"};
  const double gain = between(rng, 0.7, 1.1);
  c.kp_h *= gain;
  c.kp_z *= gain;
  c.kd_h *= std::sqrt(gain);
  c.kd_z *= std::sqrt(gain);
  c.mass *= between(rng, 0.9, 1.1);
  c.thr_mdl_fac = between(rng, 0.1, 0.5);
  return c;
}

}  // namespace

const std::vector<std::string>& cause_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, cause] : causes())
      if (name != "unknown") all.push_back(name);
    return all;
  }();
  return names;
}

double Room::height_above_solid(const Vec3& p) const {
  double top = inside.low.z();
  for (const Box& b : solids) {
    const bool below = p.x() >= b.low.x() && p.x() <= b.high.x() && p.y() >= b.low.y() && p.y() <= b.high.y() &&
                       b.high.z() <= p.z() + 1e-9;
    if (below) top = std::max(top, b.high.z());
  }
  return p.z() - top;
}

double Room::gap_to_ceiling(const Vec3& p) const {
  double bottom = open_top ? std::numeric_limits<double>::infinity() : inside.high.z();
  for (const Box& b : solids) {
    const bool above = p.x() >= b.low.x() && p.x() <= b.high.x() && p.y() >= b.low.y() && p.y() <= b.high.y() &&
                       b.low.z() >= p.z() - 1e-9;
    if (above) bottom = std::min(bottom, b.low.z());
  }
  return bottom - p.z();
}

HiddenWorld draw_world(const Request& request) {
  Rng rng(request.seed * 7919 + 17);  // independent of the cause: worlds with the same seed are pairs
  HiddenWorld world;
  world.request = request;
  world.room =
      draw_room(rng, request.confound == "height" || request.confound == "bob", request.confound == "fast" ? 2 : 1);
  world.craft = draw_craft(rng);
  Rng rotors(request.seed * 104729 + 3);
  world.craft.rotor_spread = between(rotors, 0.05, 0.15);  // of real craft, docs/measurements/recordings.md
  world.rate_hz = between(rng, 0, 1) < 0.7 ? 50 : between(rng, 0, 1) < 0.5 ? 100 : 40;
  world.jitter = between(rng, 0, 0.3);
  world.ln_var_vehicle = 0.55 * std::normal_distribution()(rng);
  for (const auto& name : request.causes) {
    const HiddenCause& cause = causes().at(name);
    const double sign = !cause.one_signed && between(rng, 0, 1) < 0.5 ? -1 : 1;
    world.effects.size[name] = sign * request.size * cause.size;
    world.effects.shape[name] = cause.shape ? cause.shape(rng) : between(rng, -M_PI, M_PI);
    if (name == "unknown") world.effects.structure = draw_structure(rng);
  }
  world.rotor_rpm = world.craft.model == "quad-7in" ? 7200 : 11000;
  if (request.confound == "fold")
    world.rotor_rpm = 60 * (world.rate_hz * std::round(world.rotor_rpm / 60 / world.rate_hz) + between(rng, -6, 6));
  return world;
}

namespace {

void write_map(const HiddenWorld& world, const std::filesystem::path& path) {
  const double a = 0.1;
  octomap::OcTree tree(a);
  const Room& room = world.room;
  const double shift = world.effects.of("map_offset"), angle = world.effects.shape_of("map_offset");
  const Vec3 offset(shift * std::cos(angle), shift * std::sin(angle), 0);
  const Vec3 low = room.inside.low - Vec3::Constant(0.4), high = room.inside.high + Vec3::Constant(0.4);
  for (double x = low.x() + a / 2; x < high.x(); x += a) {
    for (double y = low.y() + a / 2; y < high.y(); y += a) {
      for (double z = low.z() + a / 2; z < high.z(); z += a) {
        const Vec3 p = Vec3(x, y, z) - offset;  // the map shows everything moved by the offset
        bool solid = !room.inside.contains(p);
        for (const Box& b : room.solids) solid = solid || b.contains(p);
        tree.setNodeValue(x, y, z, solid ? 2.0f : -2.0f, true);
      }
    }
  }
  tree.updateInnerOccupancy();
  tree.writeBinary(path.string());
}

void write_vehicle(const Craft& c, const std::filesystem::path& path) {
  std::ofstream(path) << "name = \"craft\"\n[body]\nradius = " << c.radius
                      << "\ndiagonal_radius = " << c.diagonal_radius << "\nrotor_radius = " << c.rotor_radius
                      << "\nmass = " << c.mass << "\n[controller]\nkp = { horizontal = " << c.kp_h
                      << ", vertical = " << c.kp_z << " }\nkd = { horizontal = " << c.kd_h << ", vertical = " << c.kd_z
                      << " }\nlatency = " << c.latency << "\nattitude_lag = " << c.attitude_lag
                      << "\n[estimation]\nposition = 0.02\n[propulsion]\nmax_thrust = " << c.max_thrust
                      << "\nthr_mdl_fac = " << c.thr_mdl_fac
                      << "\n[limits]\nv_max = 1.5\na_max = 2.0\n[initial_error]\nposition = 0.02\nvelocity = 0.05\n";
}

void write_flight(const Table& table, Rng& rng, const std::filesystem::path& path) {
  std::vector<std::size_t> order(table.names.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), rng);
  std::ostringstream text;
  for (std::size_t i = 0; i < order.size(); ++i) text << (i ? "," : "") << table.names[order[i]];
  text << '\n';
  char cell[32];
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < order.size(); ++i) {
      std::snprintf(cell, sizeof cell, "%s%.7g", i ? "," : "", row[order[i]]);
      text << cell;
    }
    text << '\n';
  }
  std::ofstream(path) << text.str();
}

}  // namespace

void write_world_files(const HiddenWorld& world, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  write_map(world, folder / "map.bt");
  write_vehicle(world.craft, folder / "vehicle.toml");
}

std::vector<std::filesystem::path> write_world(const HiddenWorld& world, const std::filesystem::path& folder) {
  write_world_files(world, folder);
  Rng rng(world.request.seed ^ 0x9e3779b97f4a7c15u);
  std::vector<std::filesystem::path> paths;
  for (const auto& flight : fly_all(world)) {
    char name[32];
    std::snprintf(name, sizeof name, "%08llx.csv", static_cast<unsigned long long>(rng() & 0xffffffffu));
    paths.push_back(folder / name);
    write_flight(flight, rng, paths.back());
  }
  return paths;
}

std::string truth_line(const HiddenWorld& world) {
  std::ostringstream text;
  text << "{\"seed\": " << world.request.seed << ", \"flights\": " << world.request.flights << ", \"confound\": \""
       << world.request.confound << "\", \"model\": \"builtin:" << world.craft.model << "\", \"causes\": [";
  bool first = true;
  for (const auto& [name, size] : world.effects.size) {
    text << (first ? "" : ", ") << "{\"name\": \"" << name << "\", \"size\": " << size
         << ", \"shape\": " << world.effects.shape_of(name);
    if (name == "unknown") text << ", \"structure\": \"" << text_of(world.effects.structure) << '"';
    text << '}';
    first = false;
  }
  return text.str() + "]}";
}

}  // namespace study_worlds
