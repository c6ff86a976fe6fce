// SPDX-License-Identifier: BSD-3-Clause
#include "tests/race/trajectories.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <random>
#include <sstream>

#include "core/types/minimum_jerk.hpp"

namespace backwash::race {
namespace {

constexpr double kA = 0.1;  // m, edge of a voxel

/// One piece of a trajectory: a row of the file.
struct Piece {
  std::string of, map;
  double v_max, duration;
  std::array<std::array<double, 6>, 3> c;

  Setpoint at(double t) const {
    Setpoint s;
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 5; k >= 0; --k) {
        const double ck = c[static_cast<std::size_t>(axis)][static_cast<std::size_t>(k)];
        s.p_W[axis] = s.p_W[axis] * t + ck;
        if (k >= 1) s.v_W[axis] = s.v_W[axis] * t + k * ck;
        if (k >= 2) s.a_W[axis] = s.a_W[axis] * t + k * (k - 1) * ck;
      }
    return s;
  }
};

Piece read_piece(const std::string& line, std::string& pair) {
  std::vector<std::string> cells;
  std::stringstream row(line);
  for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
  Piece piece{cells.at(0) + " " + cells.at(1), cells.at(2), std::stod(cells.at(3)), std::stod(cells.at(12)), {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t k = 0; k < 6; ++k) piece.c[axis][k] = std::stod(cells.at(13 + 6 * axis + k));
  pair = piece.of + cells.at(4);
  return piece;
}

Trajectory sampled(const std::vector<Piece>& pieces) {
  Trajectory result{pieces.front().of, pieces.front().map, pieces.front().v_max, {}};
  double begin = 0;
  std::size_t n = 0;
  for (double t = kControlPeriod; n < pieces.size(); t += kControlPeriod) {
    while (n < pieces.size() && t > begin + pieces[n].duration) begin += pieces[n++].duration;
    if (n < pieces.size()) result.commands.push_back(pieces[n].at(t - begin));
  }
  Setpoint end;
  end.p_W = pieces.back().at(pieces.back().duration).p_W;
  result.commands.push_back(end);
  return result;
}

/// Along a curve of the given length, s in m, rest to rest with a minimum-jerk profile.
Trajectory along(const std::string& by, double length, double v_max, const std::function<Vec3(double)>& curve) {
  const double duration = minimum_jerk_duration(length, v_max, 2);
  const auto at = [&](double t) { return curve(length * minimum_jerk(std::clamp(t / duration, 0.0, 1.0)).value); };
  constexpr double d = 1e-3;
  Trajectory result{by, "places", v_max, {}};
  for (double t = kControlPeriod; t < duration + kControlPeriod; t += kControlPeriod) {
    Setpoint s;
    s.p_W = at(t);
    s.v_W = (at(t + d) - at(t - d)) / (2 * d);
    s.a_W = (at(t + d) - 2 * at(t) + at(t - d)) / (d * d);
    result.commands.push_back(s);
  }
  return result;
}

}  // namespace

std::vector<Trajectory> rivals(const std::string& folder) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  std::ranges::sort(files);
  std::vector<Trajectory> all;
  for (const auto& file : files) {
    std::ifstream in(file);
    std::string line, pair, before;
    std::vector<Piece> pieces;
    std::getline(in, line);
    while (std::getline(in, line)) {
      const Piece piece = read_piece(line, pair);
      if (pair != before && !pieces.empty()) {
        all.push_back(sampled(pieces));
        pieces.clear();
      }
      pieces.push_back(piece);
      before = pair;
    }
    if (!pieces.empty()) all.push_back(sampled(pieces));
  }
  return all;
}

Place places() {
  map::OccupancyGrid grid({-kA, -kA, -kA}, kA, {168, 82, 42}, map::Cell::occupied);
  const auto carve = [&](const Vec3& low, const Vec3& high, map::Cell cell) {
    for (std::size_t n = 0; n < grid.cell_count(); ++n) {
      const Vec3 p = grid.center(grid.voxel(n));
      if ((p.array() > low.array()).all() && (p.array() < high.array()).all()) grid.set(grid.voxel(n), cell);
    }
  };
  carve({0, 0, 0}, {8, 8, 4}, map::Cell::free);              // hall
  carve({3.8, 3.8, 0}, {4.2, 4.2, 4}, map::Cell::occupied);  // its pillar
  carve({8, 1, 0}, {16, 2.2, 1.4}, map::Cell::free);         // tunnel
  carve({8, 6, 0}, {10.5, 7.2, 3}, map::Cell::free);         // corner behind the hall
  carve({9.3, 3.5, 0}, {10.5, 6, 3}, map::Cell::free);
  carve({12, 4, 0}, {13.2, 5.2, 4}, map::Cell::free);  // shaft
  map::DistanceField distance(grid);
  map::OccupancySums sums(grid);
  return {"places", std::move(grid), std::move(distance), std::move(sums)};
}

std::vector<Trajectory> through_places(double radius, std::size_t count) {
  std::mt19937_64 random(11);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto line = [](const std::string& by, const Vec3& from, const Vec3& to) {
    const double length = (to - from).norm();
    return along(by, length, 1.5, [=](double s) { return Vec3(from + s / length * (to - from)); });
  };
  std::vector<Trajectory> all;
  for (std::size_t n = 0; n < count; ++n) {
    const auto off = [&] { return radius + uniform(0.03, 0.45); };
    const double side = 4.2 + off(), z = uniform(1.8, 2.4);
    all.push_back(line("pillar", {uniform(1, 2), side, z}, {uniform(6, 7), side, z}));
    const double low = off(), y = uniform(1.5, 3);
    all.push_back(line("floor", {uniform(1, 2), y, low}, {uniform(6, 7), y, low}));
    const double wall = 1 + std::min(0.6, off()), height = std::min(0.7, off());
    all.push_back(line("tunnel", {8.8, wall, height}, {15.2, wall, height}));
    const Vec3 foot(12 + std::min(0.6, off()), 4 + std::min(0.6, off()), 0.8);
    all.push_back(line("shaft", foot, foot + Vec3(0, 0, 2.4)));
    // Round the inner edge at (9.3, 6): in along x, a quarter of a circle about a point, out along −y.
    const double rest = std::min(0.6, off()), turn = 0.45, h = uniform(1.2, 1.8), straight = 3;
    const Vec3 center(9.3 + rest - turn, 6 + rest - turn, h);
    all.push_back(along("corner", straight + turn * std::numbers::pi / 2 + 1, 1.5, [=](double s) -> Vec3 {
      if (s < straight) return center + Vec3(s - straight, turn, 0);
      const double angle = (s - straight) / turn;
      if (angle < std::numbers::pi / 2) return center + turn * Vec3(std::sin(angle), std::cos(angle), 0);
      return center + Vec3(turn, -(s - straight - turn * std::numbers::pi / 2), 0);
    }));
  }
  return all;
}

}  // namespace backwash::race
