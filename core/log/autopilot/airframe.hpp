// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/log/mcap/topic_log.hpp"

namespace backwash::log {

/// What an autopilot's log says it flew, of PX4's vehicle_status, MAV_TYPE and CA_ parameters, or ArduPilot's name,
/// FRAME_CLASS and frame. What no source says is taken for a quadrotor.
struct Airframe {
  std::string other = {};  ///< what it is where it is no multicopter, and who says so; empty: it is one
  int rotors = 4;
};

Airframe airframe_of(const TopicLog& topics);

}  // namespace backwash::log
