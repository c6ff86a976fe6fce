// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "firmware_bridge/port/port.hpp"
#include "services/bench/emulation/airframe.hpp"
#include "services/bench/emulation/autopilot.hpp"

namespace backwash::bench {

/// Line to a controller that is simulated for: `tcpin:ADDRESS:PORT` is listened on (PX4's simulator_mavlink connects to
/// 4560), anything else is a serial port at 921,600 baud (PX4's HITL). Throws StartError.
class SimulationLine {
 public:
  explicit SimulationLine(const std::string& device);
  /// Bytes that arrived within 100 ms; none: nothing, or nobody is connected. Takes a new connection when one is lost.
  std::vector<std::uint8_t> wait();
  void write(std::span<const std::uint8_t> bytes);

 private:
  firmware_bridge::FileDescriptor listener_, line_;
  std::mutex mutex_;  // of line_, which wait() replaces
};

/// A real flight controller in the loop: it is sent what its sensors would feel in the airflow truth (HIL_SENSOR at
/// 250 Hz, HIL_GPS at 5, HIL_STATE_QUATERNION at 50), and its HIL_ACTUATOR_CONTROLS turn the rotors of an Airframe. It
/// speaks to the daemon on a line of its own, in which this class has no part.
class ControllerInLoop : public Autopilot {
 public:
  ControllerInLoop(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& ground_W, std::uint64_t seed,
                   const std::string& device);
  ~ControllerInLoop() override;

  void step(double t, std::vector<std::uint8_t>& out) override;
  const State& truth() const noexcept override { return airframe_.state(); }
  Eigen::Quaterniond attitude() const override { return airframe_.attitude(); }
  const Vec3& acceleration() const noexcept override { return airframe_.acceleration(); }
  double thrust() const noexcept override { return airframe_.thrust(); }
  const char* mode() const noexcept override { return "in the loop"; }
  /// Prints how long it took while armed from a HIL_SENSOR, the first that was not answered yet, to the
  /// HIL_ACTUATOR_CONTROLS that came next: an upper bound where one answers for two.
  void tell_latency();

 private:
  void listen();
  void feel(double t);
  void locate(double t);

  Airframe airframe_;
  SimulationLine line_;
  std::mt19937_64 random_;
  std::mutex mutex_;  // of what follows
  Airframe::Rotors rotors_{};
  bool said_armed_ = false;
  std::optional<double> unanswered_;  // when the HIL_SENSOR was sent, s
  std::vector<double> latencies_;
  std::atomic<bool> ends_{false};
  std::thread listener_;
};

}  // namespace backwash::bench
