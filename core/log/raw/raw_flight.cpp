// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/raw/raw_flight.hpp"

#include <algorithm>
#include <fstream>
#include <string_view>

#include "core/log/mcap/mcap_reader.hpp"
#include "core/types/mode.hpp"

namespace backwash::log {
namespace {

void put(FlightLog& log, const std::string& prefix, const std::string& unit, const double (&x)[3]) {
  for (std::size_t i = 0; i < 3; ++i) log.columns[prefix + "xyz"[i] + unit].push_back(x[i]);
}

}  // namespace

bool is_raw_log(const std::string& path) {
  std::string begin(std::string_view(kRawLogMagic).size(), '\0');
  std::ifstream(path, std::ios::binary).read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin == kRawLogMagic || is_mcap({reinterpret_cast<const std::uint8_t*>(begin.data()), begin.size()});
}

tl::expected<FlightLog, LogError> flight_of_raw_log(const RawLog& log, const std::string& path) {
  FlightLog flight;
  const TickInputRecord* in = nullptr;
  std::int64_t last_stamp = 0;
  for (const auto& record : log.records) {
    if (record.header.kind == RecordKind::tick_input) in = payload<TickInputRecord>(record);
    const auto* tick = record.header.kind == RecordKind::tick ? payload<TickRecord>(record) : nullptr;
    if (!tick || !in) continue;
    const auto mode = static_cast<Mode>(tick->mode);
    if ((mode != Mode::tracking && mode != Mode::hold) || in->odometry_stamp_ns <= last_stamp) continue;
    last_stamp = in->odometry_stamp_ns;
    flight.t_s.push_back(1e-9 * static_cast<double>(in->odometry_stamp_ns));
    put(flight, "", "_m", tick->p);
    put(flight, "v", "_mps", tick->v);
    put(flight, "cmd_", "_m", tick->cmd_p);
    put(flight, "cmd_v", "_mps", tick->cmd_v);
    put(flight, "cmd_a", "_mps2", tick->cmd_a);
    for (std::size_t i = 0; i < 4; ++i) flight.columns[std::string("q") + "wxyz"[i]].push_back(in->q[i]);
  }
  if (flight.t_s.size() < 2)
    return tl::unexpected(
        LogError{LogError::Kind::bad_data, path + ":1: no tick flew a set-point; give a log of a flight"});
  const double first = flight.t_s.front();
  for (double& t : flight.t_s) t -= first;
  return flight;
}

}  // namespace backwash::log
