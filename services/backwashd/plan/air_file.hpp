// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <string>

#include "core/types/air_class.hpp"

namespace backwash::daemon {

struct Controlled;

/// Keeps what flights have learnt of their air over restarts: the factors by class, for the vehicle and model file that
/// they were learnt with. A file takes the place of the one before when it is whole. Nothing here is real-time.
class AirFile {
 public:
  /// Reads the file, if there is one. `files`: config::hash_of_files(). One that is damaged is told and moved to
  /// PATH.damaged: then all begins as modelled. Throws StartError naming the file: of another vehicle or model file, no
  /// regular file, or one that cannot be written.
  AirFile(std::string path, std::uint64_t files);
  /// What a flight begins with, each ≥ 1.
  const AirFactors& start() const noexcept { return start_; }
  /// Writes factors. False: the disk did not take them, and the file holds what it held.
  bool keep(const AirFactors& factors) const;

 private:
  std::string path_;
  std::uint64_t files_;
  AirFactors start_ = kModelledAir;
};

/// Thread body, of a thread of its own because a disk may hang: keeps each set of factors that the control thread hands
/// over until `end`; a disk that does not take them is told once.
void run_air_file(const AirFile& file, Controlled& channels, const std::atomic<bool>& end);

}  // namespace backwash::daemon
