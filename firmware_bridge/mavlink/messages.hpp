// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "firmware_bridge/mavlink/hardware_in_loop.hpp"
#include "firmware_bridge/mavlink/requests.hpp"
#include "firmware_bridge/mavlink/sensors.hpp"
#include "firmware_bridge/mavlink/telemetry.hpp"

namespace backwash::mavlink {

/// A list of message types.
template <class... Messages>
struct MessageList {};

/// Every message that this codec knows, by id.
using KnownMessages =
    MessageList<Heartbeat, SysStatus, SystemTime, SetMode, ParamRequestRead, ParamValue, ParamSet, ParamError, RawImu,
                Attitude, AttitudeQuaternion, LocalPositionNed, ManualControl, CommandLong, CommandAck,
                SetPositionTargetLocalNed, PositionTargetLocalNed, SetGpsGlobalOrigin, GpsGlobalOrigin, SimState,
                HilActuatorControls, VisionPositionEstimate, HighresImu, HilSensor, HilGps, Timesync,
                HilStateQuaternion, ScaledImu2, BatteryStatus, EstimatorStatus, EkfStatusReport, AutopilotVersion,
                ExtendedSysState, Statustext, ObstacleDistance, Odometry>;

/// MessageInfo of an id, or null when the message is unknown. Real-time: wait-free, no allocation.
const MessageInfo* find_message(std::uint32_t id) noexcept;

namespace detail {
template <class Visitor, class... Messages>
bool decode_and_visit(std::uint32_t id, std::span<const std::uint8_t> payload, Visitor& visitor,
                      MessageList<Messages...>) {
  return ((id == Messages::kId && (visitor(decode<Messages>(payload)), true)) || ...);
}
}  // namespace detail

/// Decodes the payload as the message with this id and calls visitor(message); false when the id is unknown.
/// Real-time when the visitor is.
template <class Visitor>
bool decode_and_visit(std::uint32_t id, std::span<const std::uint8_t> payload, Visitor&& visitor) {
  return detail::decode_and_visit(id, payload, visitor, KnownMessages{});
}

}  // namespace backwash::mavlink
