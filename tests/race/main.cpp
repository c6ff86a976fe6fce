// SPDX-License-Identifier: BSD-3-Clause
// What keeps clear best, over the vehicles that people have: README.md.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/race/race.hpp"

namespace {

int usage() {
  std::fprintf(
      stderr,
      "usage: race fly|draw|count FILE ROUNDS PAIRS [MAP [VEHICLE]] | sieve FILE FOLDER|places | factors FOLDER | "
      "real FOLDER\n");
  return 64;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace backwash::race;
  const std::string verb = argc > 1 ? argv[1] : "";
  const auto count = [&](int n) { return static_cast<std::size_t>(std::atoi(argv[n])); };
  if ((verb == "fly" || verb == "draw" || verb == "count") && argc >= 5)
    return fly_all(argv[2], count(3), count(4), {argc > 5 ? argv[5] : "", argc > 6 ? argv[6] : ""},
                   verb == "fly"    ? Flights::all
                   : verb == "draw" ? Flights::drawn
                                    : Flights::counted);
  if (verb == "sieve" && argc == 4) return sieve(argv[2], argv[3]);
  if (verb == "factors" && argc == 3) return print_factors(argv[2]);
  if (verb == "real" && argc == 3) return judge_real_flights(argv[2]);
  return usage();
}
