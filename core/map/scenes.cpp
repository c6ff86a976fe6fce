// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>

#include "core/map/load_map.hpp"

// Coordinates are metres in W and multiples of 0.1, so that every face lies on a grid of 0.1 or 0.05 m.
namespace backwash::map {
namespace {

/// A world under construction: a box of free cells into which obstacles are put.
class Scene {
 public:
  Scene(const Vec3& low, const Vec3& high, double resolution)
      : grid_(resolution * steps(low, resolution).cast<double>(), resolution,
              steps(high, resolution) - steps(low, resolution), Cell::free),
        corner_(steps(low, resolution)) {}

  /// Fills the box [low, high], cut to the world.
  void fill(const Vec3& low, const Vec3& high, Cell cell = Cell::occupied) {
    const Index3 from = (steps(low, grid_.resolution()) - corner_).cwiseMax(0);
    const Index3 to = (steps(high, grid_.resolution()) - corner_).cwiseMin(grid_.size());
    for (int k = from.z(); k < to.z(); ++k) {
      for (int j = from.y(); j < to.y(); ++j) {
        for (int i = from.x(); i < to.x(); ++i) grid_.set({i, j, k}, cell);
      }
    }
  }
  /// Table: a top 0.1 m thick from z = height − 0.1 m on four legs 0.1 m thick.
  void table(const Vec3& low, double length_x, double length_y, double height) {
    fill(low + Vec3(0, 0, height - 0.1), low + Vec3(length_x, length_y, height));
    for (const double x : {0.0, length_x - 0.1}) {
      for (const double y : {0.0, length_y - 0.1})
        fill(low + Vec3(x, y, 0), low + Vec3(x + 0.1, y + 0.1, height - 0.1));
    }
  }
  /// Open shelf: two sides and boards 0.1 m thick every 0.4 m.
  void shelf(const Vec3& low, const Vec3& high) {
    for (double z = low.z(); z < high.z() - 0.05; z += 0.4) {
      fill({low.x(), low.y(), z}, {high.x(), high.y(), z + 0.1});
    }
    fill({low.x(), low.y(), high.z() - 0.1}, high);
    fill(low, {high.x(), low.y() + 0.1, high.z()});
    fill({low.x(), high.y() - 0.1, low.z()}, high);
  }
  OccupancyGrid& grid() { return grid_; }

 private:
  static Index3 steps(const Vec3& p, double resolution) { return (p / resolution).array().round().cast<int>(); }

  OccupancyGrid grid_;
  Index3 corner_;
};

/// Room with inner extent [low, high], walls 0.2 m thick and, one voxel thick, a floor and a ceiling.
Scene room(const Vec3& low, const Vec3& high, double a) {
  const Vec3 shell(0.2, 0.2, a);
  Scene scene(low - shell, high + shell, a);
  scene.fill(low - shell, high + shell);
  scene.fill(low, high, Cell::free);
  return scene;
}

OccupancyGrid parallel_walls(double distance, double a) {
  const double face = distance / 2;
  Scene scene({-3, -face - 0.2, -a}, {3, face + 0.2, 3.5}, a);
  scene.fill({-3, -face - 0.2, -a}, {3, face + 0.2, 0});
  scene.fill({-3, -face - 0.2, 0}, {3, -face, 2.5});
  scene.fill({-3, face, 0}, {3, face + 0.2, 2.5});
  return scene.grid();
}

OccupancyGrid narrow_gap(double a) {
  Scene scene = room({0, -2, 0}, {6, 2, 2.5}, a);
  scene.fill({2.9, -2, 0}, {3.2, -0.5, 2.5});
  scene.fill({2.9, 0.5, 0}, {3.2, 2, 2.5});
  return scene.grid();
}

OccupancyGrid thin_wall(double a) {
  Scene scene = room({0, -4, 0}, {10, 4, 2.5}, a);
  scene.fill({5, -4, 0}, {5.1, 2.6, 2.5});
  scene.fill({5, 3.8, 0}, {5.1, 4, 2.5});
  return scene.grid();
}

/// Two long corridors joined by three across, in solid walls: ways of 1.0 to 1.6 m with right-angled corners.
OccupancyGrid corridors(double a) {
  Scene scene = room({0, 0, 0}, {14, 8, 2.5}, a);
  scene.fill({1.6, 1.2, 0}, {6, 6.6, 2.5});
  scene.fill({7, 1.2, 0}, {12.6, 6.6, 2.5});
  return scene.grid();
}

void furnish_living_room(Scene& scene) {
  scene.fill({0, 1, 0}, {0.9, 3.2, 0.4});     // sofa: seat
  scene.fill({0, 1, 0.4}, {0.2, 3.2, 0.8});   // and back
  scene.table({1.4, 1.6, 0}, 0.6, 1.0, 0.4);  // coffee table
  scene.shelf({0, 5, 0}, {0.3, 6.8, 2});      // bookcase
  scene.table({2.4, 6.2, 0}, 1.6, 1.0, 0.7);  // dining table
  for (const double x : {2.6, 3.4}) {         // chairs: seat and back
    scene.table({x, 5.6, 0}, 0.4, 0.4, 0.5);
    scene.fill({x, 5.5, 0.4}, {x + 0.4, 5.6, 0.9});
  }
  scene.fill({3.8, 0, 0}, {5.4, 0.4, 0.6});    // sideboard
  scene.fill({0.4, 4.0, 0}, {0.6, 4.2, 1.8});  // floor lamp
}

void furnish_bedroom(Scene& scene) {
  scene.fill({8, 0.6, 0}, {10, 2.2, 0.5});    // bed
  scene.fill({9.9, 0.6, 0.5}, {10, 2.2, 1});  // its headboard
  scene.fill({9.5, 2.3, 0}, {10, 2.7, 0.5});  // night stand
  scene.fill({6.2, 0, 0}, {7.8, 0.6, 2.2});   // wardrobe
}

void furnish_study(Scene& scene) {
  scene.table({8.2, 7.3, 0}, 1.8, 0.7, 0.7);     // desk
  scene.fill({8.8, 7.9, 0.9}, {9.4, 8, 1.3});    // screen on the wall behind it
  scene.shelf({9.7, 4.6, 0}, {10, 6.4, 2});      // shelf
  scene.fill({6.4, 7.1, 0}, {7.2, 7.9, 0.4});    // armchair: seat
  scene.fill({6.4, 7.7, 0.4}, {7.2, 7.9, 0.9});  // and back
  scene.fill({7.9, 6, 2.2}, {8.1, 6.2, 2.6});    // pendant lamp
}

OccupancyGrid apartment(double a) {
  Scene scene = room({0, 0, 0}, {10, 8, 2.6}, a);
  scene.fill({5.8, 0, 0}, {6, 8, 2.6});
  scene.fill({6, 3.9, 0}, {10, 4.1, 2.6});
  scene.fill({5.8, 1.4, 0}, {6, 2.6, 2.1}, Cell::free);    // living room – bedroom
  scene.fill({5.8, 5.4, 0}, {6, 6.6, 2.1}, Cell::free);    // living room – study
  scene.fill({7.4, 3.9, 0}, {8.6, 4.1, 2.1}, Cell::free);  // bedroom – study
  furnish_living_room(scene);
  furnish_bedroom(scene);
  furnish_study(scene);
  return scene.grid();
}

/// Draws of the forest. The standard fixes mt19937_64's numbers but not its distributions', hence uniform() here.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : engine_(seed) {}
  /// In [low, high).
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  /// In [low, high], to 0.1 m.
  double decimetres(double low, double high) { return std::round(10 * uniform(low - 0.05, high + 0.05)) / 10; }
  /// Horizontal direction, uniform, without sin and cos (whose last bit differs between platforms).
  Vec3 heading() {
    for (;;) {
      const double x = uniform(-1, 1);
      const double y = uniform(-1, 1);
      const double r = std::sqrt(x * x + y * y);
      if (r > 0.1 && r <= 1) return {x / r, y / r, 0};
    }
  }

 private:
  std::mt19937_64 engine_;
};

constexpr double kForestEnd = 19;  // the route runs from x = −19 to x = 19 m at y = 0

/// Whether a horizontal disc would come within 1 m of an end of the route.
bool near_an_end(const Vec3& p, double radius) {
  const double dx = std::abs(p.x()) - kForestEnd;
  return std::sqrt(dx * dx + p.y() * p.y()) < 1 + radius;
}

/// Upright ring: the cells within 0.1 m of a circle about `center` whose axis is horizontal.
void put_ring(OccupancyGrid& grid, const Vec3& center, double radius, const Vec3& axis) {
  const Vec3 reach = Vec3::Constant(radius + 0.2);
  const Index3 from = grid.index(center - reach).cwiseMax(0);
  const Index3 to = grid.index(center + reach).cwiseMin(grid.size() - Index3::Ones());
  for (int k = from.z(); k <= to.z(); ++k) {
    for (int j = from.y(); j <= to.y(); ++j) {
      for (int i = from.x(); i <= to.x(); ++i) {
        const Vec3 r = grid.center({i, j, k}) - center;
        const double along = r.dot(axis);
        const double off = (r - along * axis).norm() - radius;
        if (along * along + off * off <= 0.01) grid.set({i, j, k}, Cell::occupied);
      }
    }
  }
}

OccupancyGrid forest(std::uint64_t seed, double a) {
  Scene scene({-20, -10, -a}, {20, 10, 5}, a);
  scene.fill({-20, -10, -a}, {20, 10, 0});
  Draws draws(seed);
  const auto spot = [&](double radius) {
    Vec3 p;
    do {
      p = {draws.decimetres(-20, 20), draws.decimetres(-10, 10), 0};
    } while (near_an_end(p, radius));
    return p;
  };
  for (int pillar = 0; pillar < 150; ++pillar) {
    const double width = draws.decimetres(0.6, 0.7);
    const double height = draws.decimetres(0.5, 5);
    const Vec3 corner = spot(width * 1.5);  // its box lies within √2 widths of the corner
    scene.fill(corner, corner + Vec3(width, width, height));
  }
  for (int ring = 0; ring < 10; ++ring) {
    const double radius = draws.uniform(0.7, 0.8);
    const double height = draws.uniform(1, 1.6);
    const Vec3 axis = draws.heading();
    put_ring(scene.grid(), spot(radius + 0.1) + Vec3(0, 0, height), radius, axis);
  }
  return scene.grid();
}

/// The seed of `forest-SEED`: decimal digits only.
std::optional<std::uint64_t> forest_seed(const std::string& name) {
  constexpr std::string_view kPrefix = "forest-";
  if (!name.starts_with(kPrefix)) return std::nullopt;
  std::uint64_t seed = 0;
  const char* end = name.data() + name.size();
  const auto parsed = std::from_chars(name.data() + kPrefix.size(), end, seed);
  if (parsed.ec != std::errc{} || parsed.ptr != end) return std::nullopt;
  return seed;
}

}  // namespace

std::vector<std::string> builtin_scene_names() {
  return {"parallel-walls-4m", "parallel-walls-2m", "parallel-walls-1m", "narrow-gap",
          "corridors",         "apartment",         "thin-wall",         "forest-SEED"};
}

tl::expected<OccupancyGrid, MapError> builtin_scene(const std::string& name, double resolution) {
  if (!(resolution >= 0.02 && resolution <= 0.2)) {
    return tl::make_unexpected(
        MapError{MapError::Kind::bad_resolution,
                 "builtin:" + name + ": resolution " + std::to_string(resolution) + " m, expected 0.02 to 0.2 m"});
  }
  if (name == "parallel-walls-4m") return parallel_walls(4, resolution);
  if (name == "parallel-walls-2m") return parallel_walls(2, resolution);
  if (name == "parallel-walls-1m") return parallel_walls(1, resolution);
  if (name == "narrow-gap") return narrow_gap(resolution);
  if (name == "corridors") return corridors(resolution);
  if (name == "apartment") return apartment(resolution);
  if (name == "thin-wall") return thin_wall(resolution);
  if (const auto seed = forest_seed(name)) return forest(*seed, resolution);

  std::string names;
  for (const auto& known : builtin_scene_names()) names += (names.empty() ? "" : ", ") + known;
  return tl::make_unexpected(
      MapError{MapError::Kind::unknown_name, "builtin:" + name + ": no such world; there are " + names});
}

}  // namespace backwash::map
