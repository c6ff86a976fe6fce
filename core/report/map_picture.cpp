// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/map_picture.hpp"

#include <algorithm>
#include <sstream>

#include "core/report/page/figure_parts.hpp"
#include "core/types/text.hpp"

namespace backwash::report {

tl::expected<std::string, PlotError> map_picture(const map::OccupancyGrid& grid, double z, Format format) {
  const Index3 first = Index3::Zero(), last = grid.size() - Index3::Ones();
  std::ostringstream script;
  script << cell_blocks(grid, first, last, z, z) << kAxes << view_from_above(grid, first, last)
         << "set title 'z = " << to_text(z, 2) << " m (white: free)'\nset key outside top center horizontal\nplot "
         << plot_cells() << '\n';
  std::string text = script.str();
  text.erase(text.rfind(", \n"));  // the comma that plot_cells leaves for what follows
  const double ratio = static_cast<double>(grid.size().y()) / grid.size().x();
  return draw(text + '\n', format, 1000, std::clamp(static_cast<int>(860 * ratio) + 140, 300, 2400));
}

}  // namespace backwash::report
