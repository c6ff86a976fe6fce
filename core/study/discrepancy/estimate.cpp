// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/discrepancy/estimate.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::study::discrepancy {
namespace {

constexpr int kFine = 12;  // points of the finer grid of scales

std::vector<double> fine_scales(const Form& form, double at) {
  if (form.integer_scale || form.scales.size() < 2) return {at};
  const double low = std::log(form.scales.front() / 1.5), high = std::log(form.scales.back() * 1.5);
  std::vector<double> scales;
  for (int i = 0; i < kFine; ++i) scales.push_back(std::exp(low + (high - low) * i / (kFine - 1)));
  return scales;
}

/// Parameters and ln scale of the likelihood's maximum, flight `without` left out (none: SIZE_MAX).
Eigen::VectorXd maximum(const std::vector<Normal>& normals, const std::vector<double>& scales, std::size_t without) {
  std::size_t best = 0;
  std::vector<double> height;
  std::vector<SmallVector> theta;
  for (const Normal& n : normals) {
    SmallVector sum = SmallVector::Zero(n.total.rows());
    for (std::size_t f = 0; f < n.b.size(); ++f)
      if (f != without) sum += n.b[f];
    theta.push_back(without == SIZE_MAX ? SmallVector(n.total.ldlt().solve(sum))
                                        : SmallVector(n.left_out[without] * sum));
    height.push_back(0.5 * theta.back().dot(sum));
    if (height.back() > height[best]) best = height.size() - 1;
  }
  const auto p = theta[best].size();
  Eigen::VectorXd out(p + 1);
  double ln = std::log(std::max(scales[best], 1e-9)), shift = 0;
  if (best > 0 && best + 1 < scales.size()) {
    const double a = height[best - 1], b = height[best], c = height[best + 1];
    shift = std::clamp(0.5 * (a - c) / std::min(a - 2 * b + c, -1e-12), -0.5, 0.5);
    ln += shift * std::log(scales[best + 1] / scales[best]);
  }
  const std::size_t next = shift > 0 ? best + 1 : shift < 0 ? best - 1 : best;
  out.head(p) = theta[best] + std::abs(shift) * (theta[next] - theta[best]);
  out[p] = ln;
  return out;
}

/// What of a rotor's deviation is how the craft was built, the same in each of its flights: of θ = Σ x y / Σ x².
double built_error(const Column& column) {
  const Channel c = column.parts.front().channel;
  double square = 0;
  for (const auto& part : column.parts)
    if (!part.x.empty() && built_scatter(part.channel) == built_scatter(c)) square += part.x.front() * part.x.front();
  return square > 0 ? built_scatter(c) / std::sqrt(square) : 0;
}

}  // namespace

double student_975(double n) {
  // Cornish–Fisher about the normal quantile; below 0.2 % off from 5 degrees up.
  const double z = 1.959964, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n);
}

void refine(const Evidence& evidence, Accepted& cause, const std::vector<Column>& others) {
  const Form& form = *cause.form;
  const auto& windows = evidence.seen().windows;
  std::vector<Normal> normals;
  std::vector<double> scales;
  const auto normal_at = [&](double scale) {
    const auto columns = form.columns(windows, scale);
    auto nuisance = form.constant ? std::vector<Column>{} : offsets(columns, evidence.seen());
    nuisance.insert(nuisance.end(), others.begin(), others.end());
    return evidence.normal(columns, nuisance);
  };
  for (const double scale : fine_scales(form, cause.scale)) {
    Normal n = normal_at(scale);
    if (n.solvable) normals.push_back(std::move(n)), scales.push_back(scale);
  }
  if (normals.empty()) return;
  const Eigen::VectorXd best = maximum(normals, scales, SIZE_MAX);
  const auto p = best.size() - 1;
  const bool scaled = scales.size() > 1;
  if (scaled) cause.scale = std::exp(best[p]);
  cause.columns = form.columns(windows, cause.scale);
  const Normal n = normal_at(cause.scale);
  cause.theta = n.fit();
  cause.gain = n.solvable ? n.gain() : cause.gain;

  const std::size_t flights = evidence.seen().first.size() - 1;
  const double count = static_cast<double>(flights);
  Eigen::MatrixXd left(p + 1, static_cast<Eigen::Index>(flights));
  for (std::size_t f = 0; f < flights; ++f) left.col(static_cast<Eigen::Index>(f)) = maximum(normals, scales, f);
  const Eigen::VectorXd mean = left.rowwise().mean();
  Eigen::VectorXd error = ((count - 1) / count * (left.colwise() - mean).rowwise().squaredNorm()).cwiseSqrt();
  for (Eigen::Index k = 0; k < p; ++k)
    error[k] = std::hypot(error[k], built_error(cause.columns[static_cast<std::size_t>(k)]));
  error[0] = std::hypot(error[0], form.unknowable(evidence.seen()) / std::sqrt(3.0));  // anywhere in the range
  const double t = student_975(count - 1);
  cause.parameters.clear();
  for (Eigen::Index k = 0; k < p; ++k) {
    const double value = cause.theta[k];
    cause.parameters.push_back(
        {form.parameters[static_cast<std::size_t>(k)], value, value - t * error[k], value + t * error[k]});
  }
  if (form.cause == "map_offset") {  // one share of one offset: told as the offset itself
    const Estimate share = cause.parameters.front();
    const Vec3 offset = map_offset(static_cast<std::size_t>(cause.scale));
    cause.parameters.clear();
    for (int i = 0; i < 2; ++i) {
      const auto [low, high] = std::minmax({share.low * offset[i], share.high * offset[i]});
      cause.parameters.push_back({i == 0 ? "x_m" : "y_m", share.value * offset[i], low, high});
    }
  } else if (scaled) {
    const double ln = best[p];
    cause.parameters.push_back(
        {form.scale_name, std::exp(ln), std::exp(ln - t * error[p]), std::exp(ln + t * error[p])});
  } else if (!form.scale_name.empty()) {
    const double value = cause.scale + (form.integer_scale ? 1 : 0);  // rotors count from 1
    cause.parameters.push_back({form.scale_name, value, value, value});
  }
}

bool excludes_zero(const Accepted& cause) {
  const auto p = static_cast<std::size_t>(cause.theta.size());
  for (std::size_t k = 0; k < p && k < cause.parameters.size(); ++k)
    if (cause.parameters[k].low > 0 || cause.parameters[k].high < 0) return true;
  return false;
}

}  // namespace backwash::study::discrepancy
