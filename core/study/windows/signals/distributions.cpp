// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/distributions.hpp"

#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/digamma.hpp>
#include <boost/math/special_functions/trigamma.hpp>

namespace backwash::study {
namespace {

namespace policies = boost::math::policies;
using Policy =
    policies::policy<policies::domain_error<policies::ignore_error>, policies::pole_error<policies::ignore_error>,
                     policies::overflow_error<policies::ignore_error>, policies::promote_double<false>>;

}  // namespace

double student_quantile(double p, double degrees) {
  return quantile(boost::math::students_t_distribution<double, Policy>(degrees), p);
}

double student_tail(double t, double degrees) {
  return cdf(complement(boost::math::students_t_distribution<double, Policy>(degrees), t));
}

double r2_tail(double r2, double explained, double left) {
  return boost::math::ibeta(left / 2, explained / 2, 1 - r2, Policy());
}

double digamma(double x) { return boost::math::digamma(x, Policy()); }
double trigamma(double x) { return boost::math::trigamma(x, Policy()); }

}  // namespace backwash::study
