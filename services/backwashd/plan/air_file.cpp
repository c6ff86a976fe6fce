// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/plan/air_file.hpp"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>
#include <utility>

#include "core/config/file_hash.hpp"
#include "services/backwashd/control/controlled.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::daemon {
namespace {

constexpr double kMostFactor = 100;
constexpr std::string_view kFirstLine = "backwash air factors 1\n";
constexpr std::size_t kMostBytes = 4096;

/// The file's text. %.17g: the same number again, bit for bit.
std::string text_of(std::uint64_t files, const AirFactors& factors) {
  std::string text = fmt::format("{}files {:016x}\n", kFirstLine, files);
  for (std::size_t k = 0; k < kAirClasses; ++k)
    text += fmt::format("{} {:.17g}\n", to_string(static_cast<AirClass>(k)), factors[k]);
  return text + fmt::format("check {:016x}\n", config::fnv1a(text));
}

struct Kept {
  std::uint64_t files = 0;
  AirFactors factors = kModelledAir;
};
/// Nothing: it is none that was written by text_of(), bit for bit.
std::optional<Kept> kept(const std::string& text) {
  Kept read;
  auto& f = read.factors;
  unsigned long long files = 0;
  if (std::sscanf(text.c_str(),
                  "backwash air factors 1 files %llx free_air %lf ground %lf wall %lf corner %lf none %lf", &files,
                  &f[0], &f[1], &f[2], &f[3], &f[4]) != 6)
    return std::nullopt;
  read.files = files;
  for (const double factor : f)
    if (!(factor >= 1 && factor <= kMostFactor)) return std::nullopt;
  return text_of(read.files, f) == text ? std::optional(read) : std::nullopt;
}

}  // namespace

AirFile::AirFile(std::string path, std::uint64_t files) : path_(std::move(path)), files_(files) {
  std::error_code none;
  const auto status = std::filesystem::symlink_status(path_, none);
  if (std::filesystem::exists(status)) {
    if (!std::filesystem::is_regular_file(status))
      throw StartError(kConfiguration, path_ + ": adaptation.file is no regular file");
    std::ifstream in(path_, std::ios::binary);
    std::string text(kMostBytes, '\0');
    in.read(text.data(), kMostBytes);
    text.resize(static_cast<std::size_t>(in.gcount()));
    const auto read = kept(text);
    if (read && read->files != files_)
      throw StartError(
          kConfiguration,
          fmt::format("{}: was learnt with another vehicle or model file (hash {:016x}, those of this start "
                      "{:016x}): move it away, or give adaptation.file another name",
                      path_, read->files, files_));
    if (read) {
      start_ = read->factors;
    } else {
      const std::string aside = path_ + ".damaged";
      spdlog::warn("{}: holds no factors of air; moved to {}, and the air is taken as modelled", path_, aside);
      std::filesystem::rename(path_, aside, none);
      if (none) throw StartError(kCannotCreate, path_ + ": is damaged and cannot be moved away: " + none.message());
    }
  }
  if (!keep(start_)) throw StartError(kCannotCreate, path_ + ": cannot be written: " + std::strerror(errno));
}

bool AirFile::keep(const AirFactors& factors) const {
  const std::string text = text_of(files_, factors), part = path_ + ".part";
  const int file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644);
  if (file < 0) return false;
  const bool whole = ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(file) == 0;
  const int why = errno;
  ::close(file);
  if (whole && ::rename(part.c_str(), path_.c_str()) == 0) return true;
  if (!whole) errno = why;
  return false;
}

void run_air_file(const AirFile& file, Controlled& channels, const std::atomic<bool>& end) {
  std::optional<AirFactors> newest;
  bool failing = false;
  for (bool last = false; !last; std::this_thread::sleep_for(std::chrono::milliseconds(last ? 0 : 200))) {
    last = end;
    if (const auto said = channels.air_kept.read_new()) newest = said;
    if (!newest) continue;
    const bool taken = file.keep(*newest);
    if (!taken && !std::exchange(failing, true))
      spdlog::warn("the factors of the air cannot be kept: {}; after a restart they are learnt anew",
                   std::strerror(errno));
    if (taken) {
      newest.reset();
      failing = false;
    }
  }
}

}  // namespace backwash::daemon
