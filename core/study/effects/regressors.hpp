// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/effects/table.hpp"

/// What competes with the effects, and what stands beside them: regressors, free offsets, companions.
namespace backwash::study {

/// Regressors of which any structure competes with the catalogue (structures.hpp).
std::vector<Regressor> regressors(const Observations& seen);
/// Each window's rank q in [0, 1] along a regressor (ties share theirs); circular: the angle itself, rad.
std::vector<double> ranks(const Regressor& along, const Windows& windows);
/// The channels that a structure moves together, with their name.
const std::vector<std::pair<std::string, std::vector<Channel>>>& channel_groups();

/// What an accepted form leaves open (Form::companions).
std::vector<DesignColumn> companions(const Form& form, const Observations& seen);

/// Windows where a push Σ θ x, in the mean channels, has moved the craft: the loop gives way by push/k_p (e = w/k_p at
/// rest), so that the craft is not where the set-points alone lead.
Windows moved_by(const Windows& windows, const std::vector<DesignColumn>& columns, const Eigen::VectorXd& theta);
/// The same by a form's own push, where it is one by place: push and place found in turns.
Windows moved_by_itself(const Form& form, const Windows& windows, const Scale& scale, const Eigen::VectorXd& theta);

/// Free offsets of the channels that columns move: constants, and for level means those fixed to the body too; in
/// variance channels also the noise of the accelerometer, a constant over Σ. A channel in which a column beside these
/// is constant has its offset already: what that column does elsewhere would be free too with a second one.
std::vector<DesignColumn> offsets(const std::vector<DesignColumn>& columns, const Observations& seen,
                                  const std::vector<DesignColumn>& beside = {});

}  // namespace backwash::study
