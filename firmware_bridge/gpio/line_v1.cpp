// SPDX-License-Identifier: BSD-3-Clause
// Built with libgpiod 1.
#include <gpiod.h>

#include <cerrno>
#include <system_error>

#include "firmware_bridge/gpio/line.hpp"

namespace backwash::firmware_bridge {

using namespace std::chrono;

struct GpioLine::Handle {
  gpiod_chip* chip;
  gpiod_line* line;
  std::string what;  // chip and line
};

namespace {

tl::unexpected<GpioLine::Error> failed(const std::string& what, int number) {
  return tl::unexpected(what + ": " + std::generic_category().message(number));
}

}  // namespace

void GpioLine::Release::operator()(Handle* handle) const noexcept {
  ::gpiod_chip_close(handle->chip);  // and with it its lines
  delete handle;
}

tl::expected<GpioLine, GpioLine::Error> GpioLine::open(const std::string& chip, const std::string& name, Use use) {
  const std::string what = chip + ", line " + name;
  gpiod_chip* const opened =
      chip.starts_with('/') ? ::gpiod_chip_open(chip.c_str()) : ::gpiod_chip_open_by_label(chip.c_str());
  if (!opened) return failed(chip, errno);
  std::unique_ptr<Handle, Release> handle(new Handle{opened, nullptr, what});
  handle->line = ::gpiod_chip_find_line(opened, name.c_str());
  if (!handle->line) return tl::unexpected(what + ": no line has that name");
  const bool input = use == Use::switch_input;
  const gpiod_line_request_config config{
      "backwashd", input ? GPIOD_LINE_REQUEST_EVENT_BOTH_EDGES : GPIOD_LINE_REQUEST_DIRECTION_OUTPUT,
      input ? GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP : 0};
  if (::gpiod_line_request(handle->line, &config, 0) != 0) return failed(what, errno);
  return GpioLine(std::move(handle));
}

tl::expected<bool, GpioLine::Error> GpioLine::wait(nanoseconds most) {
  const timespec wait{most.count() / 1'000'000'000, most.count() % 1'000'000'000};
  const int n = ::gpiod_line_event_wait(handle_->line, &wait);
  if (n < 0 && errno != EINTR) return failed(handle_->what, errno);
  return n > 0;
}

tl::expected<GpioLine::Edge, GpioLine::Error> GpioLine::next_edge() {
  gpiod_line_event event;
  if (::gpiod_line_event_read(handle_->line, &event) != 0) return failed(handle_->what, errno);
  const auto at = seconds(event.ts.tv_sec) + nanoseconds(event.ts.tv_nsec);
  return Edge{event.event_type == GPIOD_LINE_EVENT_RISING_EDGE, steady_clock::time_point(at)};
}

tl::expected<bool, GpioLine::Error> GpioLine::level() const {
  const int value = ::gpiod_line_get_value(handle_->line);
  if (value < 0) return failed(handle_->what, errno);
  return value == 1;
}

tl::expected<void, GpioLine::Error> GpioLine::set(bool high) {
  if (::gpiod_line_set_value(handle_->line, high ? 1 : 0) != 0) return failed(handle_->what, errno);
  return {};
}

}  // namespace backwash::firmware_bridge
