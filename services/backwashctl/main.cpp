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
    backwash::ctl::end_waits_on_signals();
    const int code = verbs.run();
    return backwash::ctl::interrupted() ? 128 + backwash::ctl::interrupted() : code;
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
