// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/adapt/adaptation.hpp"
#include "core/adapt/disturbance.hpp"

namespace backwash::adapt {

/// What the updates of a flight depend on beside its ticks.
struct InFlightConstants {
  decltype(Vehicle::controller) controller{};
  Gusts gusts;                      ///< the noise is measured in flight
  double alpha = kAlpha;            ///< in (0, 1)
  AirFactors start = kModelledAir;  ///< what earlier flights have learnt, each ≥ 1
  double calmest = 1;               ///< factors fall so far at most, in (0, 1]; 1: none falls below 1
};

/// What one tick adds: the newest good odometry, the set-point of the tick that took it, and the model at its place.
struct AirTick {
  std::int64_t stamp_ns = 0;  ///< of the odometry
  std::uint64_t frame = 0;    ///< another one: state and set-point are of a frame that moved meanwhile
  State state;
  Setpoint command;
  Vec3 sigma = Vec3::Zero();  ///< modelled variance along x, y, z of W, (m/s²)²; 0: the map has none there
  AirClass air = AirClass::none;
  bool rests = false;  ///< at the end of a verified way or stop, and measured to be at rest: sets may shrink
};

/// What an operator asks of what a flight learns.
enum class AirOrder : std::uint32_t {
  reset,   ///< as modelled, as if nothing had been flown: the one thing that lets a factor fall
  freeze,  ///< the factors stay as they are; evidence goes on being counted
  thaw     ///< they follow the evidence again, at once that of meanwhile
};
inline constexpr std::uint32_t kAirOrders = 3;

/// Adaptation in flight: acceleration by differences of the velocity, and its noise as the flight shows it, half the
/// mean square of the steps of the disturbance so far: three times the noise of a velocity over dt², which covers what
/// neighbouring groups share. Factors above 1 never fall, but by an order. A named class that is shown to be calmer
/// than modelled gets a factor below 1 in a tick at rest, and 1 again as soon as it is shown to be rougher than that.
/// Of two with equal ticks and orders every number is equal, bit for bit.
class InFlight {
 public:
  static constexpr int kLeastSteps = 50;  ///< of which the noise is measured before anything is bet

  explicit InFlight(const InFlightConstants& constants);

  /// One tick; whether a factor changed. A stamp that does not rise, a gap and a frame that moved let it begin anew;
  /// what has been learnt stays. Real-time: wait-free, no allocation.
  bool add(const AirTick& tick) noexcept;

  /// Does what is asked; whether a factor changed. Whoever asks sees to it that nothing flies on sets that shrink.
  /// Real-time: wait-free, no allocation.
  bool carry_out(AirOrder order) noexcept;
  bool frozen() const noexcept { return frozen_; }
  /// The flight has ended: the next one begins with no calmer air than the model's, and shows it anew; whether a factor
  /// changed. Nothing happens without a tick since the last one ended. Real-time: wait-free, no allocation.
  bool end() noexcept;

  /// ≥ calmest; ≥ what it began with until a reset.
  const AirFactors& factors() const noexcept { return factors_; }
  const Bets& of(AirClass air) const noexcept { return adaptation_.of(air); }
  std::uint64_t refused() const noexcept { return adaptation_.refused(); }  ///< samples

 private:
  std::optional<Vec3> acceleration(const AirTick& tick) noexcept;
  std::optional<Vec3> noise(const Vec3& w_W) noexcept;
  void grow() noexcept;
  void judge_calm() noexcept;
  void settle() noexcept;
  void combine() noexcept;
  void forget() noexcept;

  Disturbance disturbance_;
  Adaptation adaptation_;
  double calmest_;
  AirFactors grown_, calm_ = kModelledAir;  // ≥ 1 and never falling; ≤ 1
  AirFactors shown_ = kModelledAir;         // ≤ calm_, and watched: what calm_ becomes at rest
  AirFactors factors_;
  bool frozen_ = false;
  std::optional<AirTick> last_;
  double t_s_ = 0;               // rises, whatever the stamps do
  std::optional<Vec3> last_w_;   // of the tick before
  Vec3 squares_ = Vec3::Zero();  // of the steps of w
  int steps_ = 0;
};

}  // namespace backwash::adapt
