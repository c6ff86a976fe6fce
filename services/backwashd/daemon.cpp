// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/daemon.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <new>
#include <system_error>

#include "core/config/file_hash.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/control_loop.hpp"
#include "services/backwashd/control/link_watch.hpp"
#include "services/backwashd/in/dds_front.hpp"
#include "services/backwashd/in/signing_time.hpp"
#include "services/backwashd/map/map_front.hpp"
#include "services/backwashd/map/map_worker.hpp"
#include "services/backwashd/out/gpio_worker.hpp"
#include "services/backwashd/plan/air_file.hpp"
#include "services/backwashd/plan/planner_worker.hpp"
#include "services/backwashd/process.hpp"
#include "services/backwashd/record/log_sink.hpp"
#include "services/backwashd/service_manager.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::daemon {
namespace {

using namespace std::chrono_literals;

// Whatever is at work, the process is gone 2 s after it was asked to end: the threads have until kToEnd after that, the
// raw log until kToRecord, the middleware until kToTakeDown, the last lines kToSay more.
constexpr auto kToEnd = 700ms, kToRecord = 1500ms, kToTakeDown = 1600ms;
constexpr double kToSay = 0.3;  // s
constexpr std::uint64_t kTicksToBeReady = kTicksPerSecond / 2;

/// Calls `make` and gives what it throws its exit code.
template <typename Make>
auto made(ExitCode code, Make&& make) {
  try {
    return make();
  } catch (const std::exception& e) {
    throw StartError(dynamic_cast<const dds::NotPermitted*>(&e) ? kConfiguration : code, e.what());
  }
}

std::uint64_t part_bytes(const config::Daemon& daemon) {
  constexpr double kMib = 1 << 20;
  return static_cast<std::uint64_t>(daemon.log.max_mib * kMib);
}

/// A port that is missing or busy may be plugged in, or its simulator started, later: the link watch goes on trying.
firmware_bridge::Port port_at_start(const decltype(config::Daemon::link)& link) {
  using Kind = firmware_bridge::PortError::Kind;
  auto port = open_port(link);
  if (port) return std::move(*port);
  const std::string what = link.device + ": " + describe(port.error());
  if (port.error().kind != Kind::open && port.error().kind != Kind::busy) throw StartError(kInputOutput, what);
  spdlog::warn("{}; waiting for it", what);
  return firmware_bridge::ClosedPort{};
}

/// Lets the link sign, where a key is configured.
std::unique_ptr<SigningTimeFile> sign(const config::Daemon& daemon, firmware_bridge::AutopilotLink& link) {
  if (!daemon.link.signing_key) return nullptr;
  constexpr std::uint8_t kLinkId = 0;  // this is the daemon's one link
  auto time = made(kCannotCreate, [&] {
    return std::make_unique<SigningTimeFile>(signing_time_path(daemon.log.file), std::chrono::system_clock::now());
  });
  link.require_signatures(mavlink::Signing(*daemon.link.signing_key, kLinkId, time->start()),
                          std::chrono::steady_clock::now());
  return time;
}

/// What earlier flights have learnt of the air, where a file is configured for it.
std::unique_ptr<AirFile> air_file(const Settings& s) {
  if (!s.air || s.daemon.adaptation.file.empty()) return nullptr;
  const auto files = config::hash_of_files(s.daemon.vehicle, s.daemon.model);
  if (!files) throw StartError(kNoInput, files.error().message);
  return std::make_unique<AirFile>(s.daemon.adaptation.file, *files);
}

std::optional<adapt::InFlightConstants> learns_from(const Settings& s, const AirFile* file) {
  auto air = s.air;
  if (air && file) air->start = file->start();
  return air;
}

// What carries odometry and the stop switch to the control thread comes right below it, before the middleware starts.
int reader_priority(const config::Daemon& daemon) {
  const int control = daemon.control.priority;
  return allowed_fifo(std::max(control - 10, control > 0 ? 1 : 0));
}

/// Everything that runs. What others use comes first.
struct Flight {
  Flight(const Settings& s, const ServiceManager& m)
      : settings(s),
        manager(m),
        port(port_at_start(s.daemon.link)),  // first: a start that fails there leaves no log behind
        factors(air_file(s)),
        air(learns_from(s, factors.get())),
        recorder(
            made(kCannotCreate, [&] { return std::make_unique<Recorder>(s.daemon.log.file, part_bytes(s.daemon)); })),
        log(recorder->path()),
        link(std::move(port), static_cast<std::uint8_t>(s.daemon.link.system), std::chrono::steady_clock::now()),
        signing_time(sign(s.daemon, link)),
        front(made(
            kSystem,
            [&] { return std::make_unique<DdsFront>(s.daemon, reader_priority(s.daemon), s.vehicle, *channels); })),
        maps(made(kSystem,
                  [&] { return std::make_unique<MapFront>(s.daemon, s.vehicle.body.radius, *channels, *recorder); })),
        mission(s.vehicle),
        loop(*channels, link, s.vehicle, s.daemon.control.battery_land, s.daemon.map, s.daemon.odometry.timing, air) {
    link.pace(configured_line(s.daemon.link, s.daemon.odometry.timing).value());
    if (!s.daemon.gpio.chip.empty()) gpio.emplace(*channels, s.daemon.gpio);
  }

  const Settings& settings;
  const ServiceManager& manager;
  std::unique_ptr<Channels> channels = std::make_unique<Channels>();
  firmware_bridge::Port port;
  std::unique_ptr<AirFile> factors;  ///< null: none are kept
  std::optional<adapt::InFlightConstants> air;
  std::unique_ptr<Recorder> recorder;
  const std::string log;  ///< file that the recorder began with
  firmware_bridge::AutopilotLink link;
  std::unique_ptr<SigningTimeFile> signing_time;  ///< null: no key
  std::unique_ptr<DdsFront> front;
  std::unique_ptr<MapFront> maps;  ///< after the front, which watches the middleware's log
  Mission mission;
  ControlLoop loop;
  std::optional<GpioWorker> gpio;  ///< before the control thread: its switch is not absent in the first ticks
  Failure failure{channels->stop};
  CatchTheRest rest{failure};
  std::atomic<bool> recorded{false};
  Threads writer{failure}, threads{failure};  ///< the writer ends last, so that what the others said is recorded
};

void start(Flight& f) {
  Channels& channels = *f.channels;
  const auto& daemon = f.settings.daemon;
  f.writer.start("recorder", [&] { f.recorder->run(channels, f.recorded); });
  if (f.signing_time) f.writer.start("signing time", [&] { run_signing_time(*f.signing_time, channels, f.recorded); });
  if (f.factors) f.writer.start("air file", [&] { run_air_file(*f.factors, channels, f.recorded); });
  f.threads.start("map worker", [&] {
    run_map_worker(channels, *f.recorder, f.settings.model, f.settings.vehicle, daemon.map,
                   f.air ? std::optional(f.air->start) : std::nullopt);
  });
  f.threads.start("planner", [&] {
    run_planner(
        channels, *f.recorder, [&](const track::AcceptedSegment& segment) { f.maps->send(segment); },
        daemon.odometry.timing);
  });
  f.threads.start("mission", [&] {
    run_mission(channels, f.mission, [&](const CommandMessage& c, const Answer& a) {
      f.front->send(c, a);
      f.recorder->append(log::RecordKind::ack, std::string(c.station.data()) + " " + std::to_string(c.sequence) +
                                                   " result " + std::to_string(a.result) + ": " + a.reason);
    });
  });
  f.threads.start("status", [&] { f.front->run_status(f.settings.vehicle, *f.recorder); });
  if (f.gpio) f.threads.start("gpio", [&] { run_gpio(channels, *f.gpio, reader_priority(daemon)); });
  f.threads.start("control", [&] {
    make_real_time({daemon.control.priority, daemon.control.cpu});
    run_control(channels, f.loop, f.manager);
    f.link.discard_unsent();
  });
  f.threads.start("reader", [&] { f.front->run_readers(); });
  f.threads.start("map reader", [&] { f.maps->run_readers(); });
  f.threads.start("link watch", [&] { run_link_watch(channels, daemon.link, f.manager); });
}

/// Waits for the threads and closes the log, with why the flight ended if nobody asked for it. False: a thread is still
/// at work. It may be left: the control thread sends nothing more after its next tick, the log is closed by a thread of
/// its own, and the rest (maps, plans, answers) is memory of this process alone.
bool end(Flight& f, std::chrono::steady_clock::time_point asked) {
  f.channels->stop = true;
  f.manager.stopping();
  let_all_run();
  const bool ended = f.threads.join(asked + kToEnd);
  if (!ended) f.link.discard_unsent();  // of a control thread that hangs
  try {
    if (f.failure.happened()) f.recorder->append(log::RecordKind::failure, f.failure.text());
  } catch (const std::bad_alloc&) {
  }
  f.recorded = true;
  const bool closed = f.writer.join(asked + kToRecord);
  if (!closed) f.failure.note("recorder", "the disk does not answer", kInputOutput);
  if (const auto lost = f.recorder->lost() + f.channels->records_lost())
    spdlog::warn("{}: {} records were lost", f.log, lost);
  try {
    if (ended) spdlog::info("{}: {}", f.settings.daemon.link.device, traffic(f.link));
  } catch (const std::bad_alloc&) {  // nor may it keep the failure below from being told
  }
  if (f.failure.happened())
    spdlog::critical("backwashd: {}; nothing more is sent", f.failure.text());
  else
    spdlog::info("stopped{}", ended ? "" : ", with a thread still at work");
  return ended && closed;
}

/// Takes down what ran, of which all is recorded and told. False: the middleware is still at it. libddsc 0.10.2 waits
/// for its own threads without end where an interface that it spoke on has vanished; what it would still do is memory
/// of this process, and the farewell to others, who notice by its lease.
bool take_down(std::unique_ptr<Flight> flight, std::chrono::steady_clock::time_point latest) {
  if (done_by(latest, [held = flight.release()] { const std::unique_ptr<Flight> gone(held); })) return true;
  spdlog::warn("the middleware does not end, as when a network interface has vanished: it is left behind");
  return false;
}

/// The middleware ends what speaks by a certificate with that certificate, in flight too.
void tell_of(const security::Credentials& c) {
  constexpr std::int64_t kSoon_s = 30 * 86400;
  const std::int64_t left_s = c.ends - std::time(nullptr);
  if (left_s < kSoon_s)
    spdlog::warn("DDS Security as {}: its certificate ends in {} days and {} h; a flight then ends with it", c.subject,
                 left_s / 86400, left_s / 3600 % 24);
  else
    spdlog::info("DDS Security as {}", c.subject);
}

}  // namespace

int run(const Settings& settings) {
  limit_memory();
  const sigset_t signals = shield_process();
  const auto manager = ServiceManager::of_environment(STDERR_FILENO);
  const auto sink =
      LogSink::start(STDERR_FILENO, manager.has_journal() ? LogSink::Head::priority : LogSink::Head::time);
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("backwashd", sink));
  int code = kSoftware;
  try {
    auto flight = std::make_unique<Flight>(settings, manager);
    try {
      start(*flight);
      spdlog::info("backwashd runs: {} on {}, DDS domain {}, namespace {}, raw log {}", settings.vehicle.name,
                   settings.daemon.link.device, settings.daemon.dds.domain, settings.daemon.dds.name_space,
                   flight->log);
      if (const auto& risk = settings.model.bound.stated)
        spdlog::info(
            "a risk of {} is kept on each way and in each minute at rest; a position is judged by sets {:.2f} times as "
            "wide",
            risk->touch, risk->worst);
      if (const auto& c = settings.credentials) tell_of(*c);
      bool ready = false;  // the first ticks are on time only if the rest has started
      wait_for_end(signals, flight->failure, [&] {
        if (!ready && (ready = flight->channels->pulse.ticks >= kTicksToBeReady)) manager.ready();
      });
    } catch (const std::system_error& e) {
      flight->failure.note("start", e.what(), kSystem);
    }
    const auto asked = std::chrono::steady_clock::now();
    const bool ended = end(*flight, asked);
    code = flight->failure.code();
    // What hangs still uses the flight: it is left to the process's end.
    if (!(ended ? take_down(std::move(flight), asked + kToTakeDown) : (flight.release(), false))) {
      sink->close(kToSay);
      ::_exit(code);
    }
  } catch (const StartError& error) {
    code = error.code;
    spdlog::error("backwashd: {}", error.what());
  } catch (const std::exception& e) {
    spdlog::critical("backwashd: {}", e.what());
  }
  sink->close(kToSay);
  return code;
}

}  // namespace backwash::daemon
