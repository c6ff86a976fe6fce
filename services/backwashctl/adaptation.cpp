// SPDX-License-Identifier: BSD-3-Clause
// `backwashctl adaptation`: what the flight has learnt of its air, and orders about it.
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "services/backwashctl/verbs.hpp"
#include "services/command_line/exit_code.hpp"
#include "services/command_line/words.hpp"
#include "services/dds/air_text.hpp"

namespace backwash::ctl {
namespace {

/// `air` of null: nothing is learnt.
nlohmann::ordered_json json_of(const std::optional<dds::AirSaid>& air) {
  nlohmann::ordered_json classes = nlohmann::ordered_json::array();
  if (air)
    for (const auto& [name, factor, ln_evidence, seconds, cause] : air->classes)
      classes.push_back({{"class", name},
                         {"factor", factor},
                         {"ln_evidence", ln_evidence},
                         {"seconds", seconds},
                         {"cause", cause.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(cause)}});
  return {{"learns", air.has_value()}, {"frozen", air && air->frozen}, {"classes", classes}};
}

void print(const std::optional<dds::AirSaid>& air) {
  if (!air) return void(std::printf("nothing is learnt of the air: adaptation.enabled is false\n"));
  if (air->frozen) std::printf("frozen: the factors stay as they are until thawed\n");
  if (air->classes.empty()) std::printf("as modelled; nothing was flown yet\n");
  for (const auto& [name, factor, ln_evidence, seconds, cause] : air->classes)
    std::printf("%-9s factor %.2f%s%s%s, ln evidence %.1f, %.0f s of flight\n", name.c_str(), factor,
                factor < 1 ? " (calmer)" : "", cause.empty() ? "" : ", by ", cause.c_str(), ln_evidence, seconds);
}

}  // namespace

void Verbs::add_adaptation(Command& app) {
  auto* sub = verb(app, "adaptation", "what was learnt of the air: factor by class, its evidence and time of flight",
                   "adaptation --json", [this] { return adaptation(); });
  sub->add_option("what", air_order_,
                  "show; freeze: the factors stay as they are; thaw: they follow the evidence again, also that of "
                  "meanwhile; reset: nothing counts any more, only disarmed and not enabled")
      .capture_default_str()
      .check(services::one_of({"show", "freeze", "thaw", "reset"}));
}

int Verbs::adaptation() {
  const auto ask = [this](std::uint8_t verb) { return command("adaptation " + air_order_, verb, Vec3::Zero(), {}); };
  if (air_order_ == "reset") return ask(backwash_msgs_msg_dds__COMMAND_AIR_RESET);
  if (air_order_ == "freeze") return ask(backwash_msgs_msg_dds__COMMAND_AIR_FREEZE);
  if (air_order_ == "thaw") return ask(backwash_msgs_msg_dds__COMMAND_AIR_THAW);
  Station station(options_);
  const auto now = station.status(options_.timeout_s);
  if (!now) {
    services::say_error("backwashctl adaptation", nobody());
    return kUnavailable;
  }
  const auto air = dds::air_said(now->air);
  if (!air && !now->air.empty()) {
    services::say_error("backwashctl adaptation", "the daemon is of another version: it says '" + now->air + "'");
    return kUnavailable;
  }
  if (json_)
    std::cout << json_of(air).dump(2) << "\n";
  else
    print(air);
  return kOk;
}

}  // namespace backwash::ctl
