// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/gates.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

namespace backwash::study {
namespace {

/// Whether every rotor is told to stand still in some row: on the ground, or about to leave it.
bool rotors_rest(const Series& s, const log::FlightLog& log, Stretch w) {
  const auto [begin, end] = w;
  constexpr double kIdle = 0.05;  // of the full command
  std::array<const std::vector<double>*, 4> motors{};
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    const std::string name = "motor" + std::to_string(rotor + 1);
    if (!log.has(name)) return false;
    motors[rotor] = &log.column(name);
  }
  for (std::size_t i = begin; i < end; ++i)
    if (std::all_of(motors.begin(), motors.end(), [&](auto* m) { return (*m)[s.row[i]] <= kIdle; })) return true;
  return false;
}

/// Whether it stands on, or may touch, what it stood on at first (recordings that say where that is).
bool touches(const Series& s, const log::FlightLog& log, Stretch w) {
  const auto [begin, end] = w;
  constexpr double kClear = 0.005;  // m
  if (!log.has("stood_z_m")) return false;
  double height = 0;
  for (std::size_t i = begin; i < end; ++i)
    height += (s.p[i].z() - log.column("stood_z_m")[s.row[i]]) / static_cast<double>(w.size());
  return height < kClear;
}

}  // namespace

bool under_way(const Series& s, Stretch w) {
  const auto [begin, end] = w;
  constexpr double kStill = 0.12, kOver = 0.5;  // m/s, s: as hovers are found for calibration (WindowOptions)
  for (std::size_t a = begin, b = begin; b < end; ++b) {
    while (s.t[b] - s.t[a] > kOver) ++a;
    if (s.t[b] - s.t[a] > 0.8 * kOver && (s.p[b] - s.p[a]).norm() > kStill * (s.t[b] - s.t[a])) return true;
  }
  return false;
}

bool simulated(const Series& s) { return s.simulated_by_thrust || !s.a_nominal.empty(); }

const char* to_string(Gate gate) noexcept {
  constexpr const char* kNames[] = {"frozen", "perched", "saturated", "transit", "gap", "inconsistent", "outside"};
  return kNames[static_cast<std::size_t>(gate)];
}

bool ByName::operator()(Gate a, Gate b) const noexcept { return std::strcmp(to_string(a), to_string(b)) < 0; }

std::optional<Gate> gate(const Series& s, const log::FlightLog& log, Stretch w) {
  const auto [begin, end] = w;
  std::size_t repeated = 0, full = 0;
  for (std::size_t i = begin + 1; i < end; ++i)
    repeated += s.p[i] == s.p[i - 1] && s.a[i] == s.a[i - 1] && s.v[i] == s.v[i - 1] ? 1u : 0u;
  if (20 * repeated > w.size()) return Gate::frozen;
  Vec3 low = s.p[begin], high = low;
  double thrust = 0;
  for (std::size_t i = begin; i < end; ++i) {
    low = low.cwiseMin(s.p[i]), high = high.cwiseMax(s.p[i]);
    if (!s.thrust_acc.empty()) thrust += s.thrust_acc[i] / static_cast<double>(w.size());
  }
  if ((high - low).maxCoeff() < 5e-4 || (!s.thrust_acc.empty() && thrust < 0.6 * kGravity)) return Gate::perched;
  if (rotors_rest(s, log, w) || touches(s, log, w)) return Gate::perched;
  if (!simulated(s) && !log.has("motor1") && under_way(s, w)) return Gate::transit;
  if (log.has("thrust"))
    for (std::size_t i = begin; i < end; ++i) full += log.column("thrust")[i] >= 0.99 ? 1u : 0u;
  if (50 * full > w.size()) return Gate::saturated;
  if (s.has_velocity) {  // position and velocity must tell the same story
    const double time = s.t[end - 1] - s.t[begin];
    Vec3 flown = Vec3::Zero();
    for (std::size_t i = begin + 1; i < end; ++i) flown += 0.5 * (s.v[i] + s.v[i - 1]) * (s.t[i] - s.t[i - 1]);
    if (((s.p[end - 1] - s.p[begin] - flown) / time).norm() > 0.15) return Gate::inconsistent;
  }
  return std::nullopt;
}

}  // namespace backwash::study
