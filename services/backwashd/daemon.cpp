// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/daemon.hpp"

#include <pthread.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <thread>

#include "services/backwashd/control_loop.hpp"
#include "services/backwashd/dds_front.hpp"
#include "services/backwashd/link_watch.hpp"
#include "services/backwashd/map_worker.hpp"
#include "services/backwashd/planner_worker.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::daemon {
namespace {

constexpr int kInputOutput = 74;

// Every thread started after this leaves the signals to wait_for_signal().
sigset_t block_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  return set;
}

}  // namespace

tl::expected<Settings, std::string> load_settings(const std::string& path) {
  auto daemon = config::load_daemon(path);
  if (!daemon) return tl::unexpected(daemon.error().message);
  auto vehicle = config::load_vehicle(daemon->vehicle);
  if (!vehicle) return tl::unexpected(vehicle.error().message);
  auto model = config::load_model(daemon->model);
  if (!model) return tl::unexpected(model.error().message);
  return Settings{std::move(*daemon), std::move(*vehicle), std::move(*model)};
}

int run(const Settings& settings) {
  const sigset_t signals = block_signals();
  auto channels = std::make_unique<Channels>();
  Recorder recorder(settings.daemon.log.file);
  using Kind = firmware_bridge::PortError::Kind;
  auto port = open_port(settings.daemon.link);
  if (!port && port.error().kind != Kind::kOpen && port.error().kind != Kind::kBusy) {
    spdlog::error("{}: {}", settings.daemon.link.device, describe(port.error()));
    return kInputOutput;
  }
  if (!port) {  // it may be plugged in, or its simulator started, later: the link watch goes on trying
    spdlog::warn("{} {}; waiting for it", settings.daemon.link.device, describe(port.error()));
    port = firmware_bridge::ClosedPort{};
  }
  firmware_bridge::AutopilotLink link(std::move(*port), static_cast<std::uint8_t>(settings.daemon.link.system),
                                      std::chrono::steady_clock::now());
  // What carries odometry to the control thread comes right below it, before the middleware starts its threads.
  const int control = settings.daemon.control.priority;
  DdsFront front(settings.daemon, allowed_fifo(std::max(control - 10, control > 0 ? 1 : 0)), settings.vehicle,
                 *channels, recorder);
  Mission mission(*channels);
  ControlLoop loop(*channels, link, settings.vehicle, settings.daemon.control.battery_land, settings.daemon.map);
  {
    const std::array threads = {
        std::jthread([&] { recorder.run(*channels); }),
        std::jthread(
            [&] { run_map_worker(*channels, recorder, settings.model, settings.vehicle, settings.daemon.map); }),
        std::jthread([&] {
          run_planner(*channels, recorder, [&](const track::AcceptedSegment& segment) { front.send(segment); });
        }),
        std::jthread([&] {
          run_mission(*channels, mission, [&](const CommandMessage& c, const Answer& a) { front.send(c, a); });
        }),
        std::jthread([&] { front.run_status(settings.vehicle); }),
        std::jthread([&] {
          make_real_time({settings.daemon.control.priority, settings.daemon.control.cpu});
          run_control(*channels, loop);
        }),
        std::jthread([&] { front.run_readers(); }),
        std::jthread([&] { run_link_watch(*channels, settings.daemon.link); })};
    spdlog::info("backwashd runs: {} on {}, DDS domain {}, namespace {}", settings.vehicle.name,
                 settings.daemon.link.device, settings.daemon.dds.domain, settings.daemon.dds.name_space);
    int signal = 0;
    sigwait(&signals, &signal);
    channels->stop = true;
  }
  if (const auto lost = recorder.lost() + channels->control_log.lost())
    spdlog::warn("{}: {} records were lost", settings.daemon.log.file, lost);
  spdlog::info("stopped");
  return 0;
}

}  // namespace backwash::daemon
