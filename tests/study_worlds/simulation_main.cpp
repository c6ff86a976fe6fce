// SPDX-License-Identifier: BSD-3-Clause
// study_simulation: whether a simulation that a study extended comes as near to further flights as the truth's own.
// Every world is one line of JSON in --out as soon as it is done; --from makes the table of such files.
#include <cstdio>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "services/command_line/command_line.hpp"
#include "tests/study_worlds/in_parallel.hpp"
#include "tests/study_worlds/simulation.hpp"

namespace {

using namespace study_worlds;

struct Options {
  int worlds = 10, jobs = 1;
  ProofRequest request;
  std::vector<std::string> causes, from;
  std::string out;
};

/// Worlds outside, causes inside: a cut run has as many worlds of each cause.
std::vector<Proof> run(const Options& options) {
  const auto causes = options.causes.empty() ? cause_names() : options.causes;
  const std::size_t count = causes.size() * static_cast<std::size_t>(options.worlds);
  std::vector<Proof> proofs;
  std::mutex writing;
  std::ofstream out(options.out, std::ios::app);
  in_parallel(options.jobs, count, [&](std::size_t k, auto& folder) {
    ProofRequest request = options.request;
    request.cause = causes[k % causes.size()];
    request.seed += k / causes.size();
    auto proof = prove(request, folder);
    const std::lock_guard lock(writing);
    if (out) out << to_json(proof).dump() << std::endl;
    proofs.push_back(std::move(proof));
  });
  return proofs;
}

std::vector<Proof> read(const std::vector<std::string>& files) {
  std::vector<Proof> proofs;
  for (const auto& file : files) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) proofs.push_back(proof_from_json(nlohmann::json::parse(line)));
  }
  return proofs;
}

}  // namespace

int main(int argc, char** argv) {
  backwash::services::Command app{
      "Simulated against measured flights before and after an extension, over worlds with a hidden effect",
      "study_simulation"};
  Options options;
  options.request.seed = 90001;
  app.add_option("--worlds", options.worlds, "per cause").capture_default_str();
  app.add_option("--seed", options.request.seed, "of the first world").capture_default_str();
  app.add_option("--cause", options.causes, "hidden causes; default: all");
  app.add_option("--flights", options.request.flights, "studied, and as many further ones").capture_default_str();
  app.add_option("--held-out", options.request.held_out, "further ones that are simulated").capture_default_str();
  app.add_option("--replicas", options.request.replicas, "flights with other gusts").capture_default_str();
  app.add_option("--jobs", options.jobs).capture_default_str();
  app.add_option("--out", options.out, "JSON lines, appended to");
  app.add_option("--from", options.from, "JSON lines of earlier runs instead of new worlds");
  if (const auto code = app.parse(argc, argv)) return *code;
  std::fputs(proof_table(options.from.empty() ? run(options) : read(options.from)).c_str(), stdout);
  return 0;
}
