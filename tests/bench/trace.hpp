// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <istream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::autopilots {

/// A row of a trace (tests/autopilots/README.md).
struct Row {
  double t = 0;  ///< s
  std::string who, what;
  std::vector<double> values;
};

/// What is read off a trace, the same for a recorded one and for a profile's own. Times are s; a figure that the trace
/// does not contain is nothing.
class Trace {
 public:
  explicit Trace(std::istream& csv);

  const std::vector<Row>& rows() const { return rows_; }
  using Maybe = std::optional<double>;

  /// When the n-th row with this `who` and `what` came (0: the first), whose first values are these, not before
  /// `after`.
  Maybe at(const std::string& who, const std::string& what, const std::vector<double>& values = {}, double after = 0,
           int n = 0) const;
  Maybe note(const std::string& line, double after = 0) const { return at("note", line, {}, after); }
  Maybe armed() const { return at("in", "COMMAND_ACK", {400, 0}); }

  /// Truth between its rows, linearly: position (0–2) and velocity (3–5), east, north, up.
  double truth(double t, std::size_t column) const;
  Vec3 position(double t) const { return {truth(t, 0), truth(t, 1), truth(t, 2)}; }
  Vec3 velocity(double t) const { return {truth(t, 3), truth(t, 4), truth(t, 5)}; }
  /// When the truth first rises through (or falls through, `falling`) a value, after a time.
  Maybe crosses(std::size_t column, double value, double after, bool falling = false) const;
  /// Of the truth at its rows in [from, to]: the largest of f(t).
  double most(double from, double to, const std::function<double(double)>& f) const;

  /// How far it goes on along its velocity at t; how long until that part of the velocity is below `slow`, m/s.
  struct RunOut {
    double distance, time;
  };
  RunOut run_out(double t, double until, double slow = 0.1) const;

  /// Rows of one kind as text, equal neighbours once: what was said, in order.
  std::vector<std::string> said(const std::string& who, const std::string& what, double from = 0) const;

 private:
  std::vector<Row> rows_;
  std::vector<std::size_t> truth_;  // rows of the truth
};

}  // namespace backwash::autopilots
