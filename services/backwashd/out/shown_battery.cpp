// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_battery.hpp"

#include <chrono>
#include <limits>
#include <string>

namespace backwash::daemon {
namespace {

// Asked ten times a second, on a thread that wakes a little late or early.
constexpr auto kEvery = std::chrono::milliseconds(950);
constexpr float kNotSaid = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint8_t kUnknown = 0;  // of status, health and chemistry

float value(const std::optional<double>& said) { return said ? static_cast<float>(*said) : kNotSaid; }

}  // namespace

const dds::BatteryState* ShownBattery::next(const firmware_bridge::Latest<firmware_bridge::Battery>& said,
                                            firmware_bridge::Time now, std::int64_t wall_ns) {
  if (said ? said_ == said->at || (sent_ && now - *sent_ < kEvery) : !said_) return nullptr;
  said_ = said ? std::optional(said->at) : std::nullopt;
  sent_ = now;
  static const std::string nothing;
  char* const none = dds::c_string(nothing);
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const auto age = said ? now - said->at : firmware_bridge::Time::duration::zero();
  const std::int64_t at_ns = wall_ns - std::chrono::duration_cast<std::chrono::nanoseconds>(age).count();
  const auto [voltage, remaining, current] = said ? said->value : firmware_bridge::Battery{};
  message_ = {};
  message_.header.stamp = {static_cast<std::int32_t>(at_ns / kSecond_ns),
                           static_cast<std::uint32_t>(at_ns % kSecond_ns)};
  message_.header.frame_id = none;
  message_.voltage = value(voltage);
  message_.temperature = kNotSaid;
  message_.current = current ? static_cast<float>(-*current) : kNotSaid;  // ROS 2: below 0 while it is discharged
  message_.charge = message_.capacity = message_.design_capacity = kNotSaid;
  message_.percentage = value(remaining);
  message_.power_supply_status = message_.power_supply_health = message_.power_supply_technology = kUnknown;
  message_.present = true;
  message_.location = message_.serial_number = none;
  return &message_;
}

}  // namespace backwash::daemon
