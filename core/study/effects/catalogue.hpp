// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/study/windows/observation.hpp"

namespace backwash::study {

/// One regressor: its value on each window, in the channels that it moves.
struct Column {
  struct Part {
    Channel channel;
    std::vector<double> x;
  };
  std::vector<Part> parts;
};

using Windows = std::vector<WindowRow>;

/// One physical form of a cause, linear in its parameters at a given scale. core/study/README.md lists them with units.
struct Form {
  std::string cause;                    ///< name of docs/interfaces.md
  std::string formula;                  ///< what is added to which channel
  std::vector<std::string> parameters;  ///< one per column, unit in the name
  std::string scale_name = "";          ///< "L_m" …; empty without a scale
  std::vector<double> scales = {0};     ///< grid
  bool integer_scale = false;           ///< a rotor number: not polished
  bool constant = false;                ///< is itself what a free offset would be: tested without one
  bool by_place = false;                ///< a push that differs by place: it moves the craft in itself
  double floor = 0;                     ///< least root mean square over the flown windows that is called an effect
  double least = 0;                     ///< least magnitude of the first parameter that is called an effect
  bool one_sided = false;               ///< the first parameter cannot be negative
  /// Half the range, in the first parameter's unit, in which the logs alone cannot tell the value.
  std::function<double(const Observations&)> unknowable = [](const Observations&) { return 0.0; };
  std::function<std::vector<Column>(const Windows&, double scale)> columns = {};
};

/// Whole catalogue.
const std::vector<Form>& catalogue();
/// Every cause name of docs/interfaces.md.
const std::vector<std::string>& cause_names();
/// Why these observations cannot test a form; nothing if they can.
std::optional<std::string> why_not_tested(const Form& form, const Observations& seen);

/// Regressors of which any smooth function competes with the catalogue.
struct Regressor {
  std::string name;
  bool circular = false;
  std::function<double(const WindowRow&)> value;
};
std::vector<Regressor> regressors(const Observations& seen);
/// Each window's rank q in [0, 1] along a regressor (ties share theirs); circular: the angle itself, rad.
std::vector<double> ranks(const Regressor& along, const Windows& windows);
/// The channels that a smooth moves together, with their name.
const std::vector<std::pair<std::string, std::vector<Channel>>>& channel_groups();
/// cos(π k q), k = 1 … 4, of the regressor's rank q in [0, 1] (circular: sin and cos of one and two turns), in the
/// channels of one group: level means each for themselves, ln variance along all axes as one.
std::vector<Column> smooth_columns(const Regressor& along, const Windows& windows, const std::vector<Channel>& group);

/// What an accepted form leaves open and no other cause may claim: the reference voltage of a sagging battery, the
/// bias at which a drift begins.
std::vector<Column> companions(const Form& form, const Observations& seen);

/// Windows where a push Σ θ x, in the mean channels, has moved the craft: the loop gives way by push/k_p (e = w/k_p at
/// rest), so that the craft is not where the set-points alone lead.
Windows moved_by(const Windows& windows, const std::vector<Column>& columns, const Eigen::VectorXd& theta);
/// The same by a form's own push, where it is one by place: push and place found in turns.
Windows moved_by_itself(const Form& form, const Windows& windows, double scale, const Eigen::VectorXd& theta);

/// Free offsets of the channels that columns move: constants, and for level means those fixed to the body too; in
/// variance channels also the noise of the accelerometer, a constant over Σ.
std::vector<Column> offsets(const std::vector<Column>& columns, const Observations& seen);

}  // namespace backwash::study
