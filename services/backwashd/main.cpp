// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/spdlog.h>

#include <iostream>

#include "core/config/daemon_config.hpp"
#include "services/backwashd/daemon.hpp"
#include "services/command_line/command_line.hpp"
#include "version.hpp"

namespace {

int failed(int code, const std::string& message) {
  std::cerr << "backwashd: " << message << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  backwash::services::Command app{
      "backwashd: the onboard daemon. Odometry, maps and commands over DDS, set-points over MAVLink.\n"
      "Example: backwashd --config /etc/backwash/backwashd.toml",
      "backwashd"};
  std::string path;
  bool check = false;
  app.add_option("--config", path, "configuration file, or builtin:backwashd").required();
  app.add_flag("--check-config", check, "only read the configuration; exit 78 and say what is wrong with it");
  app.version(backwash::kVersion);
  if (const auto code = app.parse(argc, argv)) return *code;
  const auto settings = backwash::daemon::load_settings(path);
  if (!settings) return failed(settings.error().code, settings.error().what());
  if (check) {
    std::cout << path << ": good\n";
    return backwash::services::finished(0, "backwashd");
  }
  try {
    return backwash::daemon::run(*settings);
  } catch (const std::exception& e) {
    return failed(backwash::kSoftware, e.what());
  }
}
