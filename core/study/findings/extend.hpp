// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/study/findings/study.hpp"

namespace backwash::study {

/// An accepted cause as it is stored in a model file, [[extension.term]].
struct ExtensionTerm {
  std::string cause, formula;  ///< name the catalogue's form
  Scale scale;
  std::vector<double> theta;        ///< its parameters, in their order
  std::vector<double> beside = {};  ///< of its companions; empty in files of before they were stored
  double gain = 0;                  ///< held out, nats, in the study that found it
  std::size_t flights = 0;          ///< of that study; 0 in files of before they were stored
};

struct AppliedTerms {
  std::vector<Known> known;         ///< for the search of what is left
  std::vector<ExtensionTerm> left;  ///< of which form or columns are unknown here
};

/// A cause's form as it was fitted. Keeps references to the cause.
FittedForm fitted_form(const NamedCause& cause);

/// Takes the terms out of the observations: the simulation is then the extended model's.
AppliedTerms apply(const std::vector<ExtensionTerm>& terms, Observations& seen);

/// What a cause adds to the model for field, reach and plan (core/study/README.md, "Extension"): pushes and factors of
/// Σ by place and velocity; what depends on things that a plan does not know (battery, time, heading) by its range over
/// the flown windows. Empty for causes that move neither.
std::vector<ModelEffect> effects_of(const NamedCause& cause, const Observations& seen);
/// What a cause adds to the simulation (core/sim).
std::vector<SimulationTerm> simulation_of(const NamedCause& cause, const Observations& seen);
/// Which number of either a model file cannot hold, or is none, by its kind; nothing: none. Such a cause does not join
/// the model.
std::optional<std::string> why_unwritable(const NamedCause& cause, const Observations& seen);
/// Of all causes that join the model.
std::vector<SimulationTerm> simulation_of(const StudyResult& result, const Observations& seen);
/// The model with the effects of all causes that join it behind its own.
Model extended(const Model& model, const StudyResult& result, const Observations& seen);

/// Model file: the model's own tables, then a [[extension.term]] per cause that joins it, with its effects. `earlier`:
/// the text of the terms that the model has already. Errors: throws std::invalid_argument with why_unwritable().
std::string extended_model_text(const Model& model, const StudyResult& result, const Observations& seen,
                                const std::string& base_name, const std::string& version,
                                const std::string& earlier = "");

}  // namespace backwash::study
