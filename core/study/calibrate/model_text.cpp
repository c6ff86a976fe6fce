// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/model_text.hpp"

#include <cmath>
#include <initializer_list>
#include <sstream>

namespace backwash::study::calibrate {
namespace {

std::string quoted(const std::string& text) {
  std::string safe(1, '"');
  for (const char c : text) {
    if (c == '"' || c == '\\') safe += '\\';
    safe += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  safe += '"';
  return safe;
}

std::string list(const std::vector<std::string>& items) {
  std::string text(1, '[');
  for (const auto& item : items) text.append(text.size() > 1 ? ", " : "").append(quoted(item));
  text += ']';
  return text;
}

std::string number(double value) {
  std::ostringstream text;
  text.precision(6);
  text << value;
  std::string s = text.str();
  if (s.find_first_of(".e") == std::string::npos) s.append(".0");
  return s;
}

/// "{ name = value, … }".
std::string inline_table(std::initializer_list<std::pair<const char*, double>> entries) {
  std::ostringstream text;
  for (const auto& [name, value] : entries) text << (text.tellp() > 0 ? ", " : "{ ") << name << " = " << number(value);
  text << " }";
  return text.str();
}

std::string axes(const Vec3& v) { return inline_table({{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}); }

std::string text_of(const Interval& i) {
  std::ostringstream text;
  text << '[' << number(i.low) << ", " << number(i.high) << ']';
  return text.str();
}

void write_bound(std::ostringstream& text, const Model& m) {
  text << "[bound]\nkappa = " << number(m.bound.kappa) << "\nmean = { horizontal = " << number(m.bound.mean_horizontal)
       << ", vertical = " << number(m.bound.mean_vertical) << " }\ntau_w = " << number(m.bound.tau_w) << "\n\n";
}

void write_model(std::ostringstream& text, const Model& m) {
  const auto hz = [](const auto& v) { return inline_table({{"horizontal", v.horizontal}, {"vertical", v.vertical}}); };
  const auto ntz = [](const auto& v) {
    return inline_table({{"normal", v.normal}, {"tangential", v.tangential}, {"vertical", v.vertical}});
  };
  text << "[base]\nhorizontal = " << number(m.base.horizontal) << "\nvertical = " << number(m.base.vertical)
       << "\n\n[ground]\ntheta_max = " << number(m.ground.theta_max) << "\nl_max = " << number(m.ground.l_max)
       << "\nl_footprint_max = " << number(m.ground.l_footprint_max) << "\nr0 = " << number(m.ground.r0)
       << "\nlambda = " << hz(m.ground.lambda) << "\nk1 = " << hz(m.ground.k1) << "\nk2 = " << number(m.ground.k2)
       << "\n\n[corner]\nphi_max = " << number(m.corner.phi_max) << "\nl_max = " << number(m.corner.l_max)
       << "\nlambda = " << ntz(m.corner.lambda) << "\n\n[wall]\ntheta_min = " << number(m.wall.theta_min)
       << "\nl_max = " << number(m.wall.l_max) << "\nk1 = " << ntz(m.wall.k1) << "\nk2 = " << number(m.wall.k2)
       << "\n\n";
}

void write_confidence(std::ostringstream& text, const Calibration& c) {
  text << "[confidence]  # 95 % intervals, bootstrap by flight\n";
  for (std::size_t p = 0; p < kParameters; ++p) {
    if (c.determined[p]) text << '"' << key(static_cast<Parameter>(p)) << "\" = " << text_of(c.ci95[p]) << '\n';
  }
  if (c.pushes)
    text << "\"bound.mean.horizontal\" = " << text_of(c.push_horizontal.ci95)
         << "\n\"bound.mean.vertical\" = " << text_of(c.push_vertical.ci95) << '\n';
  text << "\"bound.tau_w\" = " << text_of(c.tau_w.ci95) << "\ncoverage_held_out = " << axes(c.held_out.coverage)
       << "  # share of windows below the bound of a fit without their flight\ncoverage_fitted = "
       << axes(c.on_fitted.coverage) << "\nbound_over_observed = " << axes(c.held_out.bound_over_observed)
       << "  # median\npinball_loss = " << number(c.held_out.loss)
       << "\npinball_loss_constant = " << number(c.held_out.constant_loss)
       << "\npinball_loss_height_only = " << number(c.held_out.height_loss) << "\n\n";
}

}  // namespace

std::string model_text(const Calibration& c, const Provenance& p) {
  std::ostringstream text;
  text << "# Calibrated by backwash: windows' variances lie below this field with probability " << number(p.quantile)
       << ".\n# Variances in (m/s²)², lengths in m, angles in rad.\n";
  write_model(text, c.model);
  write_bound(text, c.model);
  write_confidence(text, c);
  std::vector<std::string> kept;
  for (std::size_t i = 0; i < kParameters; ++i) {
    if (!c.determined[i]) kept.emplace_back(key(static_cast<Parameter>(i)));
  }
  text << "[provenance]\nversion = " << quoted(p.version) << "\nvehicle = " << quoted(p.vehicle)
       << "\nbase_model = " << quoted(p.base_model) << "  # gates\nkept_from_base = " << list(kept)
       << "\nmaps = " << list(p.maps) << "\nlogs = " << list(p.logs) << "\nsignal = " << quoted(p.signal)
       << "\nwindows = " << p.windows << "\ngated = {";
  for (std::size_t g = 0; g < kGates; ++g)
    text << (g ? ", " : " ") << to_string(static_cast<Gate>(g)) << " = " << p.gated[g];
  text << " }\nquantile = " << number(p.quantile) << "\nseed = " << p.seed << "\nbootstraps = " << p.bootstraps
       << "\nbetween_flights_sd = { horizontal = " << number(c.fitted.between_sd[kHorizontal])
       << ", vertical = " << number(c.fitted.between_sd[kVertical])
       << " }  # of ln variance\nwithin_flight_sd = { horizontal = " << number(c.fitted.within_sd[kHorizontal])
       << ", vertical = " << number(c.fitted.within_sd[kVertical]) << " }\n";
  return text.str();
}

std::string model_tables(const Model& model) {
  std::ostringstream text;
  write_model(text, model);
  write_bound(text, model);
  return text.str();
}

}  // namespace backwash::study::calibrate
