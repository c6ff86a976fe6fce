// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/study/discrepancy/study.hpp"

namespace backwash::study::discrepancy {

/// An accepted cause as it is stored in a model file, [[extension.term]].
struct Term {
  std::string cause, formula;  ///< name the catalogue's form
  double scale;
  std::vector<double> theta;  ///< its parameters, in their order
};

std::vector<Term> terms_of(const StudyResult& result);

/// Takes the terms out of the observations: the simulation is then the extended model's. A term whose form or columns
/// are unknown here is returned.
std::vector<Term> apply(const std::vector<Term>& terms, Observations& seen);

/// The model with the causes in it, as far as its own parameters can hold them (README.md, "Extension"): the largest
/// flown push of the mean terms joins bound.mean; a variance term that does not depend on place scales every amplitude
/// of Σ with its largest flown factor.
Model extended(const Model& model, const StudyResult& result, const Observations& seen);

/// Model file: extended() and the terms themselves.
std::string extended_model_text(const Model& model, const StudyResult& result, const Observations& seen,
                                const std::string& base_name, const std::string& version);

}  // namespace backwash::study::discrepancy
