// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/lattice_box.hpp"

#include <cmath>
#include <cstdio>

#include "core/map/octomap/octomap_tree.hpp"

namespace backwash::map {
namespace {

std::string in_words(const char* format, const Vec3& p, double a, double b) {
  char text[256];
  std::snprintf(text, sizeof text, format, p.x(), p.y(), p.z(), a, b);
  return text;
}

/// The next resolution of two digits at which a box has no more than `most` voxels, m; a tenth of room for the voxels
/// that its faces cut.
double fitting_resolution(const Vec3& extent, double resolution, std::size_t most) {
  double fits = std::cbrt(1.1 * extent.cwiseMax(resolution).prod() / static_cast<double>(most));
  const double digit = std::pow(10.0, std::floor(std::log10(fits)) - 1);
  return digit * std::ceil(fits / digit);
}

}  // namespace

tl::expected<OccupancyGrid, std::string> grid_around(const Vec3& low_W, const Vec3& high_W, double resolution,
                                                     std::size_t most) {
  const Vec3 low = (low_W / resolution).array() + kOnFace, high = (high_W / resolution).array() - kOnFace;
  const Vec3 first = low.array().floor(), last = high.array().ceil().max(first.array() + 1), size = last - first;
  if (!(size.prod() <= static_cast<double>(most)))
    return tl::make_unexpected(
        in_words("%.4g x %.4g x %.4g m are %.3g voxels at this resolution", high_W - low_W, size.prod(), 0) + ", " +
        std::to_string(most) + " are the most: " +
        in_words("a smaller --crop, or --resolution %.3g",
                 Vec3(fitting_resolution(high_W - low_W, resolution, most), 0, 0), 0, 0));
  if (first.minCoeff() < -octomap_tree::kCenter || last.maxCoeff() > octomap_tree::kCenter) {
    const Vec3 middle = (0.5 * (low_W + high_W)).array().round();
    return tl::make_unexpected(in_words("its middle is at (%.0f, %.0f, %.0f), and OctoMap holds what is within %.1f m "
                                        "of the origin at %g m",
                                        middle, octomap_tree::kCenter * resolution, resolution) +
                               in_words(": --origin %.0f,%.0f,%.0f", middle, 0, 0));
  }
  return OccupancyGrid(resolution * first, resolution, size.cast<int>());
}

}  // namespace backwash::map
