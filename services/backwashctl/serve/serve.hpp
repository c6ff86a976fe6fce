// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "services/backwashctl/station.hpp"
#include "services/command_line/command_line.hpp"

namespace backwash::ctl {

struct ServeOptions {
  std::string address = "127.0.0.1";
  int port = 8086;
  std::string vehicle, model;  ///< files; empty: no bounds are shown, and no way before it is flown
};
void add_options(services::Command& command, ServeOptions& options);

/// `backwashctl serve`: a page with what the vehicle does and buttons for what it shall do, until interrupted. Prints
/// the page's address, with `json` as an object. Returns 0.
int serve(const Options& station, const ServeOptions& options, bool json);

}  // namespace backwash::ctl
