// SPDX-License-Identifier: BSD-3-Clause
// Plays a script against a real autopilot in its own simulator, in real time: session.hpp.
#include <signal.h>

#include <fstream>
#include <iostream>
#include <thread>

#include "services/backwashd/channels.hpp"
#include "services/command_line/command_line.hpp"
#include "services/parallel/real_time.hpp"
#include "tests/autopilots/device.hpp"
#include "tests/autopilots/session.hpp"

namespace backwash::autopilots {
namespace {

int play(const std::string& device, const std::string& truth_at, const std::string& trace_path, int pid,
         Session::Options options) {
  bool stopped = false;  // then its simulator answers nobody, and the time must go on
  options.stopped = [&](bool stop) {
    stopped = stop;
    ::kill(pid, stop ? SIGSTOP : SIGCONT);
  };
  std::ofstream trace(trace_path);
  Session session(open_line(device), options, trace);
  const auto truth = truth_source(truth_at);
  for (auto due = std::chrono::steady_clock::now(); !session.done();) {
    due += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(due);
    if (!session.step(daemon::now_ns(), stopped ? std::nullopt : truth->newest())) return 1;
  }
  session.finish();
  return 0;
}

}  // namespace
}  // namespace backwash::autopilots

int main(int argc, char** argv) {
  backwash::autopilots::Session::Options o;
  std::string device, truth, script, trace;
  int pid = 0;
  backwash::services::Command app{"autopilot_script: plays a script against an autopilot and writes a trace",
                                  "autopilot_script"};
  app.add_option("--device", device, "as in the daemon's [link]").required();
  app.add_option("--truth", truth, "see truth.hpp").required();
  app.add_option("--script", script).required();
  app.add_option("--trace", trace, "CSV").required();
  app.add_option("--noise", o.noise, "of the odometry's position, m");
  app.add_flag("--px4", o.px4, "integer parameters bytewise, as PX4 has them");
  app.add_option("--pid", pid, "of the autopilot, for `signal`");
  if (const auto code = app.parse(argc, argv)) return *code;
  o.script = script;
  try {
    backwash::set_fifo(backwash::allowed_fifo(70));
    return backwash::autopilots::play(device, truth, trace, pid, o);
  } catch (const std::exception& e) {
    std::cerr << "autopilot_script: " << e.what() << "\n";
    return 70;
  }
}
