// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>

#include "services/backwashctl/verbs.hpp"
#include "services/command_line/command_line.hpp"
#include "services/command_line/exit_code.hpp"
#include "services/dds/dds.hpp"
#include "version.hpp"

int main(int argc, char** argv) {
  backwash::services::Command app{"backwashctl: ground station of a backwash daemon", "backwashctl"};
  app.version(backwash::kVersion);
  backwash::ctl::Verbs verbs(app);
  try {
    if (const auto code = app.parse(argc, argv)) return *code;
    backwash::ctl::end_waits_on_signals();
    const int code = verbs.run();
    return backwash::services::finished(backwash::ctl::interrupted() ? 128 + backwash::ctl::interrupted() : code,
                                        "backwashctl");
  } catch (const backwash::StartError& e) {
    std::cerr << "backwashctl: " << e.what() << "\n";
    return e.code;
  } catch (const backwash::dds::Error& e) {
    std::cerr << "backwashctl: " << e.what() << "; give an --interface and a --domain of this machine\n";
    return backwash::kSystem;
  } catch (const std::exception& e) {
    std::cerr << "backwashctl: " << e.what() << "\n";
    return backwash::kSoftware;
  }
}
