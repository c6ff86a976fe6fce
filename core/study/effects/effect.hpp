// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/study/effects/prior_rules.hpp"
#include "core/study/windows/observation.hpp"
#include "core/types/model.hpp"
#include "core/types/simulation_term.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::study {

/// One regressor: its value on each window, in the channels that it moves.
struct DesignColumn {
  struct Part {
    Channel channel;
    std::vector<double> x;
    /// A by-product of what moves other channels: no evidence of the form's error here.
    bool aside = false;
  };
  std::vector<Part> parts;
};

/// Calls take(channel, window, θ x) for every value of columns, θ one for each.
template <typename Theta, typename F>
void each_value(std::span<const DesignColumn> columns, const Theta& theta, F take) {
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& part : columns[k].parts)
      for (std::size_t i = 0; i < part.x.size(); ++i) take(part.channel, i, theta[k] * part.x[i]);
}

using Windows = std::vector<WindowRow>;

/// A parameter with its interval at 95 %.
struct Estimate {
  std::string name;
  double value, low, high;
};

/// A variable that a cause is told or drawn along; circular: an angle, rad.
struct Regressor {
  std::string name;
  bool circular = false;
  std::function<double(const WindowRow&)> value;
};

/// What a form takes that it is not linear in: a length, a time, the number of a rotor; for a displaced map the level
/// offset instead.
struct Scale {
  double value = 0;
  Vec3 offset_W = Vec3::Zero();  ///< m
  /// What the columns take from the windows that they were fitted to (Form::anchor): other windows have others. Empty:
  /// from the windows at hand.
  std::vector<double> anchor = {};
};
/// Scales without an offset.
std::vector<Scale> scales_of(std::initializer_list<double> values);

/// A flight that could be flown next: the windows it would give, made from a median window of the flights at hand.
struct Manoeuvre {
  std::string name;
  std::function<void(WindowRow&, double s)> set;  ///< s: 0 … 1 along the flight
};

struct Effect;
struct Form;

/// How far a push by distance can reach. One that the flights would draw out farther is none of this effect: what
/// they show along `regressor` has no name.
struct Reach {
  double most;  ///< of the lower end of the scale's interval, m
  std::string regressor, reason;
};

/// Where the size is stated, and what of it a window flew: outside of that range the size is an extrapolation.
struct Reference {
  double value;
  std::string unit;
  std::function<double(const WindowRow&)> flown;
};

/// An accepted form as it was fitted.
struct FittedForm {
  const Form& form;
  Scale scale;
  const std::vector<DesignColumn>& columns;
  std::span<const double> theta;            ///< one per column
  const std::vector<Estimate>& parameters;  ///< of all shapes, at the form's reference
  std::span<const double> beside = {};      ///< of the form's companions, one each
};

/// One physical form of an effect, linear in its parameters at a given scale.
struct Form {
  std::string formula;                      ///< what is added to which channel
  std::vector<std::string> parameters;      ///< one per column, unit in the name
  std::vector<Prior> priors = {};           ///< one for each parameter
  std::optional<Reference> reference = {};  ///< without one the size is that of what was flown
  std::string scale_name = {};              ///< "L_m" …; empty without a scale
  std::vector<Scale> scales = {Scale()};
  std::optional<Reach> reach = {};
  bool integer_scale = false;      ///< a number of a rotor or pairing, or an offset of its own search: not polished
  bool displaces_map = false;      ///< its scale is an offset, fitted along x and y
  bool constant = false;           ///< is itself what a free offset would be: tested without one
  bool in_sensor = false;          ///< is told by a sensor and pushes nothing
  bool by_place = false;           ///< a push that differs by place: it moves the craft in itself
  bool by_size = false;            ///< its size (Scale::anchor) changes its columns
  double floor = 0;                ///< least root mean square over the flown windows that is called an effect
  double least = 0;                ///< least magnitude of the first parameter that is called an effect
  bool one_sided = false;          ///< the first parameter cannot be negative
  std::vector<Source> needs = {};  ///< what the logs must hold, in the order in which a lack is told
  /// Why these flights cannot show it though the logs hold all that it needs; nothing if they can.
  std::function<std::optional<std::string>(const Observations&)> not_flown = {};
  /// Half the range, in the first parameter's unit, in which the logs alone cannot tell the value.
  std::function<double(const Observations&)> unknowable = [](const Observations&) { return 0.0; };
  std::function<std::vector<DesignColumn>(const Windows&, const Scale&)> columns = {};
  /// What it leaves open and no other cause may claim: the voltage at which the thrust is as modelled, the bias at
  /// which a drift begins.
  std::function<std::vector<DesignColumn>(const Windows&)> companions = {};
  /// What `columns` take from the windows themselves and a later study must be told (Scale::anchor).
  std::function<std::vector<double>(const Windows&)> anchor = {};
  /// Other shapes, in the literature as good as this one: the same parameters at the same reference. They take no part
  /// in the search; estimates are averaged over them (estimate.hpp).
  std::vector<Form> shapes = {};
  /// What it adds to the model for field, reach and plan (core/study/README.md, "Extension"); without it nothing.
  std::function<std::vector<ModelEffect>(const FittedForm&, const Observations&)> extend = {};
  /// What it adds to the simulation (core/sim); every form has one.
  std::function<std::vector<SimulationTerm>(const FittedForm&, const Observations&)> simulate = {};
  const Effect* effect = nullptr;  ///< whose form it is; set by the table

  /// What words and figures say of a parameter by its fitted number, one for each, rising; empty: the number itself.
  std::vector<double (*)(double fitted)> meanings = {};

  const std::string& cause() const;  ///< the effect's name
  /// A fitted parameter, or an end of its interval, as its words say it.
  double in_words(std::size_t parameter, double fitted) const {
    return parameter < meanings.size() ? meanings[parameter](fitted) : fitted;
  }
  /// Nats that sizes θ of its p parameters, typically s, cost beforehand: (p + 1)/2 ln(1 + Σ (θ/s)²), docs/model.md
  /// 8-3b. That is −ln of Cauchy's density over its value at 0: tails so heavy that what flights show plainly stands.
  double prior_nats(std::span<const double> sizes) const;
};

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
/// A function for Effect::remedy that always says so.
std::function<Remedy(const FittedForm&, const Vehicle&)> always(RemedyIn in, std::string words);
/// "LEAD: change body.mass to 1.02 in the vehicle file."; `lead`: what the flights say, in one clause.
Remedy in_vehicle(std::vector<Remedy::Set> set, const std::string& lead);
/// "rotor 3"; of a form whose scale is a rotor's number.
std::string rotor_of(const FittedForm& fitted);

/// Where an effect is that rotors differ by. Those of a sound craft differ too: without sound flights it is not told.
enum class AtRotors : std::uint8_t { no, weight, propeller, sensor };

/// Something physical that a simulation may lack: all that other code must know of it. One file each, and its line in
/// table.cpp.
struct Effect {
  std::string name;  ///< of the JSON; its file's, too
  AtRotors at_rotors = AtRotors::no;
  std::vector<Form> forms;  ///< in the order in which they are tried
  Regressor axis = {"time since the flight began, s", false,
                    [](const WindowRow& w) { return w.t; }};  ///< of its picture
  bool towards_walls = false;                                 ///< its picture shows the part towards the nearest wall
  /// What to change where it is found.
  std::function<Remedy(const FittedForm&, const Vehicle&)> remedy = [](const FittedForm& fitted, const Vehicle&) {
    return by_extension(fitted);
  };
  std::vector<Manoeuvre> manoeuvres = {};  ///< that set it apart from others
};

}  // namespace backwash::study
