// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/bench.hpp"

#include <spdlog/spdlog.h>

#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <iomanip>
#include <stdexcept>
#include <thread>

#include "core/map/octomap_message.hpp"
#include "core/sim/vio.hpp"
#include "services/bench/pty.hpp"
#include "services/bench/scans.hpp"
#include "services/dds/topics.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kOdometryEvery = 10;  // steps of 1 ms
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

dds::Odometry odometry(const State& estimate, const Eigen::Quaterniond& q, double t, bool drifting) {
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

}  // namespace

int run(const Options& options, const map::OccupancyGrid& grid, const Vehicle& vehicle) {
  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  Autopilot autopilot(grid, vehicle, ground_below(grid, vehicle, options.start), options.frame, options.seed, 1);
  for (const auto& [name, value] : options.parameters) autopilot.parameters[name] = value;
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
  std::vector<std::int8_t> map_data;
  map_writer.write(octomap(options.hidden ? without(grid, *options.hidden) : grid, map_data));
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
    autopilot.receive(pty.read(), seconds(Clock::now()));
    out.clear();
    autopilot.step(t, out);
    pty.write(out);
    if (!armed_at && autopilot.armed()) armed_at = t;
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
    if (step % kOdometryEvery == 0 && !passed(options.stop_odometry_s))
      odometry_writer.write(odometry(estimate, autopilot.attitude(), t, options.drift.has_value()));
    if (step % 20 == 0) log.row(t, autopilot, estimate);
  }
  spdlog::info("bench stopped: {}, {}, {} set-points received", autopilot.mode(),
               autopilot.landed() ? "on the ground" : "in the air", autopilot.setpoints());
  return 0;
}

}  // namespace backwash::bench
