// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/study_worlds/structure.hpp"

/// Worlds with a hidden effect for the study. Nothing of the study's code is used here: own integrator, own forms of
/// every effect, own queries of the room. Only the null model's Σ (what the simulation claims) comes from core/field.
namespace study_worlds {

using Vec3 = Eigen::Vector3d;

/// What to make. Unset names are drawn from the seed.
struct Request {
  std::uint64_t seed = 1;
  std::vector<std::string> causes;  ///< cause_names(), or "unknown"; empty: none
  double size = 1;                  ///< in units of the effect-size table (docs/measurements/confusion.md)
  int flights = 12;
  /// "yaw": never turns; "battery": all flights start full and equal; "height": an empty room, hovers at two heights
  /// only, low and under the ceiling; "bob": an empty room, up and down on sines
  /// at one height; "fast": a room of twice the size, level ways at 2 to 4 m/s; "attitude": actuator_lag acts on the
  /// attitude, the thrust has none; "fold": the rotors' rate lies within 6 Hz of a multiple of the logging rate; empty:
  /// none.
  std::string confound;
  std::vector<int> in_flights = {};  ///< in which the causes act, from 0; empty: all
  double since_s = 0;                ///< in the first of these they begin so late
  bool in_each = false;              ///< in each of them
  double rough_walls = 1;            ///< factor on the variance within 0.7 m of a side wall, in every flight
};

/// Axis-aligned room: the inside of a box, less solid boxes. Distances are closed forms.
struct Box {
  Vec3 low, high;
  bool contains(const Vec3& p) const { return (p.array() >= low.array()).all() && (p.array() <= high.array()).all(); }
};
struct Room {
  Box inside;
  std::vector<Box> solids;
  bool open_top = false;
  double height_above_solid(const Vec3& p) const;  ///< m
  double gap_to_ceiling(const Vec3& p) const;      ///< m; infinite where there is none
};

struct Craft {
  double mass, max_thrust, thr_mdl_fac, rotor_radius, radius, diagonal_radius;
  double kp_h, kd_h, kp_z, kd_z, latency, attitude_lag;
  std::string model;        ///< builtin model's name
  double rotor_spread = 0;  ///< by which the rotors of one craft differ, of their command
};

/// One number per cause, signed, in the table's units; what is absent is zero.
struct HiddenEffects {
  std::map<std::string, double> size;
  std::map<std::string, double> shape;  ///< a second, drawn number: length, time or direction
  HiddenStructure structure{};          ///< of "unknown"
  double of(const std::string& name) const { return size.contains(name) ? size.at(name) : 0.0; }
  double shape_of(const std::string& name) const { return shape.contains(name) ? shape.at(name) : 0.0; }
};

struct HiddenWorld {
  Request request;
  Room room;
  Craft craft;
  HiddenEffects effects;
  double rate_hz, jitter, ln_var_vehicle;
  double rotor_rpm;  ///< at hover
};

HiddenWorld draw_world(const Request& request);
/// What is hidden at a row: push by the effects of the mean, m/s² in W as the accelerometer tells it; ln of the factor
/// on the variance; factor of the bursts on the gusts. Never written to a file: for the oracle fit alone.
struct Hidden {
  Vec3 push;
  double ln_variance;
  double burst = 1;
};
/// One flight as a table: column names and rows. Deterministic in (world, number).
struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;
  std::vector<Hidden> hidden;  ///< one per row
};
std::vector<Table> fly_all(const HiddenWorld& world);
/// Flight `number` of the world along its plan again, nothing frozen or missing, with the gusts and the scatter between
/// flights of a replica (from 1 on); battery and temperature begin as they did.
Table fly_again(const HiddenWorld& world, int number, unsigned replica);

/// Writes map.bt and vehicle.toml.
void write_world_files(const HiddenWorld& world, const std::filesystem::path& folder);
/// Writes those and the flights with shuffled names and columns; returns the flights' paths.
std::vector<std::filesystem::path> write_world(const HiddenWorld& world, const std::filesystem::path& folder);
/// The answer, one line of JSON; never written beside the flights.
std::string truth_line(const HiddenWorld& world);

/// Those of the catalogue (causes() in effects.hpp).
const std::vector<std::string>& cause_names();

}  // namespace study_worlds
