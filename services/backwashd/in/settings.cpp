// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "core/plan/planner.hpp"
#include "core/track/pose_velocity.hpp"
#include "services/backwashd/control/link_watch.hpp"
#include "services/backwashd/daemon.hpp"

namespace backwash::daemon {

tl::expected<Settings, StartError> load_settings(const std::string& path) {
  const auto wrong = [](const config::ConfigError& e) {
    const bool missing = e.kind == config::ConfigError::Kind::not_found;
    return tl::make_unexpected(StartError(missing ? kNoInput : kConfiguration, e.message));
  };
  auto daemon = config::load_daemon(path);
  if (!daemon) return wrong(daemon.error());
  if (const auto line = configured_line(daemon->link, daemon->odometry.timing); !line)
    return tl::make_unexpected(StartError(kConfiguration, path + ": " + line.error()));
  std::optional<security::Credentials> credentials;
  if (!daemon->dds.security.empty()) {
    auto read = security::read_credentials(daemon->dds.security);
    if (!read) return tl::make_unexpected(StartError(kConfiguration, path + ": dds.security: " + read.error()));
    credentials = std::move(*read);
  }
  auto vehicle = config::load_vehicle(daemon->vehicle);
  if (!vehicle) return wrong(vehicle.error());
  // What a velocity from poses may be off is in the first set of every tube.
  if (daemon->odometry.twist == config::Twist::none)
    vehicle->initial_error.velocity +=
        track::PoseVelocity::error(std::min(OdometryTiming::kUsual, daemon->odometry.timing.rate_least));
  auto model = config::load_model(daemon->model);
  if (!model) return wrong(model.error());
  if (daemon->risk) {
    try {
      *model = plan::model_for(std::move(*model), *vehicle, *daemon->risk);
    } catch (const std::invalid_argument& e) {
      return tl::make_unexpected(StartError(kConfiguration, path + ": reach.method: " + e.what() + ": use \"tight\""));
    }
  }
  if (!daemon->adaptation.enabled)
    return Settings{std::move(*daemon), std::move(*vehicle), std::move(*model), std::move(credentials)};
  if (!model->extension.empty())
    return tl::make_unexpected(StartError(
        kConfiguration, daemon->model + ": is an extended model, whose effects are not in what a flight learns: give " +
                            "the one before, or adaptation.enabled = false in " + path));
  const auto tau = config::load_tau_interval(daemon->model);
  if (!tau) return wrong(tau.error());
  adapt::InFlightConstants air;
  air.controller = vehicle->controller;
  air.alpha = daemon->adaptation.alpha;
  air.calmest = daemon->adaptation.calmest;
  air.gusts.tau_low_s = (*tau)[0];
  air.gusts.tau_high_s = (*tau)[1];
  air.gusts.mean_horizontal = model->bound.mean_horizontal;
  air.gusts.mean_vertical = model->bound.mean_vertical;
  return Settings{std::move(*daemon), std::move(*vehicle), std::move(*model), std::move(credentials), air};
}

}  // namespace backwash::daemon
