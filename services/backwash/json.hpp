// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "core/plan/feasibility.hpp"
#include "core/plan/planner.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/types/disturbance.hpp"

namespace backwash::services {

using Json = nlohmann::ordered_json;

/// JSON as docs/interfaces.md fixes it: points [x, y, z]; symmetric tensors [xx, xy, xz, yy, yz, zz]; half widths by
/// name.
Json to_json(const Vec3& p);
Json to_json(const Variance& sigma);
Json to_json(const PerDirection& half_widths);
/// Upper triangle of a symmetric matrix, in the order of to_json(Variance).
Json symmetric_to_json(const Mat3& shape);
/// Steps of a tube; `shape` only where the method is paper. With a direction, `support` along it, m.
Json to_json(const reach::ReachTube& tube, reach::Method method, const std::optional<Vec3>& direction = std::nullopt);
Json to_json(const plan::PlanMetrics& metrics);
/// `stated`: a risk was, in place of the worst case.
Json to_json(const plan::Plan& plan, reach::Method method, bool stated);
Json to_json(const plan::Region& region);

/// Support of a step's set along a unit direction, m: √(nᵀ Q n) for paper; for tight the octagonal prism's, exact along
/// the five directions and an upper bound between them.
double support(const reach::TubeStep& step, reach::Method method, const Vec3& direction);

/// Prints one JSON object and a newline on stdout, or leaves it to who called printed_by().
void print(const Json& json);
/// The text that `work` prints, without the newline; empty: none. What it throws passes where it printed nothing. Not
/// for two threads at once.
std::string printed_by(const std::function<void()>& work);

}  // namespace backwash::services
