// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/link_watch.hpp"

#include <spdlog/spdlog.h>

#include <thread>
#include <utility>

namespace backwash::daemon {
namespace {

using firmware_bridge::LinkFault;

void tell(const ControlEvent& event) {
  switch (event.kind) {
    case ControlEvent::Kind::transition:
      return spdlog::info("{}: {}", to_string(event.mode), to_string(event.reason));
    case ControlEvent::Kind::missed_deadline:
      return spdlog::warn("control deadline missed: {} periods skipped", event.count);
    case ControlEvent::Kind::page_fault:
      return spdlog::warn("{} page faults in a control tick", event.count);
  }
}

}  // namespace

void LinkWatch::step() {
  while (const auto event = channels_.events.pop()) tell(*event);
  constexpr std::uint8_t kPortLost = 1 + static_cast<std::uint8_t>(LinkFault::kPortLost);
  const std::uint32_t losses = channels_.port_losses.load(std::memory_order_relaxed);
  const std::uint8_t fault = channels_.link_fault.load(std::memory_order_relaxed);
  if (std::exchange(losses_, losses) != losses)
    spdlog::error("{}: {}, loss {}", device_, name(LinkFault::kPortLost), losses);
  if (fault != fault_) {
    if (fault == 0)
      spdlog::info("{}: link good", device_);
    else if (fault != kPortLost)
      spdlog::error("{}: {}", device_, name(static_cast<LinkFault>(fault - 1)));
    fault_ = fault;
  }
  channels_.ports.collect();
  if (losses == mended_) return;
  if (auto port = firmware_bridge::SerialPort::open(device_, baud_)) {
    channels_.ports.offer(std::make_unique<const FreshPort>(std::move(*port)));
    mended_ = losses;
  }
}

void run_link_watch(Channels& channels, const decltype(config::Daemon::link)& link) {
  LinkWatch watch(channels, link.device, static_cast<unsigned>(link.baud));
  while (!channels.stop) {
    watch.step();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace backwash::daemon
