// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rules.hpp"

#include "core/study/effects/effect_rules.hpp"
#include "core/study/effects/prior_rules.hpp"
#include "core/study/inference/rotors/rotor_rules.hpp"
#include "core/study/windows/gates/window_rules.hpp"

namespace backwash::study {
std::vector<Rule> rules() {
  std::vector<Rule> told;
  append_rules(told, kRules);
  append_rules(told, kRotorRules);
  append_rules(told, kWindowRules);
  append_rules(told, kEffectRules);
  append_rules(told, kPriors);
  return told;
}

}  // namespace backwash::study
