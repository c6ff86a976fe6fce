// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/json.hpp"

#include <cmath>
#include <cstdio>

namespace backwash::services {

Json to_json(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

Json to_json(const Variance& s) { return {s.xx, s.xy, s.xz, s.yy, s.yz, s.zz}; }

Json to_json(const PerDirection& h) {
  return {{"x", h[kX]}, {"y", h[kY]}, {"z", h[kZ]}, {"xy_plus", h[kXyPlus]}, {"xy_minus", h[kXyMinus]}};
}

Json symmetric_to_json(const Mat3& q) { return {q(0, 0), q(0, 1), q(0, 2), q(1, 1), q(1, 2), q(2, 2)}; }

double support(const reach::TubeStep& step, reach::Method method, const Vec3& n) {
  if (method == reach::Method::paper) return std::sqrt(n.dot(step.shape * n));
  // The horizontal part is a sum of the two neighbouring face normals with weights ≥ 0, and supports are subadditive.
  const double a = std::abs(n.x()), b = std::abs(n.y());
  const Direction axis = a >= b ? kX : kY;
  const Direction diagonal = n.x() * n.y() >= 0 ? kXyPlus : kXyMinus;
  const auto& h = step.half_widths;
  return std::abs(a - b) * h[axis] + std::sqrt(2.0) * std::min(a, b) * h[diagonal] + std::abs(n.z()) * h[kZ];
}

Json to_json(const reach::ReachTube& tube, reach::Method method, const std::optional<Vec3>& direction) {
  Json steps = Json::array();
  for (const auto& step : tube) {
    Json entry = {{"t", step.t}, {"center", to_json(step.center.p_W)}};
    if (method == reach::Method::paper) entry["shape"] = symmetric_to_json(step.shape);
    entry["half_widths"] = to_json(step.half_widths);
    entry["half_widths_interval"] = to_json(step.half_widths_interval);
    entry["r_max"] = step.r_max;
    if (direction) entry["support"] = support(step, method, *direction);
    steps.push_back(std::move(entry));
  }
  return steps;
}

Json to_json(const plan::PlanMetrics& m) {
  return {{"length_m", m.length_m},   {"time_s", m.time_s},
          {"jerk2", m.jerk2},         {"min_clearance_m", m.min_clearance_m},
          {"search_ms", m.search_ms}, {"optimise_ms", m.optimise_ms},
          {"tubes_ms", m.tubes_ms},   {"verify_ms", m.verify_ms},
          {"expanded", m.expanded},   {"evaluations", m.evaluations}};
}

Json to_json(const plan::Region& r) {
  return {{"voxels", r.voxels},
          {"volume_m3", r.volume_m3},
          {"low", to_json(r.low_W)},
          {"high", to_json(r.high_W)},
          {"widest", {{"p", to_json(r.widest_W)}, {"clearance_m", r.widest_clearance_m}}}};
}

Json to_json(const plan::Plan& plan, reach::Method method, bool stated) {
  Json trajectory = Json::array();
  for (std::size_t k = 0; k < plan.commands.size(); ++k) {
    const auto& c = plan.commands[k];
    trajectory.push_back({{"t", static_cast<double>(k) * kControlPeriod},
                          {"p", to_json(c.p_W)},
                          {"v", to_json(c.v_W)},
                          {"a", to_json(c.a_W)},
                          {"yaw", c.yaw}});
  }
  Json metrics = to_json(plan.metrics);
  const auto& risk = plan.metrics.risk;
  if (stated && plan.status == plan::PlanStatus::ok)
    metrics["risk"] = {{"total", risk.total}, {"a_minute", risk.a_minute}};
  if (risk.largest > 0)
    metrics["risk"].update({{"worst_second", risk.largest},
                            {"t", risk.t},
                            {"p", to_json(risk.center_W)},
                            {"clearance_m", risk.clearance},
                            {"sigma_m", risk.sigma}});
  return {{"status", plan::to_string(plan.status)},
          {"message", plan.message},
          {"metrics", std::move(metrics)},
          {"trajectory", std::move(trajectory)},
          {"tube", to_json(plan.tube, method)}};
}

namespace {
std::string* taken = nullptr;  // what is printed goes there
}

void print(const Json& json) {
  // A file's name may be no UTF-8; JSON is.
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (taken)
    *taken = text;
  else
    std::printf("%s\n", text.c_str());
}

std::string printed_by(const std::function<void()>& work) {
  std::string text;
  taken = &text;
  try {
    work();
  } catch (...) {
    taken = nullptr;
    if (text.empty()) throw;
  }
  taken = nullptr;
  return text;
}

}  // namespace backwash::services
