// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/daemon.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <new>
#include <system_error>

#include "services/backwashd/control_loop.hpp"
#include "services/backwashd/dds_front.hpp"
#include "services/backwashd/link_watch.hpp"
#include "services/backwashd/log_sink.hpp"
#include "services/backwashd/map_worker.hpp"
#include "services/backwashd/planner_worker.hpp"
#include "services/backwashd/process.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::daemon {
namespace {

constexpr double kToEnd = 10, kToFail = 2, kToRecord = 2, kToSay = 0.5;  // s that threads and lines are waited for

/// What keeps the daemon from starting, and is not its own fault.
struct StartError {
  int code;
  std::string what;
};

/// Calls `make` and gives what it throws its exit code.
template <typename Make>
auto made(int code, Make&& make) {
  try {
    return make();
  } catch (const std::exception& e) {
    throw StartError{code, e.what()};
  }
}

firmware_bridge::SerialPort open_port(const decltype(config::Daemon::link)& link) {
  auto port = firmware_bridge::SerialPort::open(link.device, static_cast<unsigned>(link.baud));
  if (!port) throw StartError{kInputOutput, link.device + ": " + describe(port.error())};
  return std::move(*port);
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

namespace {

/// All but the recorder: ended first, so that what they said last is recorded.
void start(Threads& threads, const Settings& settings, Channels& channels, Recorder& recorder, Mission& mission,
           DdsFront& front, ControlLoop& loop, firmware_bridge::AutopilotLink& link) {
  const auto& daemon = settings.daemon;
  threads.start("map worker",
                [&] { run_map_worker(channels, recorder, settings.model, settings.vehicle, daemon.map); });
  threads.start("planner", [&] {
    run_planner(channels, recorder, [&](const track::AcceptedSegment& segment) { front.send(segment); });
  });
  threads.start("mission", [&] {
    run_mission(channels, mission, [&](const CommandMessage& c, const Answer& a) { front.send(c, a); });
  });
  threads.start("status", [&] { front.run_status(settings.vehicle); });
  threads.start("control", [&] {
    make_real_time({daemon.control.priority, daemon.control.cpu});
    run_control(channels, loop);
    link.discard_unsent();
  });
  threads.start("reader", [&] { front.run_readers(); });
  threads.start("link watch", [&] { run_link_watch(channels, daemon.link); });
}

/// After `channels.stop`: waits for the threads, then closes the log with why the flight ended. Returns the exit code
/// if all of them have ended; otherwise they still use what the caller owns, and the process ends here.
int end(Threads& threads, Threads& writer, Channels& channels, Recorder& recorder, std::atomic<bool>& recorded,
        firmware_bridge::AutopilotLink& link, Failure& failure, LogSink& sink, const std::string& log) {
  const bool ended = threads.join(failure.happened() ? kToFail : kToEnd);
  if (!ended) {
    link.discard_unsent();  // of a control thread that hangs
    failure.note("main", "a thread does not end");
  }
  try {
    if (failure.happened()) recorder.append(study::RecordKind::failure, failure.text());
  } catch (const std::bad_alloc&) {
  }
  recorded = true;
  const bool closed = writer.join(kToRecord);
  const auto lost = recorder.lost() + channels.control_log.lost();
  if (lost > 0 || !closed) spdlog::warn("{}: {} records were lost{}", log, lost, closed ? "" : ", the disk hangs");
  if (failure.happened())
    spdlog::critical("backwashd: {}: the flight was ended in silence", failure.text());
  else
    spdlog::info("stopped");
  const int code = failure.happened() ? failure.code() : closed ? 0 : kInputOutput;
  if (ended && closed) return code;
  sink.close(kToSay);
  ::_exit(code);
}

int fly(const Settings& settings, const sigset_t& signals, LogSink& sink) {
  const auto& daemon = settings.daemon;
  // The port first: a start that fails there leaves no log behind.
  auto port = open_port(daemon.link);
  auto channels = std::make_unique<Channels>();
  auto recorder = made(kCannotCreate, [&] { return std::make_unique<Recorder>(daemon.log.file); });
  const std::string log = recorder->path();
  firmware_bridge::AutopilotLink link(std::move(port), static_cast<std::uint8_t>(daemon.link.system),
                                      std::chrono::steady_clock::now());
  // What carries odometry to the control thread comes right below it, before the middleware starts its threads.
  const int control = daemon.control.priority;
  const int reader = allowed_fifo(std::max(control - 10, control > 0 ? 1 : 0));
  auto front =
      made(kSystem, [&] { return std::make_unique<DdsFront>(daemon, reader, settings.vehicle, *channels, *recorder); });
  Mission mission(*channels);
  ControlLoop loop(*channels, link, settings.vehicle, daemon.control.battery_land, daemon.map);

  Failure failure(channels->stop);
  const CatchTheRest rest(failure);
  std::atomic<bool> recorded{false};
  Threads writer(failure), threads(failure);
  try {
    writer.start("recorder", [&] { recorder->run(*channels, recorded); });
    start(threads, settings, *channels, *recorder, mission, *front, loop, link);
    spdlog::info("backwashd runs: {} on {}, DDS domain {}, namespace {}, raw log {}", settings.vehicle.name,
                 daemon.link.device, daemon.dds.domain, daemon.dds.name_space, log);
    wait_for_end(signals, failure);
  } catch (const std::system_error& e) {
    failure.note("start", e.what(), kSystem);
  }
  channels->stop = true;
  return end(threads, writer, *channels, *recorder, recorded, link, failure, sink, log);
}

}  // namespace

int run(const Settings& settings) {
  const sigset_t signals = shield_process();
  const auto sink = LogSink::start(STDERR_FILENO);
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("backwashd", sink));
  int code = kSoftware;
  try {
    code = fly(settings, signals, *sink);
  } catch (const StartError& error) {
    code = error.code;
    spdlog::error("backwashd: {}", error.what);
  } catch (const std::exception& e) {
    spdlog::critical("backwashd: {}", e.what());
  }
  sink->close(kToSay);
  return code;
}

}  // namespace backwash::daemon
