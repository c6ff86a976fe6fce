// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/recorded_parts.hpp"

#include <algorithm>
#include <cstring>

namespace backwash::report {

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

Vec3 TruthRows::at(double t, const char* x, const char* y, const char* z) const {
  const auto after = std::upper_bound(log_.t_s.begin(), log_.t_s.end(), t);
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(after - log_.t_s.begin(), 1, static_cast<std::ptrdiff_t>(log_.t_s.size()) - 1));
  const double f = std::clamp((t - log_.t_s[i - 1]) / (log_.t_s[i] - log_.t_s[i - 1]), 0.0, 1.0);
  const auto value = [&](const char* name) {
    const auto& column = log_.column(name);
    return (1 - f) * column[i - 1] + f * column[i];
  };
  return {value(x), value(y), value(z)};
}

}  // namespace backwash::report
