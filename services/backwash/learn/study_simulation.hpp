// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/study/findings/extend.hpp"
#include "core/study/findings/residuals.hpp"
#include "core/types/model.hpp"
#include "core/types/simulation_term.hpp"
#include "services/backwash/learn/study_flights.hpp"

namespace backwash::services {

/// Whose simulation: the model file, as it was read, and the seed of the gusts.
struct Simulated {
  std::string path;
  const Model& model;
  std::uint64_t seed;
};

/// Section of the page: what the simulation in the model's own air says of each measured window with the model's own
/// terms, and with those of the causes beside them; mean over four flights with other gusts. The flights' logs are
/// kept. Throws Failure 65 for a log without set-points. On all processors.
std::string residuals(const Simulated& by, const Flights& flights, const LookedWith& with,
                      const study::Observations& measured, const std::vector<SimulationTerm>& found,
                      report::PageData& data);

/// The study's own terms of a model file that it has extended before; none in others.
std::vector<study::ExtensionTerm> read_terms(const std::string& path);
/// The [[extension.term]] tables of a model file as they stand there; empty if it has none.
std::string earlier_terms(const std::string& path);

}  // namespace backwash::services
