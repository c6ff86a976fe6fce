// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/remedy.hpp"

#include <cmath>
#include <cstdio>

#include "core/study/effects/effect.hpp"

namespace backwash::study {

const char* to_string(RemedyIn in) noexcept {
  switch (in) {
    case RemedyIn::vehicle:
      return "vehicle";
    case RemedyIn::model:
      return "model";
    case RemedyIn::map:
      return "map";
    case RemedyIn::craft:
      return "craft";
    case RemedyIn::place:
      return "place";
  }
  return "";
}

Remedy by_extension(const FittedForm& fitted) {
  return {RemedyIn::model, {}, "Fly with the model that --out writes: it holds " + fitted.form.cause() + "."};
}

Remedy with_craft(std::string words) { return {RemedyIn::craft, {}, std::move(words)}; }

Remedy in_vehicle(std::vector<Remedy::Set> set) {
  std::string words;
  for (const auto& [key, from, to] : set) {
    char text[128];
    std::snprintf(text, sizeof text, "%s %s from %.3g to %.3g", words.empty() ? "Change" : " and", key.c_str(), from,
                  to);
    words += text;
  }
  return {RemedyIn::vehicle, std::move(set), words + " in the vehicle file."};
}

std::string rotor_of(const FittedForm& fitted) {
  return "rotor " + std::to_string(std::lround(fitted.scale.value) + 1);
}

}  // namespace backwash::study
