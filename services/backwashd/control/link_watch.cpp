// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/control/link_watch.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/mavlink/messages.hpp"
#include "services/backwashd/channels.hpp"

namespace backwash::daemon {
namespace {

using namespace firmware_bridge;

void tell(const ControlEvent& event, const ServiceManager& manager) {
  switch (event.kind) {
    case ControlEvent::Kind::transition:
      if (!manager.transition(to_string(event.mode), to_string(event.reason)))
        spdlog::info("{}: {}", to_string(event.mode), to_string(event.reason));
      return;
    case ControlEvent::Kind::missed_deadline:
      return spdlog::warn("control deadline missed: {} periods skipped", event.count);
    case ControlEvent::Kind::page_fault:
      return spdlog::warn("{} page faults in a control tick", event.count);
    case ControlEvent::Kind::calmer:
      if (event.factor >= 1)
        return spdlog::info(
            "errors in air of class {}: what the flight showed ends with it; a factor of {:.2f} is kept",
            to_string(event.air), event.factor);
      return spdlog::info("errors in air of class {} have below {:.2f} times the variance promised; sets shrink",
                          to_string(event.air), event.factor);
    case ControlEvent::Kind::rougher:
      if (!(event.factor > 1))
        return spdlog::info("air of class {} is no longer as calm as shown: its sets are the model's again",
                            to_string(event.air));
      return spdlog::warn("errors in air of class {} have {}{:.2f} times the variance promised, ln evidence {:.1f}; {}",
                          to_string(event.air), event.factor >= adapt::Bets::kRougher.back() ? "at least " : "above ",
                          event.factor, event.ln_evidence, adapt::explained(event.cause));
    case ControlEvent::Kind::battery_silent:
      return spdlog::warn("the autopilot does not say any more what is left in its battery: no LAND will come of it");
    case ControlEvent::Kind::air_kept:
      return spdlog::warn("the factors of the air were not reset: the vehicle was armed meanwhile");
  }
}

/// kLongestOdometryTicks, or fewer of odometry below 20 Hz: what its own interval leaves of PX4's 200 ms.
int longest_odometry_ticks(const OdometryTiming& timing) {
  constexpr double kMaxInterval = 0.2, kRounding = 1e-9;  // s, periods
  if (timing.longer_gap() == 0) return kLongestOdometryTicks;
  const double left = (kMaxInterval - 1 / timing.rate_least) / kControlPeriod + kRounding;
  return std::clamp(static_cast<int>(left), 1, kLongestOdometryTicks);
}

/// Bytes per second beyond least_rate() of an ODOMETRY every so many ticks.
double more_odometry(const LineRate& line, const decltype(config::Daemon::link)& link, int ticks) {
  const std::size_t around = mavlink::kHeaderV2 + mavlink::kChecksum + (link.signing_key ? mavlink::kSignature : 0);
  const std::size_t bytes = line.frame > 0 ? line.frame : mavlink::info<mavlink::Odometry>().full_length + around;
  return static_cast<double>(bytes) * (1.0 / ticks - 1.0 / kLongestOdometryTicks) / kControlPeriod;
}

}  // namespace

tl::expected<Port, PortError> open_port(const decltype(config::Daemon::link)& link) {
  const auto& [kind, address, port] = link.endpoint;
  const auto as_port = [](auto&& open) { return Port(std::forward<decltype(open)>(open)); };
  switch (kind) {
    case config::LinkDevice::Kind::serial:
      if (link.protocol == config::LinkProtocol::plain)
        return SerialPort::open(address, static_cast<unsigned>(link.baud)).map([&](SerialPort&& line) {
          return Port(PlainPort(std::move(line), static_cast<std::uint8_t>(link.system)));
        });
      return SerialPort::open(address, static_cast<unsigned>(link.baud)).map(as_port);
    case config::LinkDevice::Kind::udp:
      return UdpPort::open({"0.0.0.0", 0}, UdpPort::Endpoint{address, port}).map(as_port);
    case config::LinkDevice::Kind::udpin:
      return UdpPort::open({address, port}, std::nullopt).map(as_port);
    case config::LinkDevice::Kind::tcp:
      return TcpPort::open(address, port, std::chrono::milliseconds(500)).map(as_port);
  }
  return tl::unexpected(PortError{PortError::Kind::address});
}

tl::expected<LineRate, std::string> configured_line(const decltype(config::Daemon::link)& link,
                                                    const OdometryTiming& timing) {
  constexpr double kRound = 100;
  if (link.endpoint.kind != config::LinkDevice::Kind::serial && !link.share) return LineRate{};
  const int ticks = longest_odometry_ticks(timing);
  const double share = link.share.value_or(kSerialShare);
  const LineRate line = serial_line(link.baud, share, link.protocol == config::LinkProtocol::plain);
  const double least = least_rate(line.frame, link.signing_key.has_value()) + more_odometry(line, link, ticks);
  if (line.bytes_per_second >= least) return line;
  return tl::unexpected(fmt::format(
      "key 'link.baud' = {}: {:.0f} bytes/s at a share of {:g}, and set-points at 50 Hz with ODOMETRY every {} ms need "
      "{:.0f}: a baud of {:.0f}, or a larger link.share",
      link.baud, line.bytes_per_second, share, ticks * 20, least,
      std::ceil(least / line.bytes_per_second * link.baud / kRound) * kRound));
}

std::string traffic(const AutopilotLink& link) {
  const auto& in = link.received();
  const auto& heard = link.telemetry();
  const auto& out = link.transmit();
  return fmt::format(
      "{} frames received; {} damaged, {} of other messages, {} with unknown flags, {} bytes between frames; {} "
      "messages late, {} broken since the port was opened; {} frames sent, {} gave way, {} ODOMETRY left out in all",
      in.frames, in.bad_crc, in.unknown_id, in.unknown_incompat, in.skipped_bytes, heard.out_of_order, heard.broken,
      out.sent(), out.dropped(), link.thinned());
}

void LinkWatch::step() {
  while (const auto event = channels_.events.pop()) tell(*event, manager_);
  if (const std::uint64_t lost = channels_.events.lost(), before = std::exchange(events_lost_, lost); lost != before)
    spdlog::warn("{} events of the control thread were not told: 256 waited", lost - before);
  const std::uint32_t losses = channels_.port_losses.load(std::memory_order_relaxed);
  const std::optional<LinkFault> fault = channels_.link_fault.load(std::memory_order_relaxed);
  if (std::exchange(losses_, losses) != losses)
    spdlog::error("{}: {}, loss {}", link_.device, name(LinkFault::port_lost), losses);
  if (fault != fault_) {
    if (!fault)
      spdlog::info("{}: link good", link_.device);
    else if (*fault != LinkFault::port_lost)
      spdlog::error("{}: {}", link_.device, name(*fault));
    fault_ = fault;
  }
  channels_.ports.collect();
  if (losses == mended_) return;
  if (auto port = open_port(link_)) {
    channels_.ports.offer(std::make_unique<const FreshPort>(FreshPort{std::move(*port)}));
    mended_ = losses;
  }
}

void run_link_watch(Channels& channels, const decltype(config::Daemon::link)& link, const ServiceManager& manager) {
  LinkWatch watch(channels, link, manager);
  while (!channels.stop) {
    watch.step();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace backwash::daemon
