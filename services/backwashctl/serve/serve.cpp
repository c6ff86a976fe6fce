// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/serve.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/config/config.hpp"
#include "services/backwashctl/serve/control.hpp"
#include "services/backwashctl/serve/feed.hpp"
#include "services/backwashctl/serve/files.hpp"
#include "services/backwashctl/serve/http.hpp"
#include "services/backwashctl/serve/slice.hpp"
#include "services/backwashctl/serve/surroundings.hpp"
#include "services/backwashctl/status_output.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::ctl {
namespace {

using Json = nlohmann::json;

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string parameter(const Asked& asked, const std::string& name) {
  const auto found = asked.parameters.find(name);
  return found == asked.parameters.end() ? "" : found->second;
}

/// What a page is told 10 times a second. It gets the long parts again when they change.
class PageEvents {
 public:
  /// `surroundings`: null without a vehicle.
  PageEvents(const Feed& feed, Control& control, const Surroundings* surroundings, std::string page)
      : feed_(feed), control_(control), surroundings_(surroundings), page_(std::move(page)) {}
  ~PageEvents() { control_.leave(page_); }
  PageEvents(const PageEvents&) = delete;
  PageEvents& operator=(const PageEvents&) = delete;

  std::string next() {
    if (begun_) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    begun_ = true;
    const Seen seen = feed_.seen();
    Json event = control_.told(page_);
    event["status"] = seen.status ? json_of(*seen.status) : Json();
    event["rows"] = seen.status ? Json(rows_of(*seen.status)) : Json::array();
    event["age_s"] = seen.status ? Json(std::chrono::duration<double>(Clock::now() - seen.status_at).count()) : Json();
    event["now_s"] = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
    event["battery"] = battery(seen);
    event["over_bound"] = over_bound(seen);
    event["map"] = {{"number", seen.map_number}, {"refused", seen.map_refused}};
    event["preflight"] = Json::array();
    for (const Finding& f : seen.preflight)
      event["preflight"].push_back({{"name", f.name}, {"good", f.good}, {"found", f.found}, {"advice", f.advice}});
    if (seen.path_number != path_number_) event["flown"] = seen.path ? json_of(*seen.path) : Json();
    path_number_ = seen.path_number;
    event["plans"] = surroundings_ != nullptr;
    Json preview = surroundings_ ? surroundings_->preview(page_) : Json();
    if (preview != preview_) event["preview"] = preview;
    preview_ = std::move(preview);
    return "data: " + text_of(event) + "\n\n";
  }

 private:
  /// Its age is counted by the daemon's own clock up to the newest status, and from there by ours.
  static Json battery(const Seen& seen) {
    if (!seen.status || !seen.battery) return {};
    const auto& [stamp_ns, share, voltage] = *seen.battery;
    const double before_s = 1e-9 * static_cast<double>(dds::nanoseconds(seen.status->said.stamp) - stamp_ns);
    const double since_s = std::chrono::duration<double>(Clock::now() - seen.status_at).count();
    return {{"share", share ? Json(*share) : Json()},
            {"voltage_v", voltage ? Json(*voltage) : Json()},
            {"age_s", std::max(before_s, 0.0) + since_s}};
  }

  static Json over_bound(const Seen& seen) {
    if (!seen.status || !seen.path) return {};
    const auto &p = seen.status->said.position, &c = seen.status->said.setpoint;
    const auto over = error_over_bound(*seen.path, {p.x, p.y, p.z}, {c.x, c.y, c.z});
    return over ? Json(*over) : Json();
  }

  const Feed& feed_;
  Control& control_;
  const Surroundings* surroundings_;
  std::string page_;
  Json preview_;
  std::uint64_t path_number_ = 0;
  bool begun_ = false;
};

bool is_name(const std::string& page) {
  return page.size() == 32 && page.find_first_not_of("0123456789abcdef") == std::string::npos;
}

Reply slice(const Feed& feed, const Surroundings* surroundings, const Asked& asked) {
  const Seen seen = feed.seen();
  if (!seen.grid) return refusal(404, seen.map_refused.empty() ? "no map was received yet" : seen.map_refused);
  const std::string said = parameter(asked, "z");
  char* end = nullptr;
  const double z = std::strtod(said.c_str(), &end);
  if (said.empty() || *end != 0 || !std::isfinite(z)) return refusal(400, "z must be a height, m in the map");
  Json told = slice_of(*seen.grid, z);
  told["number"] = seen.map_number;
  told["field"] = surroundings ? surroundings->bounds_at(*seen.grid, z) : Json();
  return {200, text_of(told)};
}

std::string type_of(std::string_view name) {
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  if (name.ends_with(".svg")) return "image/svg+xml";
  return "text/javascript; charset=utf-8";
}

Site site_of(const Feed& feed, Control& control, Surroundings* surroundings) {
  Site site;
  for (const PageFile& file : page_files()) {
    const std::string path = file.name == "page.html" ? "/" : "/" + std::string(file.name);
    site.files[path] = {200, std::string(file.text), type_of(file.name)};
  }
  site.knows = [&control](const std::string& page) { return control.admitted(page); };
  site.reads["/slice"] = [&feed, surroundings](const Asked& asked) { return slice(feed, surroundings, asked); };
  if (surroundings)
    site.posts["/preview"] = [surroundings](const Asked& asked) {
      return surroundings->propose(Json::parse(asked.body, nullptr, false));
    };
  site.posts["/command"] = [&control](const Asked& asked) {
    return control.command(Json::parse(asked.body, nullptr, false), asked.remote);
  };
  site.posts["/enter"] = [&control](const Asked& asked) {
    const Json said = Json::parse(asked.body, nullptr, false);
    const std::string page = said.is_object() && said.contains("page") && said["page"].is_string() ? said["page"] : "";
    if (!is_name(page)) return refusal(400, "page must be 32 hexadecimal digits");
    if (!control.admit(page)) return refusal(409, "too many pages have the token");
    return Reply{202, "{}"};
  };
  site.streams["/events"] = [&feed, &control, surroundings](const Asked& asked) -> std::variant<Reply, NextEvents> {
    const std::string page = parameter(asked, "page");
    if (!is_name(page)) return refusal(400, "page must be 32 hexadecimal digits");
    if (!control.enter(page)) return refusal(409, "this page is open already, or too many are");
    const auto events = std::make_shared<PageEvents>(feed, control, surroundings, page);
    return [events] { return events->next(); };
  };
  return site;
}

void say_address(const ServeOptions& options, int port, const std::string& token, bool json) {
  const std::string url = "http://" + options.address + ":" + std::to_string(port) + "/#" + token;
  if (json)
    std::printf("%s\n", text_of({{"url", url}}).c_str());
  else
    std::printf("%s\nWho opens it commands the vehicle; without what follows # it only shows.\n", url.c_str());
  std::fflush(stdout);
}

template <typename T>
T read(const tl::expected<T, config::ConfigError>& file) {
  if (file) return *file;
  throw StartError(file.error().kind == config::ConfigError::Kind::not_found ? kNoInput : kConfiguration,
                   "serve: " + file.error().message);
}

std::unique_ptr<Surroundings> surroundings_of(const Feed& feed, const ServeOptions& options) {
  if (options.vehicle.empty() && options.model.empty()) return nullptr;
  const bool builtin = options.vehicle.starts_with("builtin:");
  if (options.vehicle.empty() || (options.model.empty() && !builtin))
    throw StartError(kUsage, "serve: --vehicle and --model belong together: give both, or a built-in vehicle");
  const Vehicle vehicle = read(config::load_vehicle(options.vehicle));
  const Model model = read(config::load_model(options.model.empty() ? options.vehicle : options.model));
  try {
    plan::sets_of(vehicle, reach::Method::tight);
  } catch (const std::exception& e) {  // a loop that has no sets
    throw StartError(kConfiguration, "serve: " + options.vehicle + ": " + e.what());
  }
  return std::make_unique<Surroundings>(feed, vehicle, model);
}

}  // namespace

void add_options(services::Command& command, ServeOptions& options) {
  command.add_option("--address", options.address, "numeric IPv4 address of this machine to listen on")
      .capture_default_str();
  command.add_option("--port", options.port, "TCP port; 0: any that is free")
      .capture_default_str()
      .check(services::within(0, 65535));
  command.add_option(
      "--vehicle", options.vehicle,
      "vehicle file or builtin:NAME, as the daemon's: shows the disturbance's bound, and each way before it "
      "is flown");
  command.add_option("--model", options.model, "model file; without: the built-in vehicle's own");
}

int serve(const Options& station_options, const ServeOptions& options, bool json) {
  Station station(station_options);
  Feed feed(station.participant(), station_options.name_space);
  Control control(station);
  const auto surroundings = surroundings_of(feed, options);
  const Door door{options.address, options.port, draw_token()};
  std::jthread listening([&](const std::stop_token& stopped) {
    while (!stopped.stop_requested()) feed.step();
  });
  std::jthread commanding([&](const std::stop_token& stopped) { control.run(stopped); });
  std::jthread computing([&](const std::stop_token& stopped) {
    if (surroundings) surroundings->run(stopped);
  });
  serve_http(
      door, site_of(feed, control, surroundings.get()), [&](int port) { say_address(options, port, door.token, json); },
      [] { return interrupted() != 0; });
  return 0;
}

}  // namespace backwash::ctl
