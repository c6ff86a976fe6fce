// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/study/inference/amplitudes.hpp"

/// Two levels of a form among the flights: whether, where, and by how much they differ.
namespace backwash::study {

/// A form along one direction of its parameters: what is asked.
struct Asked {
  const Amplitudes* amplitudes;
  SmallVector direction;
};

/// Each parameter by itself; of a one-sided form the first alone.
std::vector<SmallVector> directions(const Amplitudes& amplitudes);

/// Windows [begin, end) of one unit, on one level.
struct Segment {
  std::size_t unit, begin, end;
  bool acting;
  double weight = 0;  ///< of its level among the others'
};

/// Two levels along what is asked, and the scatter of flights about them.
struct Finding {
  Asked asked;
  double p = 1, low = 0, high = 0, spread = 0, inflation = 1;
};

/// Flights on two levels (two_levels.hpp). p is of this question alone, over all divisions.
Finding across(const Asked& asked);
/// A step within one flight; p over all steps of all flights. The scatter between flights is that about their median.
Finding within(const Asked& asked);

/// Parameters of the segments that act and of the others, and the standard error of their difference, from the scatter
/// of segments about both; degrees of freedom of that.
struct Difference {
  SmallVector sound, acting, error;
  double degrees = 0;
  SmallVector value() const { return acting - sound; }
};
/// Nothing where one level has no segment that tells the parameters.
std::optional<Difference> difference(const Amplitudes& amplitudes, const std::vector<Segment>& segments);

/// Nats that a division costs: ln of how many flights could be divided so, and step_price for each step within one.
double price(const std::vector<Segment>& segments);
/// Nats by which windows are likelier with the difference, by their own noise, less the price of its parameters and of
/// the division.
double gain(const Amplitudes& amplitudes, const std::vector<Segment>& segments, const SmallVector& difference);

/// A finding, along the direction in which its levels differ, and the segments on either.
struct Located {
  Finding finding;
  std::vector<Segment> segments;
  Difference difference;
};
/// Nothing where the levels' difference is below what the form calls an effect, or, of damage of one sign, where no
/// flight was sound all along.
std::optional<Located> located(Finding finding, const Observations& seen);

/// Whether what was called sound is the odd level: farther from what the simulation says than craft are built, in fewer
/// flights, not in the first one. Never of a one-sided form.
bool sound_is_odd(const Located& located);

}  // namespace backwash::study
