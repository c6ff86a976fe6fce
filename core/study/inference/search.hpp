// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/study/inference/candidates.hpp"
#include "core/study/inference/intervals.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {

/// A cause that the model holds already and that is taken out of the observations.
struct Known {
  std::vector<DesignColumn> columns;
  double gain;  ///< held out, nats, of as many flights as these
};

struct CauseSearchOptions {
  int flips = static_cast<int>(kRules.flips);  ///< sign draws of the null
  double accept_p = kRules.accept_p;  ///< family-wise, nominal; docs/measurements/confusion.md says what it comes to
  unsigned seed = 1;
  std::size_t most_causes = static_cast<std::size_t>(kRules.most_causes);
  std::vector<Known> known = {};  ///< what is left may be the error of their forms, as beside an accepted cause
  std::function<void(const std::string&)> progress = [](const std::string&) {};
};

struct Rival {
  std::string name;
  const Form* form;
  Scale scale;
  double behind_nats;  ///< gain of the accepted cause less the rival's
};

/// A flight, or what is left out with it: its share of the gain, nats, and θ without it.
struct LeftOut {
  double nats;
  SmallVector theta;
};

struct Accepted {
  const Form* form;
  Scale scale;
  std::vector<DesignColumn> columns;
  SmallVector theta;
  double p;
  double gain;  ///< held out, nats, given the other accepted causes
  std::vector<Estimate> parameters;
  std::vector<Rival> rivals;
  std::vector<LeftOut> flights = {};  ///< `gain` by flight; empty where none may be left out
};

/// What the size of a cause costs beforehand, nats (Form::prior_nats).
double prior_nats_of(const Accepted& cause);

struct UnknownStructure {
  std::string along;           ///< regressor; two, "x_m, y_m", if their products are meant
  std::string group;           ///< channels: "mean x, y", "mean z", "ln variance"
  double p;                    ///< family-wise
  std::optional<double> gain;  ///< held out, nats; none where only the dependence was found
  std::string shape;           ///< Structure::shape; "any" where only the dependence was found
  std::optional<double> hz;    ///< of a tone
};

/// A cause that would have led, but for a size that its law cannot have.
struct Refused {
  std::string name, form, parameter;
  double value, least, most;
  std::string reason;
};

struct CauseSearchResult {
  std::vector<Accepted> accepted;  ///< in the order found
  std::vector<Refused> refused;
  std::vector<UnknownStructure> unknown;
  double threshold = 0;            ///< nats that the null of the catalogue exceeds at its level, last step
  double structure_threshold = 0;  ///< the same of the structures
};

/// Greedy search under the null of whole flights' signs flipped (docs/model.md section 8).
CauseSearchResult search(const Evidence& evidence, const CauseSearchOptions& options);

}  // namespace backwash::study
