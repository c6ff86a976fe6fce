// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/files.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {

map::OccupancyGrid read_map(const std::string& path) {
  auto grid = map::load_map(path);
  if (grid) return std::move(*grid);
  using Kind = map::MapError::Kind;
  const auto kind = grid.error().kind;
  throw Failure(kind == Kind::not_found || kind == Kind::unknown_name ? kNoInput : kBadData, grid.error().message);
}

namespace {

template <typename T>
T read_configuration(tl::expected<T, config::ConfigError> value) {
  if (value) return std::move(*value);
  throw Failure(value.error().kind == config::ConfigError::Kind::not_found ? kNoInput : kConfiguration,
                value.error().message);
}

}  // namespace

Model read_model(const std::string& path) { return read_configuration(config::load_model(path)); }
Vehicle read_vehicle(const std::string& path) { return read_configuration(config::load_vehicle(path)); }

study::FlightLog read_table(const std::string& path, const std::string& time_column) {
  auto table = study::read_csv(path, time_column);
  if (table) return std::move(*table);
  throw Failure(table.error().kind == study::LogError::Kind::not_found ? kNoInput : kBadData, table.error().message);
}

reach::Method read_method(const std::string& name) {
  return name == "paper" ? reach::Method::paper : reach::Method::tight;
}

void refuse_to_overwrite(const std::string& path, bool force) {
  if (!path.empty() && !force && std::filesystem::exists(path)) {
    throw Failure(kCannotCreate, path + ":1: exists already; give another name or --force");
  }
}

void write_file(const std::string& path, const std::string& content, bool force) {
  refuse_to_overwrite(path, force);
  std::ofstream file(path, std::ios::binary);
  if (!file) {
    throw Failure(kCannotCreate, path + ":1: cannot be created; name a file in a folder that can be written");
  }
  file << content << std::flush;
  if (!file) throw Failure(kInputOutput, path + ":1: cannot be written to its end; free some space");
}

reach::Reachability read_reachability(const Vehicle& vehicle, reach::Method method, reach::Loop loop,
                                      const std::string& vehicle_path) {
  try {
    return reach::Reachability(vehicle, method, loop);
  } catch (const std::invalid_argument& unstable) {
    throw Failure(kConfiguration,
                  vehicle_path + ":1: " + unstable.what() + "; choose gains, delay and lag of a stable loop");
  }
}

void run_parallel(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
  const std::size_t chunk = std::clamp<std::size_t>(count / 64, 1, 1024);  // balances rooms against walls
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto loop = [&] {
    try {
      for (std::size_t begin; (begin = next.fetch_add(chunk)) < count;) work(begin, std::min(begin + chunk, count));
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) threads.emplace_back(loop);
    loop();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace backwash::services
