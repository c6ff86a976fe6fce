// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/study_anytime.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/files/read_file.hpp"
#include "core/report/page.hpp"
#include "core/study/inference/rules.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

constexpr double kLevel = 0.05;         // that the sentence speaks of
constexpr std::size_t kCausesTold = 3;  // causes

/// "4.1", "2.3e+07": three digits of e^x, whatever x.
std::string e_value(double log_e) {
  char text[32];
  if (log_e < std::log(1e6))
    std::snprintf(text, sizeof text, "%.3g", std::exp(log_e));
  else
    std::snprintf(text, sizeof text, "10^%.1f", log_e / std::log(10));
  return text;
}

std::string text_of(const std::string& path) {
  auto text = files::read_file(path, files::kLargestConfiguration, "the JSON of a study");
  if (!text) throw Failure(kNoInput, path + ":1: " + text.error().message);
  return std::move(*text);
}

double read_log_e(const std::string& path) {
  const auto json = Json::parse(text_of(path), nullptr, false);
  const Json* e = json.is_object() && json.contains("anytime") ? &json["anytime"] : nullptr;
  if (!e || !e->is_object() || !e->contains("ln_e_value") || !(*e)["ln_e_value"].is_number())
    throw Failure(kBadData, path +
                                ":1: no 'anytime.ln_e_value'; --fleet takes what 'backwash study --anytime --json' "
                                "printed for another vehicle");
  return (*e)["ln_e_value"];
}

std::string sentence(const AnytimeReport& report) {
  const auto since = report.since(kLevel);
  std::string text = "Looked at after every flight: e-value " + e_value(report.log_e.back()) + " after " +
                     std::to_string(report.flights.size()) + " flights";
  if (since)
    text += ", above " + e_value(-std::log(kLevel)) + " since flight " + std::to_string(*since + 1) + " (" +
            report.flights[*since] + "), most of it by " + report.leading.front().first;
  return text + ".";
}

constexpr const char* kMeaning =
    "Flights without an effect ever reach an e-value of 20 with probability 1/20 at most, however often one looks. The "
    "p "
    "of the study holds for one look, at a number of flights that was chosen before.";

}  // namespace

std::optional<std::size_t> AnytimeReport::since(double level) const {
  const auto at = std::ranges::find_if(log_e, [&](double e) { return e >= -std::log(level); });
  if (at == log_e.end()) return std::nullopt;
  return static_cast<std::size_t>(at - log_e.begin());
}

AnytimeReport anytime_report(const std::vector<std::string>& flights, const study::Anytime& anytime,
                             const std::vector<std::string>& fleet) {
  AnytimeReport report{flights, anytime.log_e(), {}, fleet, anytime.log_e().back()};
  for (const auto& [name, log_e] : anytime.causes())
    report.leading.emplace_back(name, std::exp(log_e - report.log_e.back()));
  std::ranges::stable_sort(report.leading, std::greater(), [](auto& c) { return c.second; });
  report.leading.resize(std::min(report.leading.size(), kCausesTold));
  for (const auto& path : fleet) report.fleet_log_e += read_log_e(path);
  return report;
}

Json to_json(const AnytimeReport& report) {
  Json json = {{"ln_e_value", report.log_e.back()}};
  for (std::size_t n = 0; n < report.flights.size(); ++n)
    json["flights"].push_back({{"log", report.flights[n]}, {"ln_e_value", report.log_e[n]}});
  for (const auto& [name, share] : report.leading) json["leading"].push_back({{"name", name}, {"share", share}});
  const auto since = report.since(kLevel);
  json["above_20_since"] = since ? Json(report.flights[*since]) : Json();
  if (!report.fleet.empty())
    json["fleet"] = {{"vehicles", report.fleet.size() + 1}, {"ln_e_value", report.fleet_log_e}};
  return json;
}

void print_text(const AnytimeReport& report) {
  std::printf("%s\n", sentence(report).c_str());
  if (!report.fleet.empty())
    std::printf("Of %zu vehicles together: e-value %s.\n", report.fleet.size() + 1,
                e_value(report.fleet_log_e).c_str());
  std::printf("%s\n", kMeaning);
}

std::string html(const AnytimeReport& report) {
  std::string page = "<section><h2>Looked at after every flight</h2>\n<p>" +
                     report::escaped(sentence(report) + " " + kMeaning) +
                     "</p>\n<table class=\"wide\">\n<thead><tr><th>flight</th><th>e-value after it</th></tr></thead>\n";
  for (std::size_t n = 0; n < report.flights.size(); ++n)
    page += "<tr><td>" + report::escaped(report.flights[n]) + "</td><td>" + e_value(report.log_e[n]) + "</td></tr>\n";
  return page + "</table>\n</section>\n";
}

}  // namespace backwash::services
