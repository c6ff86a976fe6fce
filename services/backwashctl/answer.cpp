// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/answer.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "services/command_line/exit_code.hpp"
#include "services/command_line/words.hpp"

namespace backwash::ctl {

int say(const Outcome& outcome, bool json) {
  using Json = nlohmann::ordered_json;
  if (json) {
    const Json told{{"verb", outcome.verb},
                    {"accepted", outcome.accepted},
                    {"done", outcome.done ? Json(*outcome.done) : Json()},
                    {"reason", outcome.why}};
    std::printf("%s\n", told.dump(-1, ' ', false, Json::error_handler_t::replace).c_str());
  }
  if (outcome.good()) return kOk;
  services::say_error("backwashctl " + outcome.verb, outcome.why);
  return kUnavailable;
}

}  // namespace backwash::ctl
