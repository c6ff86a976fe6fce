// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/changes/acting.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace backwash::study {
namespace {

constexpr auto kSide = static_cast<std::size_t>(kRules.side_windows.value);

/// Every parameter of the form, fitted to a profile over the flights that tell it.
struct Fit {
  SmallVector added, error, level, level_error;
  double degrees = 1;
};

std::vector<std::size_t> told_units(const Amplitudes& a) {
  std::vector<std::size_t> units;
  for (std::size_t u = 0; u < a.units(); ++u)
    if (a.level(u)) units.push_back(u);
  return units;
}

/// All rows of a profile together; a Fit each.
std::vector<Fit> fit(const Amplitudes& a, const Division& division, const std::vector<std::size_t>& units) {
  const auto p = static_cast<Eigen::Index>(a.columns().size()), n = static_cast<Eigen::Index>(units.size());
  const SmallVector none = SmallVector::Zero(p);
  std::vector<Fit> fits(static_cast<std::size_t>(division.profile.rows()), {none, none, none, none});
  for (Eigen::Index k = 0; k < p; ++k) {
    FlightValues values{Eigen::MatrixXd(1, n), Eigen::VectorXd(n)};
    for (Eigen::Index f = 0; f < n; ++f) {
      const auto told = *a.level(units[static_cast<std::size_t>(f)]);
      values.of(0, f) = told.theta[k];
      values.error2[f] = told.error2[k];
    }
    const Division own = division_of(values, division.when, division.profile);
    for (std::size_t row = 0; row < fits.size(); ++row) {
      const auto r = static_cast<Eigen::Index>(row);
      fits[row].added[k] = own.added(0, r);
      fits[row].error[k] = own.error[r];
      fits[row].level[k] = own.level[0];
      fits[row].level_error[k] = own.level_error;
      fits[row].degrees = own.degrees;
    }
  }
  return fits;
}

/// Nats by which a flight steps by θ at a window rather than nowhere, its level free.
double step_nats(const Amplitudes& a, std::size_t unit, std::size_t at, const SmallVector& theta) {
  const auto step = a.step(unit, at);
  if (!step) return 0;
  double nats = 0;
  for (Eigen::Index k = 0; k < theta.size(); ++k) {
    const double with = step->theta[k] - theta[k];
    nats += (step->theta[k] * step->theta[k] - with * with) / (2 * step->error2[k]);
  }
  return nats;
}

/// Window at which what begins (or ends, by −θ) between two flights does so within one of them; else where the later
/// one begins.
std::size_t edge(const Amplitudes& a, std::size_t before, std::size_t after, const SmallVector& theta) {
  std::size_t at = a.begin(after), tried = 0;
  double most = 0;
  for (const std::size_t unit : {before, after})
    for (std::size_t i = a.begin(unit) + kSide; i + kSide <= a.end(unit); ++i, ++tried)
      if (const double nats = step_nats(a, unit, i, theta); nats > most) {
        most = nats;
        at = i;
      }
  return most > std::log(static_cast<double>(std::max<std::size_t>(tried, 1))) + kRules.rival_nats ? at
                                                                                                   : a.begin(after);
}

/// Amount per window of one row of a profile of 0 and 1.
std::vector<double> amounts(const Amplitudes& a, const Eigen::RowVectorXd& profile,
                            const std::vector<std::size_t>& units, std::size_t windows) {
  std::vector<double> amount(windows, 0);
  std::size_t k = 0;
  for (std::size_t u = 0; u < a.units(); ++u) {  // a flight that does not tell it is as the one before it
    while (k + 1 < units.size() && units[k + 1] <= u) ++k;
    std::fill(amount.begin() + static_cast<std::ptrdiff_t>(a.begin(u)),
              amount.begin() + static_cast<std::ptrdiff_t>(a.end(u)), profile[static_cast<Eigen::Index>(k)]);
  }
  return amount;
}

/// Moves the steps of a profile between flights to where they lie within one.
void within_flights(const Amplitudes& a, const Eigen::RowVectorXd& profile, const std::vector<std::size_t>& units,
                    const SmallVector& theta, std::vector<double>& amount) {
  for (std::size_t k = 0; k + 1 < units.size(); ++k) {
    const double rise = profile[static_cast<Eigen::Index>(k + 1)] - profile[static_cast<Eigen::Index>(k)];
    if (rise == 0) continue;
    const std::size_t before = units[k], after = units[k + 1], at = edge(a, before, after, rise * theta);
    for (std::size_t i = a.begin(before); i < a.end(after); ++i)
      if (i >= at) {
        if (i < a.end(before) || i >= a.begin(after)) amount[i] = rise > 0 ? 1 : 0;
      } else if (i >= a.begin(after)) {
        amount[i] = rise > 0 ? 0 : 1;
      }
  }
}

/// Whether the flights that are called acting are those as the simulation has them: the other level is then what acts.
bool is_odd(const Amplitudes& a, const Fit& f, const Eigen::RowVectorXd& profile) {
  const Channel c = a.columns().front().parts.front().channel;
  const SmallVector acting = f.level + f.added;
  if (a.form().one_sided) return f.added[0] < 0;
  if (c >= kLine1) {
    const double built = c >= kMotor1 && c <= kRpm4 ? kRules.sound_spread.value : a.form().floor + a.form().least;
    const double share = profile.mean();
    return (f.level.squaredNorm() - acting.squaredNorm()) / (2 * built * built) + std::log(share / (1 - share)) +
               (profile[0] > 0 ? 1 : -1) * kRules.sound_first >
           0;
  }
  return acting.norm() < f.level.norm() && acting.norm() < student_975(f.degrees) * f.error.norm();
}

}  // namespace

std::vector<DesignColumn> masked(std::vector<DesignColumn> columns, const std::vector<double>& amount) {
  for (auto& column : columns)
    for (auto& part : column.parts)
      for (std::size_t i = 0; i < amount.size(); ++i) part.x[i] *= amount[i];
  return columns;
}

std::vector<ActingFlight> flights_of(const std::vector<double>& amount, const Observations& seen) {
  std::vector<ActingFlight> flights;
  for (std::size_t f = 0; f < seen.flights; ++f) {
    std::size_t begin = seen.first[f], end = seen.first[f + 1];
    while (begin < end && amount[begin] == 0) ++begin;
    while (end > begin && amount[end - 1] == 0) --end;
    if (begin == end) continue;
    flights.push_back({f});
    const auto &from = seen.windows[begin], &to = seen.windows[end - 1];
    if (begin > seen.first[f]) flights.back().since_s = from.t - from.duration / 2;
    if (end < seen.first[f + 1]) flights.back().until_s = to.t + to.duration / 2;
  }
  return flights;
}

std::vector<Acting> acting_of(const Amplitudes& a, const Division& division, std::size_t at, const Observations& seen) {
  const std::size_t windows = seen.windows.size();
  if (division.when == When::moment) {
    Acting one{
        std::vector<double>(windows, 0), SmallVector::Zero(static_cast<Eigen::Index>(a.columns().size())), {}, 1};
    one.error = one.theta;
    std::vector<Amplitudes::Told> steps;
    for (std::size_t u = 0; u < a.units(); ++u) {
      for (std::size_t i = a.begin(u) + at; i < a.end(u); ++i) one.amount[i] = 1;
      if (a.begin(u) + at + kSide <= a.end(u))
        if (auto step = a.step(u, a.begin(u) + at)) steps.push_back(*step);
    }
    if (static_cast<double>(steps.size()) < kRules.fewest_divided) return {};
    for (Eigen::Index k = 0; k < one.theta.size(); ++k) {
      FlightValues values{Eigen::MatrixXd(1, static_cast<Eigen::Index>(steps.size())),
                          Eigen::VectorXd(static_cast<Eigen::Index>(steps.size()))};
      for (std::size_t s = 0; s < steps.size(); ++s) {
        values.of(0, static_cast<Eigen::Index>(s)) = steps[s].theta[k];
        values.error2[static_cast<Eigen::Index>(s)] = steps[s].error2[k];
      }
      const Division own = moment(values, 1);
      one.theta[k] = own.added(0, 0);
      one.error[k] = own.error[0];
      one.degrees = own.degrees;
    }
    one.stands_on = true;
    return {one};
  }
  const auto units = told_units(a);
  if (static_cast<Eigen::Index>(units.size()) != division.profile.cols()) return {};  // another scale tells others
  auto fits = fit(a, division, units);
  std::vector<Acting> all;
  for (std::size_t row = 0; row < fits.size(); ++row) {
    Eigen::RowVectorXd profile = division.profile.row(static_cast<Eigen::Index>(row));
    Fit& f = fits[row];
    Acting one{amounts(a, profile, units, windows), f.added, f.error, f.degrees};
    const bool steps = division.when == When::from || division.when == When::run || division.when == When::steps;
    if (steps && seen.units.size() == seen.flights) within_flights(a, profile, units, f.added, one.amount);
    if (division.profile.rows() == 1 && division.when != When::growing && is_odd(a, f, profile)) {
      for (double& x : one.amount) x = 1 - x;
      one.theta = -f.added;
      f.level += f.added;
      f.level_error = f.error;
    }
    one.stands_on = a.columns().front().parts.front().channel >= kLine1 ||
                    f.level.norm() > student_975(f.degrees) * f.level_error.norm();
    all.push_back(std::move(one));
  }
  return all;
}

}  // namespace backwash::study
