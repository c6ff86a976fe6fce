// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/bound_figure.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/field/disturbance_field.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study::calibrate {

report::Chart bound_chart(const Data& data, const Model& model, int axis, const map::OccupancyGrid& grid,
                          std::size_t place) {
  using enum report::Kind;
  std::vector<const Hover*> hovers;
  for (const auto& h : data.hovers)
    if (data.place[h.flight] == place) hovers.push_back(&h);
  std::ranges::sort(hovers, {}, [](const Hover* h) { return h->p_W.z(); });
  report::Chart chart{.x = {"y, m"}, .y = {.name = "variance, (m/s²)²", .logarithmic = true}, .height = 380};
  if (hovers.empty()) return chart;
  const auto [left, right] = std::ranges::minmax(hovers, {}, [](const Hover* h) { return h->p_W.y(); });
  const double low = left->p_W.y(), high = right->p_W.y();
  const field::ProximityField field(grid, model);
  std::vector<report::Layer> bounds;
  constexpr std::array kThirds{flown, after, before};
  for (std::size_t k = 0; k < kThirds.size(); ++k) {
    const std::size_t from = k * hovers.size() / kThirds.size(), until = (k + 1) * hovers.size() / kThirds.size();
    if (from == until) continue;
    report::Run dots, bound;
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = from; i < until; ++i) {
      mean += hovers[i]->p_W / static_cast<double>(until - from);
      for (const Vec3& v : hovers[i]->ln_variance) dots.push_back({hovers[i]->p_W.y(), v[axis] / std::numbers::ln10});
    }
    const int columns = static_cast<int>((high - low) / kCalibrationRules.same_place) + 1;
    for (int j = 0; j <= columns; ++j) {
      const Vec3 p(mean.x(), low + (high - low) * j / columns, mean.z());
      bound.push_back({p.y(), std::log10(field.at(p).sigma().along(Vec3::Unit(axis)))});
    }
    chart.layers.push_back({report::Shape::dots, kThirds[k], "", {std::move(dots)}});
    bounds.push_back({report::Shape::line,
                      kThirds[k],
                      formatted("%.2f to %.2f m high", hovers[from]->p_W.z(), hovers[until - 1]->p_W.z()),
                      {std::move(bound)}});
  }
  chart.layers.insert(chart.layers.end(), bounds.begin(), bounds.end());
  return chart;
}

}  // namespace backwash::study::calibrate
