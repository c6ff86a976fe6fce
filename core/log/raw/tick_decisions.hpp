// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <iterator>
#include <tuple>
#include <type_traits>

#include "core/log/raw/air_log.hpp"
#include "core/log/raw/tick_log.hpp"

namespace backwash::log {

/// What a tick decided, and the state that it left.
struct Decided {
  const track::FlightTick& flight;
  const track::TickOutput& out;
};

/// What a tick's air was taken for.
struct Learnt {
  const adapt::InFlight& air;
  AirClass place;
};

/// What became of an order about it.
struct Ordered {
  const adapt::InFlight& air;
  bool done;
};

/// One decided member of a record: its name, and where it comes from. An array takes a container of its length.
template <typename Record, typename Member, typename Source>
struct Decision {
  const char* name;
  Member Record::*member;
  Source source;  ///< (what was decided) → what the member is set to

  template <typename From>
  void write(const From& decided, Record& record) const noexcept {
    auto& to = record.*member;
    const auto from = source(decided);
    if constexpr (std::is_array_v<Member>)
      std::copy_n(from.data(), std::size(to), to);
    else
      to = static_cast<Member>(from);
  }
};

// clang 14 does not deduce it from the aggregate's initializers.
template <typename Record, typename Member, typename Source>
Decision(const char*, Member Record::*, Source) -> Decision<Record, Member, Source>;

/// Bits of TickRecord::asked.
inline std::uint32_t asked(const track::TickOutput& out) noexcept {
  const auto bit = [](bool set, std::uint32_t flag) { return set ? flag : 0; };
  const auto& s = out.supervisor;
  return bit(s.send_setpoint, kAskedSetpoint) | bit(s.send_heartbeat, kAskedHeartbeat) |
         bit(out.forward_odometry, kAskedOdometry) | bit(s.request_offboard, kAskedOffboard) |
         bit(s.request_land, kAskedLand) | bit(out.arm, kAskedArm) | bit(out.disarm, kAskedDisarm) |
         bit(out.takeoff.has_value(), kAskedTakeoff);
}

/// Newest good odometry; zeros before the first.
inline State odometry(const Decided& d) noexcept { return d.flight.odometry() ? d.flight.odometry()->state : State{}; }

/// Every decided member: the one list that the record is written by and that a replay compares, and hashes, in order.
/// Times, counters and what was really sent are not in it.
inline constexpr auto kDecisions = std::tuple{
    Decision{"segment", &TickRecord::segment, [](const Decided& d) { return d.out.judged_segment; }},
    Decision{"index", &TickRecord::index, [](const Decided& d) { return d.out.judged_index; }},
    Decision{"mode", &TickRecord::mode, [](const Decided& d) { return d.out.supervisor.mode; }},
    Decision{"reason", &TickRecord::reason, [](const Decided& d) { return d.out.supervisor.reason; }},
    Decision{"judged", &TickRecord::judged, [](const Decided& d) { return d.out.inside.judged; }},
    Decision{"inside", &TickRecord::inside, [](const Decided& d) { return d.out.inside.inside; }},
    Decision{"frame_residual_m", &TickRecord::frame_residual_m,
             [](const Decided& d) { return d.flight.alignment().position_residual(); }},
    Decision{"frame_residual_rad", &TickRecord::frame_residual_rad,
             [](const Decided& d) { return d.flight.alignment().yaw_residual(); }},
    Decision{"cmd_yaw", &TickRecord::cmd_yaw, [](const Decided& d) { return d.out.command.yaw; }},
    Decision{"local_yaw", &TickRecord::local_yaw, [](const Decided& d) { return d.out.command_local.yaw; }},
    Decision{"asked", &TickRecord::asked, [](const Decided& d) { return asked(d.out); }},
    Decision{"p", &TickRecord::p, [](const Decided& d) { return odometry(d).p_W; }},
    Decision{"v", &TickRecord::v, [](const Decided& d) { return odometry(d).v_W; }},
    Decision{"cmd_p", &TickRecord::cmd_p, [](const Decided& d) { return d.out.command.p_W; }},
    Decision{"cmd_v", &TickRecord::cmd_v, [](const Decided& d) { return d.out.command.v_W; }},
    Decision{"cmd_a", &TickRecord::cmd_a, [](const Decided& d) { return d.out.command.a_W; }},
    Decision{"local_p", &TickRecord::local_p, [](const Decided& d) { return d.out.command_local.p_W; }},
    Decision{"local_v", &TickRecord::local_v, [](const Decided& d) { return d.out.command_local.v_W; }},
    Decision{"local_a", &TickRecord::local_a, [](const Decided& d) { return d.out.command_local.a_W; }},
    Decision{"center", &TickRecord::center, [](const Decided& d) { return d.out.inside.center; }},
    Decision{"half_widths", &TickRecord::half_widths, [](const Decided& d) { return d.out.inside.half_widths; }},
};

/// The same of the air: the factors, and the evidence of the class at the place.
inline constexpr auto kAirDecisions = std::tuple{
    Decision{"factors", &AirRecord::factors, [](const Learnt& l) { return l.air.factors(); }},
    Decision{"ln_evidence", &AirRecord::ln_evidence, [](const Learnt& l) { return l.air.ln_evidence(l.place); }},
    Decision{"ln_changed", &AirRecord::ln_changed, [](const Learnt& l) { return l.air.ln_changed(l.place); }},
    Decision{"seconds", &AirRecord::seconds, [](const Learnt& l) { return l.air.of(l.place).seconds(); }},
    Decision{"frozen", &AirRecord::frozen, [](const Learnt& l) { return l.air.frozen(); }},
};
inline constexpr auto kAirOrderDecisions = std::tuple{
    Decision{"done", &AirOrderRecord::done, [](const Ordered& o) { return o.done; }},
    Decision{"factors", &AirOrderRecord::factors, [](const Ordered& o) { return o.air.factors(); }},
};

/// Calls each(decision) for all of a list.
template <typename List, typename Each>
void each_decision(const List& list, const Each& each) {
  std::apply([&](const auto&... decision) { (each(decision), ...); }, list);
}

}  // namespace backwash::log
