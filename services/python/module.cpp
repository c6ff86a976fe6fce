// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <mutex>

#include "core/plan/planner.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/learn/study_flights.hpp"
#include "services/backwash/site/field_volume.hpp"
#include "services/backwash/tool.hpp"
#include "version.hpp"

// The tool's functions for Python. Nothing is computed here, and no result has a second form: what a verb answers is
// its JSON.
namespace backwash::services {
namespace {

namespace py = pybind11;
using namespace py::literals;
using Path = std::filesystem::path;

constexpr const char* kAbout =
    "Reachable sets of a quadrotor in its own wash, from a voxel map: what `backwash` computes, as values.\n\n"
    "World frame z up; m, s, rad. Sigma: xx, xy, xz, yy, yz, zz of the variance of the acceleration, (m/s2)^2.\n"
    "A wrong file or number is a ValueError, one that is not there a FileNotFoundError, one that is there a\n"
    "FileExistsError, each in the words of the program. Calls run one at a time, and let other threads run.";

/// Without the interpreter, and alone: the tool keeps what it has read.
template <class Work>
auto alone(const Work& work) {
  static std::mutex busy;
  const py::gil_scoped_release others_run;
  const std::lock_guard lock(busy);
  return work();
}

/// An array over memory that `owner` keeps.
template <class T>
py::array over(const T* data, const std::vector<py::ssize_t>& shape, const py::object& owner) {
  py::array_t<T> array(shape, data, owner);
  if (py::isinstance<py::capsule>(owner)) return array;
  array.attr("setflags")("write"_a = false);  // another object's
  return array;
}

/// The same over the numbers of a vector, which the array takes.
template <class T>
py::array taken(std::vector<T>&& numbers, const std::vector<py::ssize_t>& shape) {
  auto* const kept = new std::vector<T>(std::move(numbers));
  return over(kept->data(), shape, py::capsule(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); }));
}

/// One byte for each voxel.
py::array over_cells(const map::OccupancyGrid& grid, const py::object& owner) {
  const Index3& n = grid.size();
  return over(reinterpret_cast<const std::uint8_t*>(grid.cells().data()), {n.z(), n.y(), n.x()}, owner);
}

py::object value_of(const std::string& json) {
  return json.empty() ? py::none() : py::module_::import("json").attr("loads")(json);
}

map::OccupancyGrid grid_of(const py::array& given, const Vec3& origin, double resolution) {
  if (!py::isinstance<py::array_t<std::uint8_t>>(given))
    throw py::type_error("cells: needs uint8 (z, y, x): unknown 0, free 1, occupied 2");
  const py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast> cells(given);
  if (cells.ndim() != 3 || cells.size() == 0 || !(resolution > 0) || !std::isfinite(resolution) || !origin.allFinite())
    throw py::value_error("a map needs cells (z, y, x), an origin of three numbers and a resolution above 0");
  const auto edge = [&](int axis) { return static_cast<int>(cells.shape(axis)); };
  map::OccupancyGrid grid(origin, resolution, {edge(2), edge(1), edge(0)});
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const std::uint8_t cell = cells.data()[n];
    if (cell > 2) throw py::value_error("a cell is " + std::to_string(cell) + "; 0 is unknown, 1 free, 2 occupied");
    grid.set(grid.voxel(n), map::Cell{cell});
  }
  return grid;
}

std::shared_ptr<plan::World> world_of(const map::OccupancyGrid& map, const Model& model, const Vehicle& vehicle,
                                      const std::string& method, std::optional<double> margin,
                                      std::optional<double> risk) {
  if (method != "tight" && method != "paper") throw py::value_error("method: '" + method + "' is not tight or paper");
  if (margin && risk) throw py::value_error("margin and risk: one of them keeps clear, give one");
  if (margin && !(*margin >= 0)) throw py::value_error("margin: it takes a number of 0 or more");
  const auto sets = method == "tight" ? reach::Method::tight : reach::Method::paper;
  return alone([&] {
    const Model kept = risk ? plan::model_for(model, vehicle, *risk) : model;
    return std::const_pointer_cast<plan::World>(plan::build_world(map, kept, vehicle, sets, margin, run_shown));
  });
}

/// Rows of three numbers.
using Points = py::array_t<double, py::array::c_style | py::array::forcecast>;

Vec3 row(const Points& points, py::ssize_t k, py::ssize_t first = 0) {
  return {points.at(k, first), points.at(k, first + 1), points.at(k, first + 2)};
}

void check_rows(const Points& points, py::ssize_t columns, const char* are) {
  if (points.ndim() != 2 || points.shape(1) != columns || points.shape(0) == 0)
    throw py::value_error(std::string("an array of shape (n, ") + std::to_string(columns) + ") is needed: " + are);
  if (!std::all_of(points.data(), points.data() + points.size(), [](double x) { return std::isfinite(x); }))
    throw py::value_error(std::string("a number is not finite: ") + are);
}

py::dict sets(const plan::World& world, const Points& points) {
  check_rows(points, 3, "x, y, z in m");
  const auto n = points.shape(0);
  std::vector<double> half_widths, shift, clearance;
  std::vector<std::uint8_t> safe;
  alone([&] {
    for (py::ssize_t k = 0; k < n; ++k) {
      const auto set = reach::hover_set(world.reach, world.grid, world.distance, world.bounds, row(points, k),
                                        world.constant_margin, &world.sums);
      half_widths.insert(half_widths.end(), set.half_widths.begin(), set.half_widths.end());
      shift.insert(shift.end(), set.shift.begin(), set.shift.end());
      clearance.push_back(set.clearance);
      safe.push_back(set.safe());
    }
  });
  py::dict all("half_widths"_a = taken(std::move(half_widths), {n, py::ssize_t{kDirections}}),
               "shift"_a = taken(std::move(shift), {n, 3}), "clearance"_a = taken(std::move(clearance), {n}));
  all["safe"] = taken(std::move(safe), {n}).attr("view")("bool");
  return all;
}

py::object tube(const plan::World& world, const Points& commands) {
  check_rows(commands, 9, "p, v, a of a command each 20 ms, in m, m/s, m/s2");
  return value_of(alone([&] {
    std::vector<Setpoint> held;
    for (py::ssize_t k = 0; k < commands.shape(0); ++k)
      held.push_back({row(commands, k), row(commands, k, 3), row(commands, k, 6), 0});
    const State start{held[0].p_W, held[0].v_W};
    return to_json(tube_over_field(world.reach, start, held[0], held, world.bounds), world.reach.method).dump();
  }));
}

py::object plan_to(const plan::World& world, const Vec3& start, const Vec3& goal, std::optional<double> v_max,
                   std::optional<double> a_max) {
  const auto& limits = world.reach.vehicle.limits;
  const plan::PlanOptions options{.v_max = v_max.value_or(limits.v_max), .a_max = a_max.value_or(limits.a_max)};
  if (!(options.v_max > 0) || !(options.a_max > 0)) throw py::value_error("v_max and a_max are above 0");
  if (!start.allFinite() || !goal.allFinite()) throw py::value_error("start and goal are finite");
  return value_of(alone([&] {
    Setpoint hover;
    hover.p_W = start;
    const auto plan = plan::plan(world, {State{start, Vec3::Zero()}, hover}, goal, options);
    return to_json(plan, world.reach.method, world.model.bound.stated.has_value()).dump();
  }));
}

py::dict read_log(const Path& path) {
  auto log = alone([&] { return read_flight(path.string()); });
  const auto rows = static_cast<py::ssize_t>(log.t_s.size());
  py::dict columns("t_s"_a = taken(std::move(log.t_s), {rows}));
  for (auto& [name, numbers] : log.columns) columns[name.c_str()] = taken(std::move(numbers), {rows});
  for (const auto& note : log.notes)
    if (PyErr_WarnEx(PyExc_UserWarning, (path.string() + ": " + note).c_str(), 1) != 0) throw py::error_already_set();
  return columns;
}

std::string text_of(const py::handle& value) { return py::str(value); }

/// An option's value as the command line has it: a tuple is one value, x,y,z.
std::string word_of(const py::handle& value) {
  if (!py::isinstance<py::tuple>(value)) return text_of(value);
  py::list parts;
  for (const auto& part : value) parts.append(py::str(part));
  return text_of(py::str(",").attr("join")(parts));
}

py::object run(const py::args& verb, const py::kwargs& options) {
  std::vector<std::string> words;
  for (const auto& word : verb) words.push_back(text_of(word));
  for (const auto& [key, value] : options) {
    std::string name = "--" + text_of(key);
    std::ranges::replace(name, '_', '-');
    if (value.is_none() || value.is(py::bool_(false))) continue;
    words.push_back(name);
    if (value.is(py::bool_(true))) continue;
    if (!py::isinstance<py::list>(value))
      words.push_back(word_of(value));
    else
      for (const auto& one : value) words.push_back(word_of(one));
  }
  return value_of(alone([&] { return answer(words); }));
}

void say_in_python(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(std::move(thrown));
  } catch (const Failure& failure) {
    const auto kind = failure.exit_code == kNoInput        ? PyExc_FileNotFoundError
                      : failure.exit_code == kCannotCreate ? PyExc_FileExistsError
                      : failure.exit_code == kInputOutput  ? PyExc_OSError
                                                           : PyExc_ValueError;
    PyErr_SetString(kind, failure.what());
  } catch (const UsageError& wrong) {
    PyErr_SetString(PyExc_ValueError, wrong.what());
  }
}

}  // namespace

// NOLINTNEXTLINE
PYBIND11_MODULE(backwash, m) {
  py::module_::import("numpy");  // what is without it says so at once
  be_quiet();
  py::register_exception_translator(say_in_python);
  m.doc() = kAbout;
  m.attr("__version__") = kVersion;

  py::class_<map::OccupancyGrid>(m, "Map", "A voxel map: unknown 0, free 1, occupied 2; unknown outside of it.")
      .def(py::init([](const Path& path) { return alone([&] { return read_map(path.string()); }); }), "path"_a,
           "Reads an OctoMap file, or makes builtin:NAME.")
      .def(py::init(&grid_of), "cells"_a, "origin"_a, "resolution"_a,
           "Copies uint8 cells (z, y, x). origin: minimum corner of voxel 0, m; resolution: edge, m.")
      .def_property_readonly(
          "cells", [](const py::object& map) { return over_cells(map.cast<const map::OccupancyGrid&>(), map); },
          "uint8 (z, y, x), read-only, without a copy.")
      .def_property_readonly("origin", &map::OccupancyGrid::origin, "Minimum corner of voxel 0, m.")
      .def_property_readonly("resolution", &map::OccupancyGrid::resolution, "Edge of a voxel, m.");
  py::class_<Vehicle>(m, "Vehicle", "A vehicle file.")
      .def(py::init([](const Path& path) { return alone([&] { return read_vehicle(path.string()); }); }), "path"_a,
           "Reads a file, or builtin:NAME.")
      .def_readonly("name", &Vehicle::name)
      .def_property_readonly(
          "radius", [](const Vehicle& v) { return v.body.radius; }, "Collision radius, m.");
  py::class_<Model>(m, "Model", "A model file.")
      .def(py::init([](const Path& path) { return alone([&] { return read_model(path.string()); }); }), "path"_a,
           "Reads a file, or builtin:NAME.")
      .def_property_readonly(
          "kappa", [](const Model& model) { return model.bound.kappa; }, "Bound in standard deviations.");
  m.def(
      "field",
      [](const map::OccupancyGrid& map, const Model& model, const Vehicle* vehicle) {
        const Index3& n = map.size();
        return taken(alone([&] { return field_volume(map, vehicle ? plan::with_vehicle(model, *vehicle) : model); }),
                     {n.z(), n.y(), n.x(), 6});
      },
      "map"_a, "model"_a, "vehicle"_a = py::none(),
      "Sigma at voxel centres, float32 (z, y, x, 6), (m/s2)^2, without a copy; NaN in voxels that are not free.\n"
      "vehicle: its diagonal radius takes that of the model's place.");

  py::class_<plan::World, std::shared_ptr<plan::World>>(
      m, "World", "A map for one vehicle and model: bounds, sets at rest, and what plans are made in.")
      .def(py::init(&world_of), "map"_a, "model"_a, "vehicle"_a, "method"_a = "tight", "margin"_a = py::none(),
           "risk"_a = py::none(),
           "method: tight or paper; margin: m, in place of the sets; risk: of touching, in place of the worst case.")
      .def_property_readonly(
          "safe",
          [](const py::object& world) {
            return over_cells(world.cast<const plan::World&>().hover.safe_voxels(), world).attr("view")("bool");
          },
          "bool (z, y, x), read-only, without a copy: whether hovering at a voxel's centre keeps clear.")
      .def("sets", &sets, "points"_a,
           "Sets at rest at points (n, 3), m: half_widths (n, 5) along x, y, z, (1, 1)/sqrt 2, (1, -1)/sqrt 2, shift\n"
           "(n, 3) and clearance (n) in m, safe (n).")
      .def("tube", &tube, "commands"_a,
           "Steps of `backwash reach` along commands (n, 9): p, v, a, held for 20 ms each; m, m/s, m/s2.")
      .def("plan", &plan_to, "start"_a, "goal"_a, "v_max"_a = py::none(), "a_max"_a = py::none(),
           "The answer of `backwash plan`; `status` is ok, or says why there is none. m, m/s, m/s2.");

  m.def("read_log", &read_log, "path"_a,
        "Columns of a flight log of any kind by name, SI units, z up; what its reader left out is a warning.");
  m.def("run", &run,
        "The answer of a verb of `backwash`, as of its --json: run(\"vehicle\", \"fit\", \"a.csv\", "
        "vehicle=\"own.toml\").\n"
        "Options by their names, with _ for -; True: a flag; a list: several values; a tuple: x,y,z.");
  for (const char* const verb : {"study", "report"})
    m.def(
        verb,
        [verb](const py::args& logs, const py::kwargs& options) { return run(py::make_tuple(verb) + logs, options); },
        "run() of this verb: logs, then options.");
}

}  // namespace backwash::services
