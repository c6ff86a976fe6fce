// SPDX-License-Identifier: BSD-3-Clause
// The VIO and the mapper beside a real autopilot in its simulator: the simulator's truth, placed in a map, becomes
// odometry with noise on DDS; the map is published; the truth is logged and held against the map.
// Faults come as lines of standard input: stop, go, freeze, jump X Y Z (m), turn YAW (rad), drift X Y Z (m/s). So does
// what the map does not have: crate X Y Z EDGE (m), scanned at 10 Hz from then on.
#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <random>
#include <sstream>
#include <thread>

#include "core/config/config.hpp"
#include "core/map/distance_field.hpp"
#include "core/map/load_map.hpp"
#include "services/backwashd/channels.hpp"
#include "services/bench/messages.hpp"
#include "services/bench/scans.hpp"
#include "services/command_line/command_line.hpp"
#include "services/dds/topics.hpp"
#include "services/parallel/real_time.hpp"
#include "tests/autopilots/truth.hpp"

namespace backwash::autopilots {
namespace {

volatile std::sig_atomic_t stopped = 0;
const std::string kMap = "map";
constexpr std::int64_t kHalfTruthStep_ns = 5'000'000, kScanPeriod_ns = 100'000'000;

struct Options {
  std::string truth, map, vehicle, log, security;
  std::vector<double> start;  // the vehicle's centre as it stands, m
  double yaw = 0;             // map <- east, north, up
  double noise = 0.001;       // m
  double rate = 0;            // of the odometry, Hz; 0: each sample of the truth
  int domain = 0;
};

/// What the VIO does wrong.
struct Fault {
  bool stopped = false;
  Vec3 jump = Vec3::Zero();  // map frame
  double turn = 0;           // about the place where it began
  Vec3 pivot = Vec3::Zero();
  Vec3 drift = Vec3::Zero();  // m/s, of the pose alone
  std::int64_t drifts_from_ns = 0;
  std::optional<Truth> frozen;
};

/// A cube that the map does not have.
struct Crate {
  Vec3 center_W;
  double edge = 0;  // m
  double distance(const Vec3& p_W) const {
    return ((p_W - center_W).cwiseAbs().array() - edge / 2).max(0).matrix().norm();
  }
};

struct Pose {
  Vec3 p, v;
  Eigen::Quaterniond q;
};

class Vio {
 public:
  explicit Vio(const Options& o)
      : o_(o),
        grid_(loaded(o.map)),
        distance_(grid_),
        vehicle_(config::load_vehicle(o.vehicle).value()),
        start_(o.start[0], o.start[1], o.start[2]),
        R_(Eigen::AngleAxisd(o.yaw, Vec3::UnitZ())),
        participant_(static_cast<std::uint32_t>(o.domain), "lo", {.priority = allowed_fifo(60)}, o.security),
        odometry_(dds::make_writer<dds::Odometry>(participant_, "backwash")),
        map_(dds::make_writer<dds::Octomap>(participant_, "backwash")),
        log_(o.log),
        truth_(truth_source(o.truth)) {
    log_ << "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qw,qx,qy,qz\n" << std::setprecision(15);
  }

  void run() {
    ::fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    while (!stopped) {
      std::this_thread::sleep_for(std::chrono::microseconds(500));
      listen();
      if (const auto truth = newest()) take(*truth);
    }
    std::cout << "closest " << closest_ << " m at " << closest_at_.transpose() << ", contacts " << contacts_
              << ", samples " << samples_ << std::endl;
  }

 private:
  static map::OccupancyGrid loaded(const std::string& name) {
    auto grid = map::load_map(name);
    if (!grid) throw std::runtime_error(grid.error().message);
    return std::move(*grid);
  }
  void publish_map() { map_.write(bench::octomap(grid_, map_data_, kMap)); }

  /// A simulator that has gone may come back with its autopilot, its vehicle where it first stood.
  std::optional<Truth> newest() {
    try {
      if (!truth_) truth_ = truth_source(o_.truth);
      return truth_->newest();
    } catch (const std::runtime_error&) {
      truth_.reset();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      return std::nullopt;
    }
  }

  Pose in_map(const Truth& t) const { return {start_ + R_ * t.p_E, R_ * t.v_E, R_ * t.q_EB}; }

  void listen() {
    std::array<char, 512> bytes;
    for (ssize_t n; (n = ::read(STDIN_FILENO, bytes.data(), bytes.size())) > 0;)
      heard_.append(bytes.data(), static_cast<std::size_t>(n));
    for (std::size_t end; (end = heard_.find('\n')) != heard_.npos; heard_.erase(0, end + 1)) {
      std::istringstream in(heard_.substr(0, end));
      std::string verb;
      in >> verb;
      if (verb == "stop") fault_.stopped = true;
      if (verb == "go") fault_ = {};
      if (verb == "freeze") fault_.frozen = last_;
      if (verb == "jump") in >> fault_.jump.x() >> fault_.jump.y() >> fault_.jump.z();
      if (verb == "drift")
        in >> fault_.drift.x() >> fault_.drift.y() >> fault_.drift.z(), fault_.drifts_from_ns = last_.at_ns;
      if (verb == "turn") in >> fault_.turn, fault_.pivot = in_map(last_).p;
      if (Crate c; verb == "crate" && in >> c.center_W.x() >> c.center_W.y() >> c.center_W.z() >> c.edge) crate_ = c;
      std::cout << "fault " << verb << " at " << last_.at_ns << std::endl;
    }
  }

  void take(const Truth& t) {
    const Pose p = in_map(t);
    const double dt = static_cast<double>(t.at_ns - last_.at_ns) * 1e-9;
    const Vec3 a = samples_ > 0 && dt > 0 ? Vec3(R_ * (t.v_E - last_.v_E) / dt) : Vec3::Zero();
    last_ = t;
    if (++samples_ == 1) publish_map();  // a mapper knows where it is
    judge(p);
    if (crate_ && t.at_ns >= scan_ns_) {
      scan_ns_ = t.at_ns + kScanPeriod_ns;
      scans_.send(bench::seen_of_crate(crate_->center_W, crate_->edge, p.p), {.p_W = p.p}, p.q,
                  static_cast<double>(t.at_ns) * 1e-9);
    }
    log_ << static_cast<double>(t.at_ns) * 1e-9;
    for (const Vec3& v : {p.p, p.v, a}) log_ << ',' << v.x() << ',' << v.y() << ',' << v.z();
    log_ << ',' << p.q.w() << ',' << p.q.x() << ',' << p.q.y() << ',' << p.q.z() << '\n';
    if (!fault_.stopped && due(t.at_ns)) send(in_map(fault_.frozen ? *fault_.frozen : t), t.at_ns);
  }

  /// The sample nearest to each whole period of o_.rate; the truth comes at about 100 Hz.
  bool due(std::int64_t at_ns) {
    if (o_.rate <= 0) return true;
    if (at_ns < due_ns_ - kHalfTruthStep_ns) return false;
    const auto period = static_cast<std::int64_t>(1e9 / o_.rate);
    due_ns_ = std::max(due_ns_ + period, at_ns + period / 2);
    return true;
  }

  /// The vehicle's ball against the map; the floor that it stands on is no obstacle below half its radius above.
  void judge(const Pose& p) {
    if (p.p.z() < start_.z() + 0.5 * vehicle_.body.radius) return;
    double nearest = distance_.exact(grid_, p.p);
    if (crate_) nearest = std::min(nearest, crate_->distance(p.p));
    const double clearance = nearest - vehicle_.body.radius;
    if (clearance < closest_) {
      closest_ = clearance;
      closest_at_ = p.p;
    }
    const bool contact = clearance < 0;
    contacts_ += contact && !touching_;
    touching_ = contact;
  }

  void send(Pose p, std::int64_t at_ns) {
    static const std::string frame = "map", child = "base_link";
    std::normal_distribution<double> normal(0, o_.noise);
    const auto noise = [&] { return Vec3(normal(random_), normal(random_), normal(random_)); };
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(fault_.turn, Vec3::UnitZ()));
    const Vec3 drifted = static_cast<double>(at_ns - fault_.drifts_from_ns) * 1e-9 * fault_.drift;
    p = {fault_.pivot + turn * (p.p - fault_.pivot) + fault_.jump + drifted + noise(), turn * p.v + 5 * noise(),
         turn * p.q};
    dds::Odometry m{};
    m.header.stamp = bench::stamp(static_cast<double>(at_ns) * 1e-9);
    m.header.frame_id = dds::c_string(frame);
    m.child_frame_id = dds::c_string(child);
    m.pose.pose.position = {p.p.x(), p.p.y(), p.p.z()};
    m.pose.pose.orientation = {p.q.x(), p.q.y(), p.q.z(), p.q.w()};
    const Vec3 v_B = p.q.conjugate() * p.v;
    m.twist.twist.linear = {v_B.x(), v_B.y(), v_B.z()};
    for (std::size_t i = 0; i < 6; ++i) {
      m.pose.covariance[7 * i] = i < 3 ? o_.noise * o_.noise : 1e-6;
      m.twist.covariance[7 * i] = i < 3 ? 25 * o_.noise * o_.noise : 1e-4;
    }
    odometry_.write(m);
  }

  Options o_;
  map::OccupancyGrid grid_;
  map::DistanceField distance_;
  Vehicle vehicle_;
  Vec3 start_;
  Eigen::Quaterniond R_;  // map <- E
  dds::Participant participant_;
  dds::Writer<dds::Odometry> odometry_;
  dds::Writer<dds::Octomap> map_;
  bench::Scans scans_{participant_, "backwash"};
  std::vector<std::int8_t> map_data_;
  std::ofstream log_;
  std::unique_ptr<TruthSource> truth_;
  std::string heard_;
  Fault fault_;
  std::optional<Crate> crate_;
  std::int64_t scan_ns_ = 0;  // of the next scan of it
  Truth last_;
  std::int64_t due_ns_ = 0;  // of the next odometry
  long samples_ = 0, contacts_ = 0;
  bool touching_ = false;
  double closest_ = 1e9;
  Vec3 closest_at_ = Vec3::Zero();
  std::mt19937 random_{2};
};

}  // namespace
}  // namespace backwash::autopilots

int main(int argc, char** argv) {
  backwash::autopilots::Options o;
  backwash::services::Command app{"autopilot_vio: VIO and mapper beside a real autopilot in its simulator",
                                  "autopilot_vio"};
  app.add_option("--truth", o.truth, "see truth.hpp").required();
  app.add_option("--map", o.map).required();
  app.add_option("--vehicle", o.vehicle).required();
  app.add_option("--start", o.start, "x,y,z of the vehicle's centre as it stands, m")
      .required()
      .delimiter(',')
      .expected(3);
  app.add_option("--yaw", o.yaw, "of the map against east, rad");
  app.add_option("--noise", o.noise, "of the position, m");
  app.add_option("--rate", o.rate, "of the odometry, Hz; default: as the truth comes");
  app.add_option("--domain", o.domain).required();
  app.add_option("--log", o.log, "the truth, CSV").required();
  app.add_option("--security", o.security, "folder of the VIO's credentials, if the daemon has dds.security");
  if (const auto code = app.parse(argc, argv)) return *code;
  std::signal(SIGTERM, [](int) { backwash::autopilots::stopped = 1; });
  std::signal(SIGINT, [](int) { backwash::autopilots::stopped = 1; });
  try {
    backwash::autopilots::Vio vio(o);
    backwash::set_fifo(backwash::allowed_fifo(60));
    vio.run();
    return 0;
  } catch (const std::exception& e) {
    std::cerr << "autopilot_vio: " << e.what() << "\n";
    return 70;
  }
}
