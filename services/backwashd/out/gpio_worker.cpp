// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/gpio_worker.hpp"

#include <spdlog/spdlog.h>

#include <thread>
#include <utility>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/switch_reaction.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::daemon {
namespace {

using namespace firmware_bridge;
using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kLook = 5ms;       // a quarter of the debounce time
constexpr auto kToldFor = 100ms;  // five ticks
constexpr auto kTryAgain = 1s;
constexpr auto kNoTicks = 500ms;  // the control thread has stopped
constexpr int kEdgesAtOnce = 64;  // of a line that does not stop changing

}  // namespace

GpioWorker::GpioWorker(Channels& channels, const config::Daemon::Gpio& names)
    : channels_(channels),
      chip_(names.chip),
      stop_switch_{"stop switch", names.stop_switch, GpioLine::Use::switch_input},
      strobe_{"strobe", names.strobe, GpioLine::Use::output},
      led_{"status LED", names.led, GpioLine::Use::output} {
  if (!names.stop_switch.empty()) channels_.stop_switch.state = SwitchState::lost;
}

void GpioWorker::lose(Wanted& wanted, const std::string& why) {
  if (std::exchange(wanted.told, why) != why) spdlog::error("{}: {}", wanted.what, why);
  wanted.line.reset();
  if (&wanted == &stop_switch_) switch_.lose();
}

void GpioWorker::open_missing(Time now) {
  if (now - tried_ < kTryAgain) return;
  tried_ = now;
  for (Wanted* wanted : {&stop_switch_, &strobe_, &led_}) {
    if (wanted->name.empty() || wanted->line) continue;
    auto line = GpioLine::open(chip_, wanted->name, wanted->use);
    if (!line) {
      lose(*wanted, line.error());
      continue;
    }
    wanted->line = std::move(*line);
    wanted->told.clear();
    spdlog::info("{}: {}, line {}", wanted->what, chip_, wanted->name);
  }
}

// Each edge at its own time, then the level as it is now: neither a short pulse nor a lost edge goes unseen.
void GpioWorker::take_switch() {
  auto waited = stop_switch_.line->wait(kLook);
  for (int n = 0; n < kEdgesAtOnce && waited && *waited; ++n) {
    const auto edge = stop_switch_.line->next_edge();
    if (!edge) return lose(stop_switch_, edge.error());
    switch_.see(edge->high, edge->at);
    if (switch_.state() == SwitchState::pressed) pressed_ = steady_clock::now();
    waited = stop_switch_.line->wait(0ms);
  }
  if (!waited) return lose(stop_switch_, waited.error());
  const auto level = stop_switch_.line->level();
  if (!level) return lose(stop_switch_, level.error());
  switch_.see(*level, steady_clock::now());
}

void GpioWorker::tell_switch() {
  SwitchState state = switch_.state();
  // Of a press that was over before this thread came to look the control thread must hear too.
  if (state == SwitchState::released && steady_clock::now() - pressed_ < kToldFor) state = SwitchState::pressed;
  channels_.stop_switch.state.store(state, std::memory_order_relaxed);
  channels_.stop_switch.at_ns.store(now_ns(), std::memory_order_release);
  if (std::exchange(told_, state) == state || state == SwitchState::lost) return;
  if (may_fly(state))
    spdlog::info("stop switch: {}", name(state));
  else
    spdlog::warn("{}", refusal(state));
}

void GpioWorker::drive(Wanted& wanted, bool high) {
  if (!wanted.line) return;
  if (const auto set = wanted.line->set(high); !set) lose(wanted, set.error());
}

void GpioWorker::step() {
  const auto now = steady_clock::now();
  open_missing(now);
  if (stop_switch_.line)
    take_switch();
  else
    std::this_thread::sleep_for(kLook);
  if (!stop_switch_.name.empty()) tell_switch();
  const std::uint64_t ticks = channels_.pulse.ticks.load(std::memory_order_relaxed);
  if (std::exchange(ticks_, ticks) != ticks) ticked_ = now;
  const bool fault = now - ticked_ > kNoTicks || !(stop_switch_.name.empty() || may_fly(switch_.state()));
  drive(strobe_, edges_.level(ticks));
  drive(led_, lit(fault ? Signal::fault : channels_.pulse.signal.load(std::memory_order_relaxed), now));
}

void run_gpio(Channels& channels, GpioWorker& worker, int priority) {
  if (priority > 0) set_fifo(priority);
  while (!channels.stop) worker.step();
}

}  // namespace backwash::daemon
