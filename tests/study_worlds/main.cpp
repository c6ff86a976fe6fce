// SPDX-License-Identifier: BSD-3-Clause
// study_worlds --out DIR [--seed N] [--cause NAME]… [--size S] [--flights N] [--confound NAME] [--rough-walls F]
// [--truth FILE]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "services/command_line/command_line.hpp"
#include "tests/study_worlds/world.hpp"

int main(int argc, char** argv) {
  backwash::services::Command app{"Writes a world with a hidden effect: map.bt, vehicle.toml and flight logs",
                                  "study_worlds"};
  study_worlds::Request request;
  std::string out, truth;
  request.seed = static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count());
  if (const char* set = std::getenv("BACKWASH_STUDY_SEED")) request.seed = std::strtoull(set, nullptr, 10);
  app.add_option("--out", out, "folder for the logs").required();
  app.add_option("--seed", request.seed, "default: $BACKWASH_STUDY_SEED, else the clock; printed");
  app.add_option("--cause", request.causes, "hidden cause, or 'unknown'; none without");
  app.add_option("--size", request.size, "in units of the effect-size table").capture_default_str();
  app.add_option("--flights", request.flights).capture_default_str();
  app.add_option("--rough-walls", request.rough_walls, "factor on the variance near walls").capture_default_str();
  app.add_option("--confound", request.confound).check(backwash::services::one_of({"yaw", "battery", "fast"}));
  app.add_option("--truth", truth, "file for the answer");
  if (const auto code = app.parse(argc, argv)) return *code;
  const auto world = study_worlds::draw_world(request);
  study_worlds::write_world(world, out);
  const std::string line = study_worlds::truth_line(world);
  if (!truth.empty()) std::ofstream(truth) << line << '\n';
  std::printf("%s\n", line.c_str());
  return 0;
}
