// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/effects/effect.hpp"

/// What fitted forms add to a model: effects that field, reach and plan evaluate.
namespace backwash::study {

/// (high − low)/2 of an interval, not negative.
double half_width(const Estimate& e);

/// Σ θ x of a form in one channel, by window; empty if it does not move it.
std::vector<double> added(const FittedForm& fitted, const Observations& seen, Channel channel);

/// The form's own fit, which holds where it was flown; the error is of all shapes at the reference.
std::vector<ModelEffect> own_fit(Law kind, const FittedForm& fitted);
/// A function for Form::extend that adds its own_fit().
std::function<std::vector<ModelEffect>(const FittedForm&, const Observations&)> extends(Law kind);

/// Largest |Σ θ x| flown, level and vertical, with the first parameter at the far end of its interval: a push of any
/// direction up to that.
std::vector<ModelEffect> unknown_push(const FittedForm& fitted, const Observations& seen);

/// Vertical push over the range that was flown, its companions' part in it: its middle, and half of it with the
/// parameter's own error.
std::vector<ModelEffect> flown_range(const FittedForm& fitted, const Observations& seen);

/// A function for Form::simulate: one term of a kind, its numbers θ and, if the form has scales, the scale.
std::function<std::vector<SimulationTerm>(const FittedForm&, const Observations&)> simulates(
    std::variant<Law, SimulationTerm::Kind> kind);

/// The rotors' lines as they were measured along z: root of their mean power, and of the noise beside them that the
/// gusts leave.
SimulationTerm rotor_lines(const Observations& seen);

/// The mean course of a quantity over the flights: its value at their start, and per second.
struct Course {
  double first, rate;
};
Course mean_course(const Observations& seen, double WindowRow::*quantity);

}  // namespace backwash::study
