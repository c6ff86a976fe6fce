// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/amplitudes.hpp"

namespace backwash::study {

Amplitudes::Amplitudes(const Evidence& evidence, const Form& form, const Scale& scale, const DesignColumn& rest)
    : form_(&form), scale_(scale), units_(&evidence.seen().units) {
  const auto& windows = evidence.seen().windows;
  columns_ = form.columns(windows, scale);
  size_ = evidence.size(columns_);
  const auto p = static_cast<Eigen::Index>(columns_.size());
  A_.setZero(p * p, static_cast<Eigen::Index>(windows.size()));
  b_.setZero(p, static_cast<Eigen::Index>(windows.size()));
  std::vector<DesignColumn> turned;
  for (const auto& column : columns_) turned.push_back(decorrelated(column));
  SmallVector x(p);
  for (const auto& [channel, y, aside] : rest.parts) {
    std::vector<const std::vector<double>*> moved(turned.size(), nullptr);
    bool any = false;
    for (std::size_t k = 0; k < turned.size(); ++k)
      for (const auto& part : turned[k].parts)
        if (part.channel == channel) {
          moved[k] = &part.x;
          any = true;
        }
    for (std::size_t i = 0; i < windows.size() && any; ++i) {
      const double w = evidence.weight(channel, i) / evidence.scatter(channel).within;
      if (!(w > 0)) continue;
      for (std::size_t k = 0; k < turned.size(); ++k) x[static_cast<Eigen::Index>(k)] = moved[k] ? (*moved[k])[i] : 0.0;
      SmallMatrix own_A = A(i);
      SmallVector own_b = b(i);
      own_A += w * x * x.transpose();
      own_b += w * y[i] * x;
      A_.col(static_cast<Eigen::Index>(i)) = own_A.reshaped();
      b_.col(static_cast<Eigen::Index>(i)) = own_b;
    }
  }
}

SmallMatrix Amplitudes::A(std::size_t window) const {
  const auto p = static_cast<Eigen::Index>(columns_.size());
  return A_.col(static_cast<Eigen::Index>(window)).reshaped(p, p);
}

SmallMatrix Amplitudes::information(std::size_t begin, std::size_t end) const {
  SmallMatrix sum = SmallMatrix::Zero(size_.rows(), size_.cols());
  for (std::size_t i = begin; i < end; ++i) sum += A(i);
  return sum;
}

SmallVector Amplitudes::theta(std::size_t begin, std::size_t end) const {
  SmallVector sum = SmallVector::Zero(size_.rows());
  for (std::size_t i = begin; i < end; ++i) sum += b(i);
  return information(begin, end).ldlt().solve(sum);
}

bool Amplitudes::told(std::size_t unit) const {
  const SmallMatrix sum = information(begin(unit), end(unit));
  for (Eigen::Index k = 0; k < sum.rows(); ++k)
    if (!(sum(k, k) > kRules.least_square)) return false;
  return sum.determinant() > kRules.no_turn * std::pow(sum.trace(), static_cast<double>(sum.rows()));
}

AmplitudeCourse Amplitudes::course(std::size_t unit, const SmallVector& direction) const {
  AmplitudeCourse course;
  for (std::size_t i = begin(unit); i < end(unit); ++i) {
    const double w = direction.dot(A(i) * direction);
    course.weight.push_back(w);
    course.value.push_back(w > 0 ? direction.dot(b(i)) / w : 0);
  }
  return course;
}

bool Amplitudes::effect(const SmallVector& difference) const {
  return SearchCandidate{form_, form_->cause(), scale_, {}, {}, 0, size_}.effect(difference);
}

}  // namespace backwash::study
