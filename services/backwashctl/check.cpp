// SPDX-License-Identifier: BSD-3-Clause
// `backwashctl check`: what speaks against a flight, line by line.
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "services/backwashctl/preflight.hpp"
#include "services/backwashctl/status_output.hpp"
#include "services/backwashctl/verbs.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::ctl {

int Verbs::check() {
  constexpr double kWatch = 2.0, kAsked = 15.0;  // s
  Station station(options_);
  const auto before = station.status(options_.timeout_s);
  auto after = before;
  const auto begun = std::chrono::steady_clock::now();
  const auto since = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(); };
  // What an autopilot has, and what it has not, takes longer to ask for than rates to count.
  while (after && !interrupted() && since() < (after->advises(dds::kAsking) ? kAsked : kWatch))
    after = station.status(1.0);
  if (!after) {
    std::cerr << "backwashctl check: " << nobody() << "\n";
    return kUnavailable;
  }
  bool all = true;
  nlohmann::json lines = nlohmann::json::array();
  for (const Finding& f : preflight(*before, *after, since())) {
    all = all && f.good;
    lines.push_back({{"name", f.name}, {"good", f.good}, {"found", f.found}, {"advice", f.advice}});
    if (!json_)
      std::cout << (f.good ? "good  " : "FAIL  ") << f.name << ": " << f.found << (f.good ? "" : " -> " + f.advice)
                << "\n";
  }
  if (json_) std::cout << text_of({{"good", all}, {"findings", lines}}, 2) << "\n";
  return all ? 0 : kUnavailable;
}

}  // namespace backwash::ctl
