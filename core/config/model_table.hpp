// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <toml++/toml.h>

#include <optional>
#include <string>
#include <vector>

#include "core/types/model.hpp"

/// A model file's tables to write, from the lists of keys by which load_model reads them.
namespace backwash::config {

/// The nearest number with so many significant decimal digits.
double rounded(double value, int digits);

/// [base] to [bound], six significant digits; what lies within a table is inline.
toml::table model_table(const Model& model);

/// "`what` is `x`, wanted in [`least`, `most`]" of a number that is not, or is none; nothing: it is.
std::optional<std::string> out_of_range(const std::string& what, double x, double least, double most);

/// Which number of an effect load_model would refuse; nothing: none.
std::optional<std::string> why_unwritable(const ModelEffect& effect);

/// An entry of `extension.term.effect`: { kind, value, error, scale }, eight significant digits. Errors: throws
/// std::invalid_argument with why_unwritable().
toml::table effect_table(const ModelEffect& effect);

/// TOML text of the tables, each under its name, in this order; those that are not there are left out.
std::string text_of(const toml::table& tables, const std::vector<std::string>& order);

}  // namespace backwash::config
