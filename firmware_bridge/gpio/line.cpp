// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/gpio/line.hpp"

#include <system_error>

namespace backwash::firmware_bridge {
namespace {

/// What `ask` answers; where the library throws, its reason behind `what`.
template <typename Ask>
auto told(const std::string& what, const Ask& ask) -> tl::expected<decltype(ask()), GpioLine::Error> {
  try {
    if constexpr (std::is_void_v<decltype(ask())>)
      return ask(), tl::expected<void, GpioLine::Error>();
    else
      return ask();
  } catch (const std::system_error& e) {
    return tl::unexpected(what + ": " + e.code().message());
  }
}

}  // namespace

tl::expected<GpioLine, GpioLine::Error> GpioLine::open(const std::string& chip, const std::string& name, Use use) {
  const std::string what = chip + ", line " + name;
  const int how = chip.starts_with('/') ? gpiod::chip::OPEN_BY_PATH : gpiod::chip::OPEN_BY_LABEL;
  const auto opened = told(chip, [&] { return gpiod::chip(chip, how); });
  if (!opened) return tl::unexpected(opened.error());
  const auto line = told(what, [&] { return opened->find_line(name); });
  if (!line) return tl::unexpected(line.error());
  if (!*line) return tl::unexpected(what + ": no line has that name");
  gpiod::line_request request{"backwashd", gpiod::line_request::DIRECTION_OUTPUT, 0};
  if (use == Use::switch_input)
    request = {"backwashd", gpiod::line_request::EVENT_BOTH_EDGES, gpiod::line_request::FLAG_BIAS_PULL_UP};
  return told(what, [&] { return line->request(request), GpioLine(*line, what); });
}

tl::expected<bool, GpioLine::Error> GpioLine::wait(std::chrono::nanoseconds most) {
  return told(what_, [&] {
    try {
      return line_.event_wait(most);
    } catch (const std::system_error& e) {
      if (e.code() == std::errc::interrupted) return false;
      throw;
    }
  });
}

tl::expected<GpioLine::Edge, GpioLine::Error> GpioLine::next_edge() {
  return told(what_, [&] {
    const gpiod::line_event event = line_.event_read();
    return Edge{event.event_type == gpiod::line_event::RISING_EDGE,
                std::chrono::steady_clock::time_point(event.timestamp)};
  });
}

tl::expected<bool, GpioLine::Error> GpioLine::level() const {
  return told(what_, [&] { return line_.get_value() == 1; });
}

tl::expected<void, GpioLine::Error> GpioLine::set(bool high) {
  return told(what_, [&] { line_.set_value(high ? 1 : 0); });
}

}  // namespace backwash::firmware_bridge
