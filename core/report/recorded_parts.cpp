// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/recorded_parts.hpp"

#include <algorithm>
#include <cstring>

#include "core/types/text.hpp"

namespace backwash::report {
namespace {

/// Nothing: the record is of another kind, or too short for the head.
std::optional<RecordedSegment> recorded_segment(const log::RawRecord& record) {
  if (record.header.kind != log::RecordKind::segment || record.bytes.size() < sizeof(log::SegmentRecord)) return {};
  RecordedSegment s;
  std::memcpy(&s.head, record.bytes.data(), sizeof s.head);
  const std::size_t rows = (record.bytes.size() - sizeof s.head) / (10 * sizeof(double));
  for (std::size_t r = 0; r < rows; ++r) {
    double v[10];
    std::memcpy(v, record.bytes.data() + sizeof s.head + r * sizeof v, sizeof v);
    const Setpoint c{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]}, v[9]};
    if (r == 0)
      s.previous = c;
    else
      s.commands.push_back(c);
  }
  return s;
}

}  // namespace

std::vector<RecordedSegment> recorded_segments(std::span<const log::RawRecord> log) {
  std::vector<RecordedSegment> segments;
  for (const auto& record : log)
    if (auto segment = recorded_segment(record)) segments.push_back(*std::move(segment));
  return segments;
}

bool vertical(const RecordedSegment& s) {
  constexpr double kVertical = 0.01;  // m across: what stays within it rises or sinks on one line
  const auto beside = [&](const Setpoint& c) { return (c.p_W - s.commands.front().p_W).head<2>().norm(); };
  return !s.commands.empty() && std::ranges::all_of(s.commands, [&](auto& c) { return beside(c) < kVertical; }) &&
         s.commands.back().p_W.z() > s.commands.front().p_W.z() + kVertical;
}

std::int64_t first_tick_ns(std::span<const log::RawRecord> log) {
  const auto first = std::ranges::find(log, log::RecordKind::tick, [](auto& r) { return r.header.kind; });
  if (first != log.end()) return first->header.t_ns;
  return log.empty() ? 0 : log.front().header.t_ns;
}

std::vector<std::string> AirNews::take(const log::RawRecord& record) {
  using enum log::RecordKind;
  std::vector<std::string> news;
  const auto kind = record.header.kind;
  if (const auto* start = kind == air_constants ? log::payload<log::AirConstantsRecord>(record) : nullptr)
    std::copy_n(start->start, kAirClasses, factors_.begin());
  if (const auto* order = kind == air_order ? log::payload<log::AirOrderRecord>(record) : nullptr)
    std::copy_n(order->factors, kAirClasses, factors_.begin());
  if (const auto* row = kind == air ? log::payload<log::AirRecord>(record) : nullptr)
    for (std::size_t k = 0; k < kAirClasses; ++k) {
      const std::string of = std::string("air of class ") + to_string(static_cast<AirClass>(k));
      if (row->factors[k] < factors_[k] && row->factors[k] >= 1)
        news.push_back(of + ": what a flight showed has ended with it, a factor of " + to_text(row->factors[k], 2) +
                       " is kept");
      else if (row->factors[k] < factors_[k])
        news.push_back(of + " is calmer: errors have below " + to_text(row->factors[k], 2) +
                       " times the variance promised");
      else if (row->factors[k] > factors_[k] && row->factors[k] <= 1)
        news.push_back(of + " is no longer as calm as shown: its sets are the model's again");
      else if (row->factors[k] > factors_[k])
        news.push_back(of + ": errors have above " + to_text(row->factors[k], 2) +
                       " times the variance promised, ln evidence " + to_text(row->ln_evidence, 1));
      factors_[k] = row->factors[k];
    }
  const std::string text(record.bytes.begin(), record.bytes.end());
  if (kind == world && text.starts_with("the flight is stopped in rougher air")) news.push_back(text);
  return news;
}

std::optional<Vec3> TruthRows::at(double t, const char* x, const char* y, const char* z) const {
  constexpr double kBeyond = 0.1;  // s
  if (t < log_.t_s.front() - kBeyond || t > log_.t_s.back() + kBeyond) return std::nullopt;
  const auto after = std::upper_bound(log_.t_s.begin(), log_.t_s.end(), t);
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(after - log_.t_s.begin(), 1, static_cast<std::ptrdiff_t>(log_.t_s.size()) - 1));
  const double f = std::clamp((t - log_.t_s[i - 1]) / (log_.t_s[i] - log_.t_s[i - 1]), 0.0, 1.0);
  const auto value = [&](const char* name) {
    const auto& column = log_.column(name);
    return (1 - f) * column[i - 1] + f * column[i];
  };
  return Vec3(value(x), value(y), value(z));
}

}  // namespace backwash::report
