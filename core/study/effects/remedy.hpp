// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace backwash::study {

struct FittedForm;

/// Where a remedy is made: in a file, in the craft itself or in the place where it flies.
enum class RemedyIn : std::uint8_t { vehicle, model, map, craft, place };
/// "vehicle" …, as written above.
const char* to_string(RemedyIn in) noexcept;

/// What an engineer changes where a cause is found: a key of a file with its value, or what to do with the craft.
struct Remedy {
  struct Set {
    std::string key;  ///< of the file: "controller.latency"
    double from, to;  ///< in the unit of docs/interfaces.md
  };
  RemedyIn in;
  std::vector<Set> set = {};  ///< of the vehicle file; empty otherwise
  std::string words;          ///< one sentence, an order
};

/// The model that `backwash study --out` writes has it.
Remedy by_extension(const FittedForm& fitted);
Remedy with_craft(std::string words);
Remedy in_vehicle(std::vector<Remedy::Set> set);
/// "rotor 3"; of a form whose scale is a rotor's number.
std::string rotor_of(const FittedForm& fitted);

}  // namespace backwash::study
