// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/bench.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <iomanip>
#include <stdexcept>
#include <thread>

#include "core/map/distance_field.hpp"
#include "core/map/octomap_message.hpp"
#include "core/sim/vio.hpp"
#include "services/bench/firmware.hpp"
#include "services/bench/pty.hpp"
#include "services/bench/scans.hpp"
#include "services/dds/topics.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kOdometryEvery = 10;  // steps of 1 ms
constexpr int kMapEvery = 5000;     // steps, when the map has faults; otherwise it is sent once
constexpr int kPriority = 60;       // SCHED_FIFO
constexpr double kVioShare = 0.75;  // of the vehicle's estimation.position

volatile std::sig_atomic_t stopped = 0;

double seconds(Clock::time_point t) { return std::chrono::duration<double>(t.time_since_epoch()).count(); }

/// Centre of the vehicle when it stands below `p`.
Vec3 ground_below(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& p) {
  Index3 v = grid.index(p);
  if (!grid.free(v)) throw std::runtime_error("start is not in free space; choose a point above a floor");
  while (grid.free(v)) --v.z();
  if (!grid.occupied(v)) throw std::runtime_error("there is no known floor below start; choose a point above one");
  return {p.x(), p.y(), grid.center(v).z() + grid.resolution() / 2 + vehicle.body.radius};
}

dds::Octomap octomap(const map::OccupancyGrid& grid, std::vector<std::int8_t>& data) {
  static const std::string frame = "map", id = "OcTree";
  data = map::encode_octomap(grid);
  dds::Octomap m{};
  m.header.frame_id = dds::c_string(frame);
  m.binary = true;
  m.id = dds::c_string(id);
  m.resolution = grid.resolution();
  const auto size = static_cast<std::uint32_t>(data.size());
  m.data = {size, size, reinterpret_cast<decltype(m.data._buffer)>(data.data()), false};
  return m;
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

/// map <- odom, a translation.
dds::TransformStamped loop_closure(const Vec3& t_map_odom, double t) {
  static const std::string frame = "map", child = "odom";
  dds::TransformStamped m{};
  m.header = {stamp(t), dds::c_string(frame)};
  m.child_frame_id = dds::c_string(child);
  m.transform.translation = {t_map_odom.x(), t_map_odom.y(), t_map_odom.z()};
  m.transform.rotation = {0, 0, 0, 1};
  return m;
}

dds::Odometry odometry(const VioSample& sample, bool drifting) {
  const auto& [estimate, q, t] = sample;
  static const std::string map_frame = "map", odom_frame = "odom", child = "base_link";
  const std::string& frame = drifting ? odom_frame : map_frame;
  dds::Odometry m{};
  m.header.stamp = stamp(t);
  m.header.frame_id = dds::c_string(frame);
  m.child_frame_id = dds::c_string(child);
  m.pose.pose.position = {estimate.p_W.x(), estimate.p_W.y(), estimate.p_W.z()};
  m.pose.pose.orientation = {q.x(), q.y(), q.z(), q.w()};
  const Vec3 v_B = q.conjugate() * estimate.v_W;
  m.twist.twist.linear = {v_B.x(), v_B.y(), v_B.z()};
  return m;
}

/// The truth and the estimate, a row every 20 ms, with the flight log's column names.
class TruthLog {
 public:
  explicit TruthLog(const std::string& path) : file_(path) {
    if (!path.empty() && !file_) throw std::runtime_error(path + ": cannot be created");
    file_ << "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qw,qx,qy,qz,thrust,vio_x_m,vio_y_m,vio_z_m,"
             "armed,landed\n"
          << std::setprecision(15);
  }
  void row(double t, const Autopilot& a, const State& vio) {
    const auto vec = [&](const Vec3& v) { file_ << ',' << v.x() << ',' << v.y() << ',' << v.z(); };
    const auto q = a.attitude();
    file_ << t;
    vec(a.truth().p_W);
    vec(a.truth().v_W);
    vec(a.acceleration());
    file_ << ',' << q.w() << ',' << q.x() << ',' << q.y() << ',' << q.z() << ',' << a.thrust();
    vec(vio.p_W);
    file_ << ',' << a.armed() << ',' << a.landed() << '\n';
  }

 private:
  std::ofstream file_;
};

std::unique_ptr<Autopilot> make_autopilot(const Options& o, const map::OccupancyGrid& grid, const Vehicle& vehicle) {
  constexpr double kUptime = 60;  // s: it was switched on before the bench
  const Vec3 ground = ground_below(grid, vehicle, o.start);
  const Site site{
      .grid = grid, .vehicle = vehicle, .ground_W = ground, .frame = o.frame, .seed = o.seed, .uptime = kUptime};
  std::unique_ptr<Autopilot> autopilot;
  if (o.autopilot == "ardupilot") autopilot = make_arducopter(site);
  if (o.autopilot == "px4") autopilot = make_px4(site);
  if (!autopilot) autopilot = std::make_unique<Autopilot>(grid, vehicle, ground, o.frame, o.seed, std::uint8_t{1});
  const bool px4 = o.autopilot != "ardupilot";
  for (const auto& [name, value] :
       gain_parameters(px4 ? firmware_bridge::Autopilot::kPx4 : firmware_bridge::Autopilot::kArduPilot, vehicle))
    autopilot->parameters[name] = value;
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
    for (const auto& v : judge_.verdicts()) {
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

}  // namespace

int run(const Options& options, const map::OccupancyGrid& grid, const Vehicle& vehicle) {
  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  const auto made = make_autopilot(options, grid, vehicle);
  Autopilot& autopilot = *made;
  Faults faults(options.timeline, grid, vehicle, autopilot.truth().p_W.z());
  if (!options.wire.empty()) autopilot.log_wire(options.wire);
  TruthLog log(options.log);
  const sim::EmulatedVio vio(kVioShare * vehicle.estimation.position, options.seed + 1);
  // The bench stands in for hardware: where it may, it runs before everything but the daemon's own real-time threads.
  const int priority = allowed_fifo(kPriority);
  dds::Participant participant(static_cast<std::uint32_t>(options.domain), options.interface, {.priority = priority});
  if (priority > 0) set_fifo(priority);
  auto odometry_writer = dds::make_writer<dds::Odometry>(participant, options.name_space);
  auto map_writer = dds::make_writer<dds::Octomap>(participant, options.name_space);
  auto closure_writer = dds::make_writer<dds::TransformStamped>(participant, options.name_space);
  Scans scans(participant, options.name_space);
  if (options.drift) closure_writer.write(loop_closure(Vec3::Zero(), 0));
  bool closed = false, event = false;
  const map::OccupancyGrid known = options.hidden ? without(grid, *options.hidden) : grid;
  std::mt19937_64 noise(options.seed);
  const auto send_map = [&](std::optional<MapMessage> in, double t) {
    for (const MapMessage& m : faults.maps.pass(std::move(in), t)) {
      std::vector<std::int8_t> data;
      const dds::Octomap message = octomap(m.grid, data);
      if (m.garbage) std::ranges::generate(data, [&] { return static_cast<std::int8_t>(noise()); });
      map_writer.write(message);
    }
  };
  send_map(MapMessage{known}, options.timeline.after_arming ? -1 : 0);
  Pty pty(options.link);
  spdlog::info("bench runs: {} in {}, controller on {}", vehicle.name, options.map, options.link);

  const auto begun = Clock::now();
  auto due = begun;
  std::optional<double> armed_at;
  std::vector<std::uint8_t> out;
  for (long step = 0; !stopped && seconds(due) - seconds(begun) < options.duration_s; ++step) {
    due += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(due);
    const double t = seconds(due);
    const double timeline_t = !options.timeline.after_arming ? t - seconds(begun) : armed_at ? t - *armed_at : -1;
    for (const Bytes& bytes : faults.up.pass(some(pty.read()), timeline_t))
      autopilot.receive(bytes, seconds(Clock::now()));
    out.clear();
    autopilot.step(t, out);
    for (const Bytes& bytes : faults.down.pass(some(out), timeline_t)) pty.write(bytes);
    if (!armed_at && autopilot.armed()) armed_at = t;
    if (faults.spoils_map())
      send_map(step % kMapEvery == 0 ? std::optional(MapMessage{known}) : std::nullopt, timeline_t);
    if (step % 10 == 0) faults.watch(autopilot, timeline_t);
    const auto passed = [&](const std::optional<double>& s) { return s && armed_at && t - *armed_at > *s; };
    autopilot.mute = passed(options.stop_heartbeat_s);
    State estimate = vio.estimate(autopilot.truth(), t - seconds(begun));
    event = event || (autopilot.armed() && autopilot.truth().p_W.x() > options.event_x);
    if (options.drift) estimate.p_W -= *options.drift;
    if (options.drift && event && !closed) {
      closure_writer.write(loop_closure(*options.drift, t));
      closed = true;
    }
    const auto seen = [&](const std::vector<Vec3>& p) { scans.send(p, autopilot.truth(), autopilot.attitude(), t); };
    if (step % 100 == 0 && options.crate && event)
      seen(seen_of_crate(*options.crate, options.crate_edge, autopilot.truth().p_W));
    if (step % 250 == 0 && options.hidden && autopilot.armed()) seen(seen_of_room(grid, autopilot.truth().p_W));
    std::optional<VioSample> sample;
    if (step % kOdometryEvery == 0 && !passed(options.stop_odometry_s)) sample = {estimate, autopilot.attitude(), t};
    for (const VioSample& s : faults.odometry.pass(sample, timeline_t))
      odometry_writer.write(odometry(s, options.drift.has_value()));
    if (step % 20 == 0) log.row(t, autopilot, estimate);
  }
  spdlog::info("bench stopped: {}, {}, {} set-points received", autopilot.mode(),
               autopilot.landed() ? "on the ground" : "in the air", autopilot.setpoints());
  return faults.report() ? 0 : 1;
}

}  // namespace backwash::bench
