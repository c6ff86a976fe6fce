// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/flight_data.hpp"

#include <algorithm>
#include <array>

namespace backwash::report {
namespace {

std::array<const sim::FlightPiece*, 2> pieces_of(const sim::Flight& flight) {
  return {&flight.take_off, &flight.route};
}

DataTable path_table(const sim::Flight& flight) {
  DataTable table{"path", {"t_s", "x_m", "y_m", "z_m", "command_x_m", "command_y_m", "command_z_m"}, {}, 0};
  for (const auto* piece : pieces_of(flight))
    for (const auto& s : piece->samples) {
      const Vec3 &p = s.truth.p_W, &c = s.command.p_W;
      table.rows.push_back({s.t, p.x(), p.y(), p.z(), c.x(), c.y(), c.z()});
    }
  return thinned(std::move(table));
}

DataTable tube_table(const sim::Flight& flight) {
  DataTable table{"tube",
                  {"t_s", "center_x_m", "center_y_m", "center_z_m", "half_width_x_m", "half_width_y_m",
                   "half_width_z_m", "half_width_xy_plus_m", "half_width_xy_minus_m"},
                  {},
                  0};
  for (const auto* piece : pieces_of(flight))
    for (std::size_t k = 0; k < piece->samples.size(); ++k) {
      const auto& step = piece->accepted.tube[k];
      const auto& h = step.half_widths_interval;
      const Vec3& c = step.center.p_W;
      table.rows.push_back({piece->samples[k].t, c.x(), c.y(), c.z(), h[kX], h[kY], h[kZ], h[kXyPlus], h[kXyMinus]});
    }
  return thinned(std::move(table));
}

DataTable error_table(const sim::Flight& flight) {
  DataTable table{"error", {"t_s"}, {}, 0};
  for (const std::string axis : {"x", "y", "z"})
    for (const char* what : {"error_", "bound_", "ellipsoid_"}) table.columns.push_back(what + axis + "_m");
  for (const auto* piece : pieces_of(flight)) {
    const bool route = piece == &flight.route;
    for (std::size_t k = 0; k < piece->samples.size(); ++k) {
      table.rows.push_back({piece->samples[k].t});
      for (const auto d : {kX, kY, kZ}) {
        auto& row = table.rows.back();
        row.push_back(piece->judged[k].error[d]);
        row.push_back(piece->judged[k].half_widths[d]);
        row.push_back(route && k < flight.paper.tube.size() ? flight.paper.tube[k].half_widths[d] : kNoValue);
      }
    }
  }
  return thinned(std::move(table));
}

DataTable clearance_table(const sim::Flight& flight, const plan::World& world) {
  DataTable table{"clearance", {"t_s", "clearance_m", "set_clearance_m"}, {}, 0};
  for (const auto* piece : pieces_of(flight)) {
    const auto& tube = piece->accepted.tube;
    for (std::size_t k = 0; k < piece->samples.size(); ++k) {
      const bool judged = piece == &flight.route && k + 1 < tube.size();
      table.rows.push_back({piece->samples[k].t, piece->clearance_m[k],
                            judged ? plan::nearest_approach(world, {tube[k], tube[k + 1]}).clearance : kNoValue});
    }
  }
  return thinned(std::move(table));
}

}  // namespace

std::vector<DataTable> flight_tables(const sim::Flight& flight, const plan::World& world) {
  return {path_table(flight), tube_table(flight), error_table(flight), clearance_table(flight, world)};
}

std::vector<Vec3> route_of(const sim::Flight& flight) {
  std::vector<Vec3> path_W;
  for (const auto& s : flight.route.samples) path_W.push_back(s.truth.p_W);
  return path_W;
}

Scene flight_scene(const sim::Flight& flight, const plan::World& world) {
  std::vector<Prism> tube;
  std::vector<Vec3> path_W;
  for (const auto* piece : pieces_of(flight)) {
    for (const auto& step : piece->accepted.tube) tube.push_back({step.center.p_W, step.half_widths_interval});
    for (const auto& s : piece->samples) path_W.push_back(s.truth.p_W);
  }
  return {"path", at_intervals(tube), map_faces(world.grid, path_W), world.reach.vehicle.body.radius};
}

}  // namespace backwash::report
