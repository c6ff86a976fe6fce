// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/bench.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <thread>

#include "core/map/distance_field.hpp"
#include "core/sim/vehicle/vio.hpp"
#include "services/bench/controller_in_loop.hpp"
#include "services/bench/emulation/firmware.hpp"
#include "services/bench/messages.hpp"
#include "services/bench/pty.hpp"
#include "services/bench/scans.hpp"
#include "services/bench/truth_log.hpp"
#include "services/command_line/exit_code.hpp"
#include "services/dds/topics.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kMapEvery = 5000;     // steps, when the map has faults; otherwise it is sent once
constexpr int kPriority = 60;       // SCHED_FIFO
constexpr double kVioShare = 0.75;  // of the vehicle's estimation.position

volatile std::sig_atomic_t stopped = 0;

double seconds(Clock::time_point t) { return std::chrono::duration<double>(t.time_since_epoch()).count(); }

/// Centre of the vehicle when it stands below `p`.
Vec3 ground_below(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& p) {
  Index3 v = grid.index(p);
  if (!grid.free(v)) throw StartError(kUnavailable, "--start is not in free space; choose a point above a floor");
  while (grid.free(v)) --v.z();
  if (!grid.occupied(v))
    throw StartError(kUnavailable, "there is no known floor below --start; choose a point above one");
  return {p.x(), p.y(), grid.center(v).z() + grid.resolution() / 2 + vehicle.body.radius};
}

/// What the mapper knows before the flight: the room without what lies in the box.
map::OccupancyGrid without(map::OccupancyGrid room, const std::array<Vec3, 2>& box) {
  for (std::size_t n = 0; n < room.cell_count(); ++n) {
    const Vec3 c = room.center(room.voxel(n));
    if ((c.array() > box[0].array()).all() && (c.array() < box[1].array()).all())
      room.set(room.voxel(n), map::Cell::unknown);
  }
  return room;
}

std::unique_ptr<Autopilot> make_autopilot(const Options& o, const map::OccupancyGrid& grid, const Vehicle& vehicle) {
  constexpr double kUptime = 60;  // s: it was switched on before the bench
  const Vec3 ground = ground_below(grid, vehicle, o.start);
  if (!o.in_loop.empty()) return std::make_unique<ControllerInLoop>(grid, vehicle, ground, o.seed, o.in_loop);
  const Site site{
      .grid = grid, .vehicle = vehicle, .ground_W = ground, .frame = o.frame, .seed = o.seed, .uptime = kUptime};
  std::unique_ptr<Autopilot> autopilot;
  if (o.autopilot == Options::Profile::ardupilot) autopilot = make_arducopter(site);
  if (o.autopilot == Options::Profile::px4) autopilot = make_px4(site);
  if (!autopilot) autopilot = std::make_unique<Autopilot>(grid, vehicle, ground, o.frame, o.seed, std::uint8_t{1});
  take_gains(o.autopilot == Options::Profile::ardupilot ? firmware_bridge::kArduPilot : firmware_bridge::kPx4, vehicle,
             autopilot->parameters);
  for (const auto& [name, value] : o.parameters) autopilot->parameters[name] = value;
  return autopilot;
}

/// The channels with their faults, and the judge of what the flight shall keep.
class Faults {
 public:
  Faults(const Timeline& timeline, const map::OccupancyGrid& grid, const Vehicle& vehicle, double ground_z)
      : up(timeline.of(Fault::Channel::up), 11),
        down(timeline.of(Fault::Channel::down), 12),
        odometry(timeline.of(Fault::Channel::odometry), 13),
        maps(timeline.of(Fault::Channel::map), 14),
        timeline_(timeline),
        running_(timeline.faults.size(), false),
        grid_(grid),
        vehicle_(vehicle),
        ground_z_(ground_z),
        judge_(timeline.expectations, first()) {
    if (!timeline.expectations.empty()) distance_.emplace(grid);
  }
  bool spoils_map() const { return !timeline_.of(Fault::Channel::map).empty(); }

  void watch(const Autopilot& a, double t) {
    for (std::size_t n = 0; n < running_.size(); ++n) {
      const Fault& f = timeline_.faults[n];
      const bool runs = t >= f.from && t < f.until;
      if (runs != running_[n])
        spdlog::info("fault {} {} {} at {:.2f} s", name_of(f.channel), name_of(f.kind), runs ? "begins" : "ends", t);
      running_[n] = runs;
    }
    if (!distance_ || t < 0) return;
    // The floor on which it stands is no obstacle below half its radius above.
    const Vec3& p = a.truth().p_W;
    const bool flies = p.z() > ground_z_ + 0.5 * vehicle_.body.radius;
    judge_.take({a.truth(), a.landed(), flies ? distance_->exact(grid_, p) - vehicle_.body.radius : 1e9}, t);
  }
  /// Prints the table of expectations; true when each was kept.
  bool report() const {
    bool kept = true;
    if (!timeline_.expectations.empty()) std::printf("%-10s %-18s %-14s\n", "expected", "limit", "measured");
    for (const auto& v : judge_.judgements()) {
      std::printf("%-10s %-18s %-14s %s\n", v.what.c_str(), v.limit.c_str(), v.measured.c_str(),
                  v.passed ? "pass" : "FAIL");
      kept = kept && v.passed;
    }
    spdlog::info("spoilt: {} chunks up, {} down, {} samples of odometry, {} maps", up.spoilt(), down.spoilt(),
                 odometry.spoilt(), maps.spoilt());
    return kept;
  }

  FaultyChannel<Bytes> up, down;
  FaultyChannel<VioSample> odometry;
  FaultyChannel<MapMessage> maps;

 private:
  double first() const {
    double t = timeline_.faults.empty() ? 0 : 1e9;
    for (const Fault& f : timeline_.faults) t = std::min(t, f.from);
    return t;
  }
  const Timeline& timeline_;
  std::vector<bool> running_;
  const map::OccupancyGrid& grid_;
  const Vehicle& vehicle_;
  double ground_z_;
  std::optional<map::DistanceField> distance_;
  Judge judge_;
};

std::optional<Bytes> some(Bytes bytes) { return bytes.empty() ? std::nullopt : std::optional(std::move(bytes)); }

/// The emulated controller, VIO and mapper, a millisecond a step.
/// Null: none is named.
const config::OdometryProfile* profile(std::string_view name) {
  const auto all = config::odometry_profiles();
  const auto found = std::ranges::find(all, name, &config::OdometryProfile::name);
  return found == all.end() ? nullptr : &*found;
}

class Bench {
 public:
  Bench(const Options& options, const map::OccupancyGrid& grid, const Vehicle& vehicle)
      : o_(options),
        grid_(grid),
        known_(options.hidden ? without(grid, *options.hidden) : grid),
        autopilot_(make_autopilot(options, grid, vehicle)),
        faults_(options.timeline, grid, vehicle, autopilot_->truth().p_W.z()),
        log_(options.log),
        vio_(kVioShare * vehicle.estimation.position, options.seed + 1),
        priority_(allowed_fifo(kPriority)),
        participant_(static_cast<std::uint32_t>(options.domain), options.interface, {.priority = priority_},
                     options.security),
        noise_(options.seed) {
    // It stands in for hardware: where it may, it runs before everything but the daemon's own real-time threads.
    if (priority_ > 0) set_fifo(priority_);
    if (!o_.wire.empty() && !autopilot_->log_wire(o_.wire))
      throw StartError(kCannotCreate,
                       "--wire " + o_.wire + ": cannot be created; name a file in a folder that can be written");
    if (o_.drift) closure_writer_.write(loop_closure(Vec3::Zero(), 0));
    send_map(MapMessage{known_}, o_.timeline.after_arming ? -1 : 0);
    if (o_.in_loop.empty()) pty_.emplace(o_.link);
  }

  void run() {
    begun_ = Clock::now();
    auto due = begun_;
    for (long n = 0; !stopped && seconds(due) - seconds(begun_) < o_.duration_s; ++n) {
      due += std::chrono::milliseconds(1);
      std::this_thread::sleep_until(due);
      step(n, seconds(due));
    }
  }
  Autopilot& autopilot() const { return *autopilot_; }
  /// Prints the expectations; true when each was kept.
  bool report() const { return faults_.report(); }

 private:
  /// `t`: by the monotonic clock, s.
  void step(long n, double t) {
    const double since_begin = t - seconds(begun_);
    const double timeline_t = !o_.timeline.after_arming ? since_begin : armed_at_ ? t - *armed_at_ : -1;
    exchange(t, timeline_t);
    if (faults_.spoils_map())
      send_map(n % kMapEvery == 0 ? std::optional(MapMessage{known_}) : std::nullopt, timeline_t);
    if (n % 10 == 0) faults_.watch(*autopilot_, timeline_t);
    autopilot_->mute = passed(o_.stop_heartbeat_s, t);
    State estimate = vio_.estimate(autopilot_->truth(), since_begin);
    if (o_.drift) estimate.p_W -= *o_.drift;
    event_ = event_ || (autopilot_->armed() && autopilot_->truth().p_W.x() > o_.event_x);
    close_loop(t);
    send_scans(n, t);
    std::optional<VioSample> sample;
    if (transit_.due(n) && !passed(o_.stop_odometry_s, t)) sample = {estimate, autopilot_->attitude(), t};
    for (const VioSample& s : faults_.odometry.pass(sample, timeline_t)) transit_.send(s, t);
    while (const auto s = transit_.arrived(t))
      pose_writer_.write(estimator_ ? odometry(*s, *estimator_) : odometry(*s, o_.drift.has_value()));
    if (n % 20 == 0) log_.row(t, *autopilot_, estimate);
  }

  /// Bytes of the link, both ways, through what the timeline does to them.
  void exchange(double t, double timeline_t) {
    for (const Bytes& bytes : faults_.up.pass(some(pty_ ? pty_->read() : Bytes{}), timeline_t))
      autopilot_->receive(bytes, seconds(Clock::now()));
    out_.clear();
    autopilot_->step(t, out_);
    for (const Bytes& bytes : faults_.down.pass(some(out_), timeline_t))
      if (pty_) pty_->write(bytes);
    if (!armed_at_ && autopilot_->armed()) armed_at_ = t;
  }

  void send_map(std::optional<MapMessage> in, double timeline_t) {
    for (const MapMessage& m : faults_.maps.pass(std::move(in), timeline_t)) {
      std::vector<std::int8_t> data;
      const dds::Octomap message = octomap(m.grid, data, map_frame_);
      if (m.garbage) std::ranges::generate(data, [&] { return static_cast<std::int8_t>(noise_()); });
      map_writer_.write(message);
    }
  }

  void close_loop(double t) {
    if (!o_.drift || !event_ || closed_) return;
    closure_writer_.write(loop_closure(*o_.drift, t));
    closed_ = true;
  }

  void send_scans(long n, double t) {
    const Vec3& p = autopilot_->truth().p_W;
    const auto seen = [&](const std::vector<Vec3>& points) {
      scans_.send(points, autopilot_->truth(), autopilot_->attitude(), t);
    };
    if (n % 100 == 0 && o_.crate && event_) seen(seen_of_crate(*o_.crate, o_.crate_edge, p));
    if (n % 250 == 0 && o_.hidden && autopilot_->armed()) seen(seen_of_room(grid_, p));
  }

  /// The vehicle has been armed for longer than `s`.
  bool passed(const std::optional<double>& s, double t) const { return s && armed_at_ && t - *armed_at_ > *s; }

  const Options& o_;
  const config::OdometryProfile* estimator_ = profile(o_.estimator);
  const std::string map_frame_ = estimator_ ? std::string(estimator_->frame) : "map";
  const map::OccupancyGrid& grid_;
  const map::OccupancyGrid known_;
  std::unique_ptr<Autopilot> autopilot_;
  Faults faults_;
  TruthLog log_;
  sim::EmulatedVio vio_;
  Transit<VioSample> transit_{o_.odometry, o_.seed + 2};
  int priority_;
  dds::Participant participant_;
  PoseWriter pose_writer_{participant_, o_.name_space, o_.message};
  dds::Writer<dds::Octomap> map_writer_ = dds::make_writer<dds::Octomap>(participant_, o_.name_space);
  dds::Writer<dds::TransformStamped> closure_writer_ =
      dds::make_writer<dds::TransformStamped>(participant_, o_.name_space);
  Scans scans_{participant_, o_.name_space};
  std::mt19937_64 noise_;
  std::optional<Pty> pty_;  ///< last: who opens the link finds everything else at work
  Clock::time_point begun_{};
  std::optional<double> armed_at_;
  bool closed_ = false, event_ = false;
  Bytes out_;
};

}  // namespace

int run(const Options& options, const map::OccupancyGrid& grid, const Vehicle& vehicle) {
  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  Bench bench(options, grid, vehicle);
  spdlog::info("bench runs: {} in {}, controller on {}", vehicle.name, options.map,
               options.in_loop.empty() ? options.link : options.in_loop);
  bench.run();
  Autopilot& a = bench.autopilot();
  if (auto* const in_loop = dynamic_cast<ControllerInLoop*>(&a)) in_loop->tell_latency();
  spdlog::info("bench stopped: {}, {}, {} set-points received", a.mode(), a.landed() ? "on the ground" : "in the air",
               a.setpoints());
  return bench.report() ? 0 : 1;
}

}  // namespace backwash::bench
