// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/signing_time.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <utility>

#include "services/backwashd/control/controlled.hpp"

namespace backwash::daemon {
namespace {

using mavlink::SigningTime;

constexpr std::size_t kDigits = 15;  // of 2^48 − 1; with the line end 16 bytes, written at once in one block
constexpr std::int64_t k2015_s = 1'420'070'400;

SigningTime signing_time(std::chrono::system_clock::time_point wall) {
  using Tens = std::chrono::duration<std::int64_t, std::ratio<1, mavlink::kSigningSecond>>;
  const auto since_2015 = wall.time_since_epoch() - std::chrono::seconds(k2015_s);
  return static_cast<SigningTime>(std::max<std::int64_t>(std::chrono::duration_cast<Tens>(since_2015).count(), 0));
}

}  // namespace

SigningTimeFile::SigningTimeFile(const std::string& path, std::chrono::system_clock::time_point wall)
    : path_(path), file_(::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0600)) {
  if (file_.get() < 0) throw std::runtime_error(path + ": cannot be opened: " + std::strerror(errno));
  start_ = std::max(signing_time(wall), stored());
  if (!keep(start_)) throw std::runtime_error(path + ": cannot be written: " + std::strerror(errno));
}

SigningTime SigningTimeFile::stored() const {
  std::array<char, kDigits + 1> text{};
  const auto size = ::pread(file_.get(), text.data(), text.size(), 0);
  if (size == 0) return 0;
  SigningTime time = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + kDigits, time);
  if (failed == std::errc{} && end == text.data() + kDigits && time <= mavlink::kLastSigningTime) return time;
  spdlog::warn("{}: does not hold the time of a signature; the wall clock alone counts", path_);
  return 0;
}

bool SigningTimeFile::write(SigningTime time) {
  std::array<char, 24> text;  // of any number; kept below 10¹⁵
  std::snprintf(text.data(), text.size(), "%015llu\n", static_cast<unsigned long long>(time));
  if (::pwrite(file_.get(), text.data(), kDigits + 1, 0) != static_cast<ssize_t>(kDigits + 1)) return false;
  if (::fdatasync(file_.get()) != 0) return false;
  reserved_ = time;
  return true;
}

bool SigningTimeFile::keep(SigningTime last) {
  if (last + kReserve / 2 <= reserved_) return true;
  return write(std::min(last + kReserve, mavlink::kLastSigningTime));
}

std::string signing_time_path(const std::string& log) {
  return (std::filesystem::path(log).parent_path() / "mavlink_signing.time").string();
}

void run_signing_time(SigningTimeFile& file, Controlled& channels, const std::atomic<bool>& end) {
  bool failing = false;
  while (!end) {
    const std::optional<SigningTime> last = channels.signing_time.load();
    const bool kept = !last || file.keep(*last);
    if (std::exchange(failing, !kept) == kept && !kept)
      spdlog::warn("the time of signatures cannot be kept: {}; after a restart they may be refused",
                   std::strerror(errno));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  if (const auto last = channels.signing_time.load()) file.close(*last);
}

}  // namespace backwash::daemon
