// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "core/config/daemon_config.hpp"
#include "services/backwashd/daemon.hpp"
#include "version.hpp"

namespace {

constexpr int kUsage = 64, kSoftware = 70, kConfiguration = 78;

int failed(int code, const std::string& message) {
  std::cerr << "backwashd: " << message << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "backwashd: the onboard daemon. Odometry, maps and commands over DDS, set-points over MAVLink.\n"
      "Example: backwashd --config /etc/backwash/backwashd.toml"};
  std::string path;
  bool check = false;
  app.add_option("--config", path, "configuration file, or builtin:backwashd")->required();
  app.add_flag("--check-config", check, "only read the configuration; exit 78 and say what is wrong with it");
  app.set_version_flag("--version", std::string("backwashd ") + backwash::kVersion);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& wrong) {
    return failed(kUsage, std::string(wrong.what()) + "; see backwashd --help");
  }
  const auto settings = backwash::daemon::load_settings(path);
  if (!settings) return failed(kConfiguration, settings.error());
  if (check) {
    std::cout << path << ": good\n";
    return 0;
  }
  try {
    return backwash::daemon::run(*settings);
  } catch (const std::exception& e) {
    return failed(kSoftware, e.what());
  }
}
