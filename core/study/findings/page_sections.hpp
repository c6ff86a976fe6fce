// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/report/page/page.hpp"
#include "core/report/page/page_data.hpp"
#include "core/study/calibrate/height_effect.hpp"
#include "core/study/inference/rotors/rotor_reference.hpp"
#include "core/study/windows/observation.hpp"

namespace backwash::study {

/// A name of the catalogue as people write it: "wall attraction"; a parameter: "A, m/s²".
std::string spoken(std::string name);
/// Three digits.
std::string number(double value);
using report::row;

/// Why no cause is named: how many flights (or groups of them) have good windows, how many are needed, and what was
/// left out of the others.
std::string too_few(const Observations& seen);

/// What the motor shares say against those of sound flights, in a sentence, and as a section of the page: what every
/// rotor would need more, beside the smallest need that would be named; its table comes into `data`.
std::string rotor_sentence(const RotorVerdict& verdict);
std::string rotor_section(const RotorVerdict& verdict, report::PageData& data);

/// Ratios of the vertical variance by height and plate, of all windows and of hovers alone; and, in a sentence, those
/// of the hovers that differ from 1 (empty if none does).
std::string height_sentence(const calibrate::HeightEffects& effects);
std::string height_section(const calibrate::HeightEffects& effects);

}  // namespace backwash::study
