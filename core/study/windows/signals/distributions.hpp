// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Distributions of small samples and special functions, by Boost.Math; NaN where they are not defined.
namespace backwash::study {

/// Quantile p of Student's t with `degrees` of freedom.
double student_quantile(double p, double degrees);
/// P(T > t) of Student's t with `degrees` of freedom.
double student_tail(double t, double degrees);
/// P(R² > r2) where `explained` of all degrees of freedom are fitted to noise alone and `left` remain.
double r2_tail(double r2, double explained, double left);
/// ψ(x) = d ln Γ(x)/dx, and its derivative ψ'(x).
double digamma(double x);
double trigamma(double x);

}  // namespace backwash::study
