// SPDX-License-Identifier: BSD-3-Clause
// Built with libgpiod 2.
#include <gpiod.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "firmware_bridge/gpio/line.hpp"

namespace backwash::firmware_bridge {

using namespace std::chrono;

namespace {

constexpr std::size_t kEvents = 16;

template <auto release>
struct With {
  template <typename T>
  void operator()(T* object) const noexcept {
    release(object);
  }
};
using Chip = std::unique_ptr<gpiod_chip, With<::gpiod_chip_close>>;
using Info = std::unique_ptr<gpiod_chip_info, With<::gpiod_chip_info_free>>;
using Request = std::unique_ptr<gpiod_line_request, With<::gpiod_line_request_release>>;
using Events = std::unique_ptr<gpiod_edge_event_buffer, With<::gpiod_edge_event_buffer_free>>;
using Settings = std::unique_ptr<gpiod_line_settings, With<::gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, With<::gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, With<::gpiod_request_config_free>>;

tl::unexpected<GpioLine::Error> failed(const std::string& what, int number) {
  return tl::unexpected(what + ": " + std::generic_category().message(number));
}

/// Null with errno set: refused.
Request request(gpiod_chip* chip, unsigned offset, GpioLine::Use use) {
  const Settings settings(::gpiod_line_settings_new());
  const LineConfig lines(::gpiod_line_config_new());
  const RequestConfig config(::gpiod_request_config_new());
  if (!settings || !lines || !config) return nullptr;
  int bad = 0;
  if (use == GpioLine::Use::switch_input) {
    bad |= ::gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_INPUT);
    bad |= ::gpiod_line_settings_set_edge_detection(settings.get(), GPIOD_LINE_EDGE_BOTH);
    bad |= ::gpiod_line_settings_set_bias(settings.get(), GPIOD_LINE_BIAS_PULL_UP);
  } else {
    bad |= ::gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_OUTPUT);
    bad |= ::gpiod_line_settings_set_output_value(settings.get(), GPIOD_LINE_VALUE_INACTIVE);
  }
  bad |= ::gpiod_line_config_add_line_settings(lines.get(), &offset, 1, settings.get());
  if (bad != 0) return nullptr;
  ::gpiod_request_config_set_consumer(config.get(), "backwashd");
  return Request(::gpiod_chip_request_lines(chip, config.get(), lines.get()));
}

/// Null with errno set: there is none.
Chip open_chip(const std::string& chip) {
  if (chip.starts_with('/')) return Chip(::gpiod_chip_open(chip.c_str()));
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", none)) {
    if (!entry.path().filename().string().starts_with("gpiochip")) continue;
    Chip opened(::gpiod_chip_open(entry.path().c_str()));
    const Info info(opened ? ::gpiod_chip_get_info(opened.get()) : nullptr);
    if (info && ::gpiod_chip_info_get_label(info.get()) == chip) return opened;
  }
  errno = ENOENT;
  return nullptr;
}

}  // namespace

struct GpioLine::Handle {
  Request line;
  Events events;
  unsigned offset;
  std::string what;       // chip and line
  std::size_t next = 0;   // event of the buffer
  std::size_t taken = 0;  // from the kernel into the buffer
};

void GpioLine::Release::operator()(Handle* handle) const noexcept { delete handle; }

tl::expected<GpioLine, GpioLine::Error> GpioLine::open(const std::string& chip, const std::string& name, Use use) {
  const std::string what = chip + ", line " + name;
  const Chip opened = open_chip(chip);
  if (!opened) return failed(chip, errno);
  const int offset = ::gpiod_chip_get_line_offset_from_name(opened.get(), name.c_str());
  if (offset < 0) return tl::unexpected(what + ": no line has that name");
  Request line = request(opened.get(), static_cast<unsigned>(offset), use);
  if (!line) return failed(what, errno);
  Events events(::gpiod_edge_event_buffer_new(kEvents));
  if (!events) return failed(what, errno);
  return GpioLine(std::unique_ptr<Handle, Release>(
      new Handle{std::move(line), std::move(events), static_cast<unsigned>(offset), what}));
}

tl::expected<bool, GpioLine::Error> GpioLine::wait(nanoseconds most) {
  if (handle_->next < handle_->taken) return true;
  const int n = ::gpiod_line_request_wait_edge_events(handle_->line.get(), most.count());
  if (n < 0 && errno != EINTR) return failed(handle_->what, errno);
  return n > 0;
}

tl::expected<GpioLine::Edge, GpioLine::Error> GpioLine::next_edge() {
  if (handle_->next >= handle_->taken) {
    const int n = ::gpiod_line_request_read_edge_events(handle_->line.get(), handle_->events.get(), kEvents);
    if (n <= 0) return failed(handle_->what, n < 0 ? errno : EIO);
    handle_->taken = static_cast<std::size_t>(n);
    handle_->next = 0;
  }
  auto* const event = ::gpiod_edge_event_buffer_get_event(handle_->events.get(), handle_->next++);
  const nanoseconds at(::gpiod_edge_event_get_timestamp_ns(event));
  return Edge{::gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE, steady_clock::time_point(at)};
}

tl::expected<bool, GpioLine::Error> GpioLine::level() const {
  const auto value = ::gpiod_line_request_get_value(handle_->line.get(), handle_->offset);
  if (value == GPIOD_LINE_VALUE_ERROR) return failed(handle_->what, errno);
  return value == GPIOD_LINE_VALUE_ACTIVE;
}

tl::expected<void, GpioLine::Error> GpioLine::set(bool high) {
  const auto value = high ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
  if (::gpiod_line_request_set_value(handle_->line.get(), handle_->offset, value) != 0)
    return failed(handle_->what, errno);
  return {};
}

}  // namespace backwash::firmware_bridge
