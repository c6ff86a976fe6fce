// SPDX-License-Identifier: BSD-3-Clause
// adapt_gate [--flights N] [--seconds S] [--seed N] [--jobs N]: how often calm air is called rougher, and how soon
// rough air is.
#include <algorithm>
#include <atomic>
#include <boost/math/distributions/beta.hpp>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "services/command_line/command_line.hpp"
#include "tests/gusts/flights.hpp"

namespace {

using namespace gusts;

constexpr double kMostAlarms = 0.012, kMiddle = 1.5, kSlow = 4;  // of all flights; s of exposure, p50 and p90
// s; the calibration of 24 flights told 0.147 [0.146, 0.149]
constexpr double kTauLow = 0.14, kTauHigh = 0.16;

std::vector<Learned> fly_all(const std::vector<Trial>& trials, int jobs) {
  std::vector<Learned> learned(trials.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t k = next++; k < trials.size(); k = next++) learned[k] = fly(trials[k]);
  };
  std::vector<std::thread> others;
  for (int k = 1; k < jobs; ++k) others.emplace_back(work);
  work();
  for (auto& other : others) other.join();
  return learned;
}

/// Upper end of the one-sided 95 % interval of a share (Clopper and Pearson).
double upper(std::size_t alarms, std::size_t flights) {
  if (alarms >= flights) return 1;
  const double k = static_cast<double>(alarms), n = static_cast<double>(flights);
  return boost::math::quantile(boost::math::beta_distribution<>(k + 1, n - k), 0.95);
}

struct Air {
  std::string name;
  double ln_kurtosis, rate_hz, noise, push;  ///< ln of the kurtosis over 3, Hz, m/s², m/s²
};
const std::vector<Air> kAirs{{"Gaussian", 0, 50, 0, 0},
                             {"heavy tails", 0.4, 50, 0, 0},
                             {"Gaussian, noise, push", 0, 50, 0.04, 0.05},
                             {"heavy, noise, push", 0.4, 50, 0.04, 0.05},
                             {"Gaussian, 10 Hz", 0, 10, 0, 0},
                             {"Gaussian, 200 Hz", 0, 200, 0, 0},
                             {"heavy, 100 Hz, push", 0.4, 100, 0, 0.05}};

Trial trial_of(const Air& air, Form form, bool told, std::uint64_t seed, std::size_t number) {
  Trial trial;
  trial.form = form, trial.rate_hz = air.rate_hz, trial.noise = air.noise, trial.jitter = 0.1, trial.push = air.push;
  trial.bursts.ln_kurtosis = air.ln_kurtosis;
  trial.form_told = told;
  trial.tau_low_s = kTauLow, trial.tau_high_s = kTauHigh;
  trial.tau_s = kTauLow + (kTauHigh - kTauLow) * std::fmod(0.618034 * static_cast<double>(number), 1.0);
  trial.seed = seed + number;
  return trial;
}

/// One flight without a change, the `number`-th of all airs and forms in turn, as a line of JSON.
void print_row(bool told, double seconds, std::uint64_t seed, std::size_t number) {
  const std::size_t air = number / kForms.size() % kAirs.size(), form = number % kForms.size();
  auto trial = trial_of(kAirs[air], kForms[form], told, seed, number);
  trial.seconds = seconds;
  const auto learned = fly(trial);
  std::printf("{\"number\": %zu, \"air\": \"%s\", \"form\": \"%s\", \"alarm\": %s}\n", number, kAirs[air].name.c_str(),
              kFormNames[form], learned.alarm_s ? "true" : "false");
}

bool null_gate(bool told, std::size_t flights, double seconds, std::uint64_t seed, int jobs) {
  std::size_t all = 0, alarms_all = 0, number = 0;
  std::printf("no change, tau 0.14 ... 0.16 s, %.0f s\n%-26s%-14s%8s%8s%10s%10s\n", seconds, "air", "form", "flights",
              "alarms", "share", "95 % <=");
  for (const Air& air : kAirs)
    for (const Form form : kForms) {
      std::vector<Trial> trials;
      for (std::size_t k = 0; k < flights / (kAirs.size() * kForms.size()) + 1; ++k) {
        trials.push_back(trial_of(air, form, told, seed, number++));
        trials.back().seconds = seconds;
      }
      const auto learned = fly_all(trials, jobs);
      const auto alarms =
          static_cast<std::size_t>(std::ranges::count_if(learned, [](const auto& l) { return l.alarm_s.has_value(); }));
      std::printf("%-26s%-14s%8zu%8zu%10.4f%10.4f\n", air.name.c_str(), kFormNames[static_cast<std::size_t>(form)],
                  trials.size(), alarms, static_cast<double>(alarms) / static_cast<double>(trials.size()),
                  upper(alarms, trials.size()));
      all += trials.size(), alarms_all += alarms;
    }
  const double share = static_cast<double>(alarms_all) / static_cast<double>(all);
  std::printf("all: %zu of %zu, %.4f, upper 95 %% limit %.4f; asked: at most %.4f: %s\n", alarms_all, all, share,
              upper(alarms_all, all), kMostAlarms, share <= kMostAlarms ? "held" : "MISSED");
  return share <= kMostAlarms;
}

struct Change {
  const char* name;
  double factor, since_s;
  bool walls_only;
};
constexpr Change kChanges[] = {{"x2 from take-off", 2, 0, false}, {"x2 from 60 s", 2, 60, false},
                               {"x2 near walls", 2, 0, true},     {"x4 from take-off", 4, 0, false},
                               {"x4 from 60 s", 4, 60, false},    {"x1.5 from take-off", 1.5, 0, false}};

bool power_gate(bool told, std::size_t flights, std::uint64_t seed, int jobs) {
  bool held = true;
  std::printf("\ns of exposure until it is called rougher\n%-22s%-26s%-14s%8s%8s%8s%10s\n", "change", "air", "form",
              "found", "p50", "p90", "factor p50");
  for (const Change& change : kChanges)
    for (const Air& air : kAirs)
      for (const Form form : kForms) {
        std::vector<Trial> trials;
        for (std::size_t k = 0; k < flights; ++k) {
          auto trial = trial_of(air, form, told, seed, k);
          trial.factor = change.factor, trial.since_s = change.since_s, trial.walls_only = change.walls_only;
          trial.seconds = change.since_s + (change.walls_only ? 60 : 24);
          trials.push_back(trial);
        }
        std::vector<double> exposed, factors;
        std::size_t found = 0;
        for (const auto& learned : fly_all(trials, jobs)) {
          found += learned.exposed_s.has_value();
          exposed.push_back(learned.exposed_s.value_or(INFINITY)), factors.push_back(learned.factor);
        }
        std::ranges::sort(exposed), std::ranges::sort(factors);
        const double p50 = exposed[exposed.size() / 2], p90 = exposed[exposed.size() * 9 / 10];
        const bool good = change.factor != 2 || (p50 <= kMiddle && p90 <= kSlow);
        held = held && good;
        std::printf("%-22s%-26s%-14s%8zu%8.2f%8.2f%10.2f%s\n", change.name, air.name.c_str(),
                    kFormNames[static_cast<std::size_t>(form)], found, p50, p90, factors[factors.size() / 2],
                    good ? "" : "  MISSED");
      }
  return held;
}

/// Calmer air (docs/model.md 7-9): how far down it is told to be by when, and in how many flights not above what it is.
bool calm_gate(bool told, std::size_t flights, std::uint64_t seed, int jobs) {
  const std::vector<double> at{120, 300, 600, 1200};
  std::size_t all = 0, wrong_all = 0, all_null = 0, wrong_null = 0;
  std::printf(
      "\ntold calmer: flights, and median of what it is told to be below (2: nothing), after s\n%-8s%-26s%-14s%8s",
      "truly", "air", "form", "flights");
  for (const double t : at) std::printf("%12.0f", t);
  std::printf("%8s\n", "wrong");
  for (const double truly : {1.0, 0.5, 0.4, 0.2, 0.1})
    for (const Air& air : kAirs)
      for (const Form form : kForms) {
        std::vector<Trial> trials;
        for (std::size_t k = 0; k < flights; ++k) {
          trials.push_back(trial_of(air, form, told, seed, k));
          trials.back().factor = truly, trials.back().seconds = at.back(), trials.back().at_s = at;
        }
        seed += flights;
        const auto learned = fly_all(trials, jobs);
        std::printf("%-8g%-26s%-14s%8zu", truly, air.name.c_str(), kFormNames[static_cast<std::size_t>(form)], flights);
        for (std::size_t n = 0; n < at.size(); ++n) {
          std::vector<double> below;
          for (const auto& l : learned) below.push_back(l.calmer_at[n]);
          std::ranges::sort(below);
          std::printf("%5td %6.2f", std::ranges::count_if(below, [](double b) { return b <= 1; }),
                      below[below.size() / 2]);
        }
        const auto wrong = static_cast<std::size_t>(
            std::ranges::count_if(learned, [&](const Learned& l) { return l.calmer.value_or(2) <= truly; }));
        std::printf("%8zu\n", wrong);
        std::fflush(stdout);
        all += flights, wrong_all += wrong;
        if (truly == 1) all_null += flights, wrong_null += wrong;
      }
  const double share = static_cast<double>(wrong_all) / static_cast<double>(all);
  std::printf("as modelled, of %.0f s: %zu of %zu told calmer, upper 95 %% limit %.4f\n", at.back(), wrong_null,
              all_null, upper(wrong_null, all_null));
  std::printf("all: %zu of %zu wrong, upper 95 %% limit %.4f; asked: at most %.4f: %s\n", wrong_all, all,
              upper(wrong_all, all), kMostAlarms, share <= kMostAlarms ? "held" : "MISSED");
  return share <= kMostAlarms;
}

}  // namespace

int main(int argc, char** argv) {
  backwash::services::Command app{"How often calm air is called rougher, and how soon rough air is", "adapt_gate"};
  std::size_t flights = 10000, changed = 100, calmer = 0;
  double seconds = 120;
  std::uint64_t seed = 20261123;
  int jobs = 2;
  bool told = false;
  std::optional<std::uint64_t> row;
  app.add_flag("--form-told", told, "the form of the gusts is known");
  app.add_option("--flights", flights, "without a change").capture_default_str();
  app.add_option("--changed", changed, "flights of each cell with one").capture_default_str();
  app.add_option("--calmer", calmer, "nothing but so many flights of 1200 s of each cell in calmer air");
  app.add_option("--seconds", seconds, "of a flight without a change").capture_default_str();
  app.add_option("--seed", seed, "of the first flight").capture_default_str();
  app.add_option("--jobs", jobs, "threads").capture_default_str();
  app.add_option("--row", row, "only the flight without a change of this number, as a line of JSON");
  if (const auto code = app.parse(argc, argv)) return *code;
  if (row) return print_row(told, seconds, seed, *row), 0;
  std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  if (calmer > 0) return calm_gate(told, calmer, seed, jobs) ? 0 : 1;
  const bool null = null_gate(told, flights, seconds, seed, jobs);
  const bool power = power_gate(told, changed, seed + 1000000, jobs);
  return null && power ? 0 : 1;
}
