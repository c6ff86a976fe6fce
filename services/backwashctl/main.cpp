// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <iostream>

#include "services/backwashctl/verbs.hpp"
#include "version.hpp"

int main(int argc, char** argv) {
  CLI::App app{"backwashctl: ground station of a backwash daemon"};
  app.set_version_flag("--version", std::string("backwashctl ") + backwash::kVersion);
  backwash::ctl::Verbs verbs(app);
  try {
    app.parse(argc, argv);
    return verbs.run();
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& wrong) {
    std::cerr << "backwashctl: " << wrong.what() << "; see backwashctl --help\n";
    return 64;
  } catch (const std::exception& e) {
    std::cerr << "backwashctl: " << e.what() << "\n";
    return 70;
  }
}
