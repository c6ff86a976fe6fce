// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/import_airgarage.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/log/columns/local_cubic.hpp"
#include "core/log/columns/median.hpp"

namespace backwash::log {
namespace {

constexpr double kFrame = 0.01;          // s
constexpr double kMarkerHeight = 0.027;  // m, marker above the feet
constexpr double kNotSaid = -1;          // of a plate above: no file of this format says it

/// Times of the frames behind the stamps, from 0.
std::vector<double> frame_times(const std::vector<double>& stamps) {
  // Phase of the grid: the circular mean of the stamps within a frame.
  double c = 0, s = 0;
  for (const double t : stamps) {
    const double angle = 2 * std::numbers::pi * (t - stamps.front()) / kFrame;
    c += std::cos(angle);
    s += std::sin(angle);
  }
  const double phase = std::atan2(s, c) / (2 * std::numbers::pi) * kFrame;
  std::vector<double> frames;
  frames.reserve(stamps.size());
  for (const double t : stamps) frames.push_back(std::round((t - stamps.front() - phase) / kFrame));
  for (std::size_t i = frames.size() - 1; i-- > 0;) frames[i] = std::min(frames[i], frames[i + 1] - 1);
  const double first = frames.front();
  for (double& frame : frames) frame = (frame - first) * kFrame;
  return frames;
}

void add(FlightLog& log, const std::string& prefix, const std::string& unit, const Vec3& value) {
  for (int axis = 0; axis < 3; ++axis) log.columns[(prefix + "xyz"[axis]).append(unit)].push_back(value[axis]);
}

}  // namespace

tl::expected<FlightLog, LogError> import_airgarage(const std::string& path) {
  auto raw = read_csv(path, "t");
  if (!raw) return tl::make_unexpected(raw.error());
  for (const char* name : {"x", "y", "z", "qx", "qy", "qz", "qw"}) {
    if (!raw->has(name))
      return tl::make_unexpected(LogError{
          LogError::Kind::bad_data, path + ":1: no column '" + name + "'; airgarage files hold t,x,y,z,qx,qy,qz,qw"});
  }
  if (raw->t_s.size() < 100)
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: fewer than 100 frames; give a flight"});
  const auto t = frame_times(raw->t_s);
  std::vector<Vec3> p;
  for (std::size_t i = 0; i < t.size(); ++i)
    p.emplace_back(raw->column("x")[i], raw->column("y")[i], raw->column("z")[i]);
  const std::vector<double> at_first(raw->column("z").begin(), raw->column("z").begin() + 50);
  const double stood = median(at_first);
  const std::string name = std::filesystem::path(path).stem().string();
  const double day =
      name.size() >= 8 && std::all_of(name.begin(), name.begin() + 8, ::isdigit) ? std::stod(name.substr(0, 8)) : 0;

  FlightLog log;
  const auto motion = local_cubics(t, p);
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (!motion[i]) continue;
    log.t_s.push_back(t[i]);
    add(log, "", "_m", p[i]);
    add(log, "v", "_mps", motion[i]->v);
    add(log, "a", "_mps2", motion[i]->a);
    for (const char* q : {"qw", "qx", "qy", "qz"}) log.columns[q].push_back(raw->column(q)[i]);
    log.columns["stood_z_m"].push_back(stood);
    log.columns["surface_z_m"].push_back(stood - kMarkerHeight);
    log.columns["ceiling"].push_back(kNotSaid);
    log.columns["day"].push_back(day);
  }
  return log;
}

}  // namespace backwash::log
