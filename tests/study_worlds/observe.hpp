// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>

#include "core/study/findings/study.hpp"
#include "core/study/windows/observer.hpp"
#include "tests/study_worlds/world.hpp"

namespace study_worlds {

/// What the study sees of a world: its logs (never written), its map and vehicle files (in `folder`), the model's name.
backwash::study::Observations observe(const HiddenWorld& world, const std::filesystem::path& folder);

backwash::study::Observations observe(const HiddenWorld& world, const std::vector<Table>& flights,
                                      const std::filesystem::path& folder);

/// `first`, and then one flight more at a time, up to `most`: flight(n), n from 1, until look(what is seen) says that
/// it is enough. How many were flown; most + 1 if it never was.
int observe_further(const HiddenWorld& world, const std::vector<Table>& first, const std::filesystem::path& folder,
                    int most, const std::function<Table(int)>& flight,
                    const std::function<bool(const backwash::study::Observations&)>& look);

/// What six sound flights of the world's craft say of its rotors.
backwash::study::SoundRotors sound_rotors(const HiddenWorld& world, const std::filesystem::path& folder);
/// Of a study that is given these.
backwash::study::StudyOptions with_reference(const HiddenWorld& world, const std::filesystem::path& folder);

/// Per told cause its name, then its rivals.
std::vector<std::vector<std::string>> sets_of(const backwash::study::StudyResult& result);
/// "ceiling", "trim|draft" for a set, "a + b" for two causes, "?z_m" for unknown structure, "nothing".
std::string told(const std::vector<std::vector<std::string>>& sets, const std::vector<std::string>& unknown);
std::string told(const backwash::study::StudyResult& result);

}  // namespace study_worlds
