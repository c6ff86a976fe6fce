// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/study/windows/gates/gates.hpp"
#include "core/study/windows/signals/gust_spectrum.hpp"
#include "core/types/geometry.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::study {

/// What stands for the disturbance w (docs/model.md section 3).
enum class Signal {
  commanded,  ///< w = a − what the rotors were told to give: set-points in the log, gains in the vehicle file
  divided,    ///< raw acceleration; the closed loop's attenuation divided out of the variance
  raw,        ///< raw acceleration as it is: no vehicle known, so no attenuation either
};
const char* to_string(Signal signal) noexcept;

/// The disturbance during one stretch of hover. Vectors hold one number per axis of W.
struct Window {
  double t_s;                                  ///< of its first row
  int segment;                                 ///< hover position: the log's column, or numbered from 0 as found
  Vec3 p_W;                                    ///< mean position, m
  std::optional<Eigen::Quaterniond> attitude;  ///< mean, body to world; nothing without qw … qz
  double speed_mps;                            ///< root mean square of the velocity
  Vec3 mean;                                   ///< of the disturbance, m/s²
  Vec3 variance;        ///< of the disturbance within the band, (m/s²)²; mean square of the filtered signal
  std::size_t stretch;  ///< of FlightWindows::gusts, the unbroken one that it belongs to
};

/// How calibration cuts a log; all else is kWindowRules'.
struct WindowOptions {
  double length_s = kWindowRules.window_length;  ///< of a window
  double tau_w = kWindowRules.tau_w;             ///< s, assumed when an attenuation is divided out
  double still_mps = kWindowRules.still_speed;   ///< a hover is slower, averaged over kWindowRules.still_time
};

/// A flight, cut into windows.
struct FlightWindows {
  Signal signal = Signal::raw;
  Band band;                                     ///< that the log's rate allows
  double rate_hz{};                              ///< mean rate of the rows
  std::optional<loop::PositionLoop> loop;        ///< that was divided out; none for Signal::commanded and raw
  Vec3 attenuation;                              ///< its var(a)/var(w) per axis; 1 without
  std::array<std::size_t, kHoverGates> gated{};  ///< windows left out, by Gate
  std::vector<std::string> not_tested;           ///< gates without the columns they need, and which those are
  std::vector<Window> windows;
  std::vector<GustFits> gusts;  ///< of each unbroken stretch of windows
  /// The shape that is likeliest over all stretches.
  GustShape gust_shape() const;
  /// Correlation time of the gusts in a window's stretch, by the flight's shape, s; > 0.
  double tau_w(const Window& window) const;
};

/// Cuts a flight into gated windows (docs/model.md section 3). Needs x_m y_m z_m and ax_mps2 ay_mps2 az_mps2.
///
///   w = a − r,  lag·ṙ = u − r,  u = a_cmd(t − latency) + k_p (p_cmd(t − latency) − p(t − delay)) + k_d (v_cmd … − v …)
///
/// with lag, latency and feedback delay of the vehicle file; all zero, this is w = a + k_p e + k_d ė − a_cmd. Rows are
/// brought to even spacing by linear interpolation between gaps. Segments come from the column `segment`, else from the
/// speed of the command (with set-points) or of the vehicle. Windows touch neither each other nor a gated row; filters
/// run over unbroken stretches of good windows alone. A gated window counts once, by the first of LogGates that holds.
/// `path` names the log in errors: bad_data, with the column that is missing, time that does not rise, or a log shorter
/// than a window. O(rows).
tl::expected<FlightWindows, log::LogError> flight_windows(const log::FlightLog& log,
                                                          const std::optional<Vehicle>& vehicle,
                                                          const WindowOptions& options, const std::string& path);

}  // namespace backwash::study
