// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/controller_in_loop.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "core/types/angle.hpp"
#include "firmware_bridge/mavlink/frames.hpp"

namespace backwash::bench {
namespace {

constexpr long kSensorsEvery = 4, kStateEvery = 20, kGpsEvery = 200, kHeartbeatEvery = 1000;  // steps of 1 ms
constexpr std::uint8_t kArmed = 128, kQuadrotor = 2;
constexpr std::uint32_t kInertial = 0x3F, kMagnetic = 0x1C0, kBarometer = 0x1A00;  // of fields_updated
constexpr double kAccelNoise = 0.02, kGyroNoise = 0.001, kMagNoise = 0.001;        // m/s², rad/s, gauss
constexpr double kLatitude = 47.3977, kLongitude = 8.5456, kAltitude = 488;        // of the map's origin: Zurich
constexpr double kMetresPerDegree = 111'195;
const Vec3 kFieldNed(0.215, 0.010, 0.430);  // gauss, there

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::uint64_t microseconds(double t) { return static_cast<std::uint64_t>(t * 1e6); }

/// International standard atmosphere, hPa.
double pressure_at(double altitude) { return 1013.25 * std::pow(1 - 2.25577e-5 * altitude, 5.25588); }

std::int32_t degrees7(double degrees) { return static_cast<std::int32_t>(std::lround(degrees * 1e7)); }
std::int16_t centi(double v) { return static_cast<std::int16_t>(std::lround(std::clamp(v * 100, -32767.0, 32767.0))); }

}  // namespace

ControllerInLoop::ControllerInLoop(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& ground_W,
                                   std::uint64_t seed, const std::string& device)
    : Autopilot(grid, vehicle, ground_W, {}, seed, std::uint8_t{1}),
      airframe_(vehicle, ground_W),
      line_(device),
      random_(seed),
      listener_([this] { listen(); }) {}

ControllerInLoop::~ControllerInLoop() {
  ends_ = true;
  listener_.join();
}

void ControllerInLoop::listen() {
  mavlink::Parser parser;
  while (!ends_) {
    const auto bytes = line_.wait();
    const double t = now_s();
    parser.feed(bytes, [&](const mavlink::Frame& f) {
      if (f.id != mavlink::HilActuatorControls::kId) return;
      const auto m = mavlink::decode<mavlink::HilActuatorControls>(f.payload);
      const std::lock_guard lock(mutex_);
      said_armed_ = (m.mode & kArmed) != 0;
      std::copy_n(m.controls.begin(), rotors_.size(), rotors_.begin());
      if (unanswered_ && said_armed_) latencies_.push_back(t - *unanswered_);
      unanswered_.reset();
    });
  }
}

void ControllerInLoop::step(double t, std::vector<std::uint8_t>&) {
  Airframe::Rotors rotors{};
  {
    const std::lock_guard lock(mutex_);
    armed_ = said_armed_;
    if (armed_) rotors = rotors_;
  }
  const Vec3 gust = air_.step(truth().p_W, Airframe::kStep);
  airframe_.step(rotors, airframe_.on_ground() ? Vec3::Zero() : gust);
  if (!airframe_.on_ground()) landed_since_ = t;
  landed_ = t - landed_since_ > 0.2;
  if (steps_ % kSensorsEvery == 0) feel(t);
  if (steps_ % kStateEvery == 0) locate(t);
  std::vector<std::uint8_t> beat;
  if (steps_ % kHeartbeatEvery == 0) send(mavlink::Heartbeat{.type = kQuadrotor, .mavlink_version = 3}, beat);
  if (!beat.empty()) line_.write(beat);
  ++steps_;
}

// What its sensors feel, FRD.
void ControllerInLoop::feel(double t) {
  std::normal_distribution<double> normal;
  const auto noisy = [&](const Vec3& v, double sigma) -> Eigen::Vector3f {
    return (v + sigma * Vec3(normal(random_), normal(random_), normal(random_))).cast<float>();
  };
  const auto q_NF = mavlink::swap_ned_frd(attitude());
  const Eigen::Vector3f a = noisy(mavlink::swap_frd(airframe_.specific_force()), kAccelNoise);
  const Eigen::Vector3f w = noisy(mavlink::swap_frd(airframe_.rates()), kGyroNoise);
  const Eigen::Vector3f b = noisy(q_NF.conjugate() * kFieldNed, kMagNoise);
  const double altitude = kAltitude + truth().p_W.z();
  std::vector<std::uint8_t> out;
  send(mavlink::HilSensor{.time_usec = microseconds(t),
                          .xacc = a.x(),
                          .yacc = a.y(),
                          .zacc = a.z(),
                          .xgyro = w.x(),
                          .ygyro = w.y(),
                          .zgyro = w.z(),
                          .xmag = b.x(),
                          .ymag = b.y(),
                          .zmag = b.z(),
                          .abs_pressure = static_cast<float>(pressure_at(altitude)),
                          .pressure_alt = static_cast<float>(altitude),
                          .temperature = 20,
                          .fields_updated = kInertial | (steps_ % kStateEvery == 0 ? kMagnetic | kBarometer : 0)},
       out);
  {
    const std::lock_guard lock(mutex_);
    if (!unanswered_) unanswered_ = now_s();
  }
  line_.write(out);
}

// The truth, and a satellite receiver's.
void ControllerInLoop::locate(double t) {
  const Vec3 p = mavlink::swap_ned(truth().p_W), v = mavlink::swap_ned(truth().v_W);
  const auto q = mavlink::swap_ned_frd(attitude());
  const Vec3 w = mavlink::swap_frd(airframe_.rates());
  const std::int32_t lat = degrees7(kLatitude + p.x() / kMetresPerDegree);
  const std::int32_t lon = degrees7(kLongitude + p.y() / (kMetresPerDegree * std::cos(kLatitude * kDegree)));
  const auto alt = static_cast<std::int32_t>(std::lround(1000 * (kAltitude - p.z())));
  std::vector<std::uint8_t> out;
  send(mavlink::HilStateQuaternion{.time_usec = microseconds(t),
                                   .attitude_quaternion = {static_cast<float>(q.w()), static_cast<float>(q.x()),
                                                           static_cast<float>(q.y()), static_cast<float>(q.z())},
                                   .rollspeed = static_cast<float>(w.x()),
                                   .pitchspeed = static_cast<float>(w.y()),
                                   .yawspeed = static_cast<float>(w.z()),
                                   .lat = lat,
                                   .lon = lon,
                                   .alt = alt,
                                   .vx = centi(v.x()),
                                   .vy = centi(v.y()),
                                   .vz = centi(v.z())},
       out);
  if (steps_ % kGpsEvery == 0)
    send(mavlink::HilGps{.time_usec = microseconds(t),
                         .lat = lat,
                         .lon = lon,
                         .alt = alt,
                         .eph = 100,
                         .epv = 100,
                         .vel = static_cast<std::uint16_t>(centi(v.norm())),
                         .vn = centi(v.x()),
                         .ve = centi(v.y()),
                         .vd = centi(v.z()),
                         .cog = 65535,
                         .fix_type = 3,
                         .satellites_visible = 12},
         out);
  line_.write(out);
}

void ControllerInLoop::tell_latency() {
  const std::lock_guard lock(mutex_);
  std::ranges::sort(latencies_);
  const auto at = [&](double share) {
    const auto last = static_cast<double>(latencies_.size()) - 1;
    return last < 0 ? 0.0 : 1e3 * latencies_[static_cast<std::size_t>(share * last)];
  };
  std::printf("sensors to actuators: %zu, p50 %.2f ms, p99 %.2f ms, max %.2f ms\n", latencies_.size(), at(0.5),
              at(0.99), at(1));
}

}  // namespace backwash::bench
