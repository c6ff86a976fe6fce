// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/site/world_cache.hpp"

#include <elf.h>
#include <link.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <span>
#include <vector>

#include "core/field/lateral/vector_levels.hpp"
#include "core/files/read_file.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/progress.hpp"
#include "services/backwash/sha256.hpp"

namespace backwash::services {
namespace {

namespace fs = std::filesystem;

constexpr double kWorthKeeping = 0.5;                           // s
constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30;  // of the folder
constexpr std::string_view kMagic = "backwash world 1\n";
constexpr std::size_t kDigits = 64;  // of a hash

/// The hash that the linker made of this program, or of the library that this is in; empty if it made none.
std::string build_id() {
  std::string id;
  const auto of_program = [](dl_phdr_info* info, std::size_t, void* found) {
    const auto parts = std::span(info->dlpi_phdr, info->dlpi_phnum);
    const auto here = reinterpret_cast<ElfW(Addr)>(&build_id) - info->dlpi_addr;
    if (std::ranges::none_of(
            parts, [&](const auto& part) { return part.p_type == PT_LOAD && here - part.p_vaddr < part.p_memsz; }))
      return 0;  // another object
    for (const auto& part : parts) {
      if (part.p_type != PT_NOTE) continue;
      const char* note = reinterpret_cast<const char*>(info->dlpi_addr + part.p_vaddr);
      for (const char* const end = note + part.p_memsz; note + sizeof(ElfW(Nhdr)) <= end;) {
        ElfW(Nhdr) header;
        std::memcpy(&header, note, sizeof header);
        const auto padded = [](std::size_t size) { return (size + 3) / 4 * 4; };
        const char* const name = note + sizeof header;
        const char* const content = name + padded(header.n_namesz);
        if (header.n_type == NT_GNU_BUILD_ID && std::string_view(name, header.n_namesz) == std::string_view("GNU", 4))
          static_cast<std::string*>(found)->assign(content, header.n_descsz);
        note = content + padded(header.n_descsz);
      }
    }
    return 1;
  };
  ::dl_iterate_phdr(of_program, &id);
  return id;
}

/// Bytes of the vectors in which the field is computed here.
struct VectorBytes {
  template <int kPiece>
  [[gnu::always_inline]] static int run() noexcept {
    return kPiece;
  }
};

template <class T>
std::string bytes_of(const T* values, std::size_t count) {
  return {reinterpret_cast<const char*>(values), count * sizeof(T)};
}

/// The hash of all that decides on a world; empty where that is not known.
std::string key_of(const WorldInput& input) {
  const std::string program = build_id(), model = content_when_read(input.model_path),
                    vehicle = content_when_read(input.vehicle_path);
  if (program.empty() || model.empty() || vehicle.empty()) return "";
  const auto& grid = input.grid;
  const double numbers[] = {grid.resolution(), input.margin.value_or(-1), input.model.bound.kappa};
  std::string all = program;
  const int options[] = {field::run_native<VectorBytes>(), static_cast<int>(input.method)};
  all += bytes_of(options, 2) + sha256(model) + sha256(vehicle) + bytes_of(numbers, 3);
  for (const map::OccupancyGrid* of : {&grid, input.around})
    if (of)
      all += bytes_of(of->origin().data(), 3) + bytes_of(of->size().data(), 3) +
             sha256({reinterpret_cast<const char*>(of->cells().data()), of->cell_count()});
  return sha256(all);
}

fs::path folder() {
  if (const char* given = std::getenv("BACKWASH_CACHE")) return given;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache == '/') return fs::path(cache) / "backwash";
  const char* home = std::getenv("HOME");
  return home && *home == '/' ? fs::path(home) / ".cache" / "backwash" : fs::path();
}

/// The file of a key. What is removed is named so, whatever else lies in the folder.
constexpr std::string_view kSuffix = ".backwash-world", kUnfinished = ".backwash-world.part-";
fs::path file_of(const fs::path& in, const std::string& key) { return in / (key + std::string(kSuffix)); }
bool is_kept_world(const fs::path& file) {
  const std::string name = file.filename().string();
  const std::string_view rest = std::string_view(name).substr(std::min(kDigits, name.size()));
  return name.find_first_not_of("0123456789abcdef") == kDigits &&
         (rest == kSuffix || rest.starts_with(kUnfinished));  // of a call that was killed
}

/// Whether nobody else can put a world there: plans are made of them.
bool ours_alone(const fs::path& in) {
  struct stat found;
  return ::stat(in.c_str(), &found) == 0 && S_ISDIR(found.st_mode) && found.st_uid == ::geteuid() &&
         (found.st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

/// A world's bytes if the file holds them whole.
std::optional<std::string> read(const fs::path& file, const std::string& key) {
  if (!ours_alone(file.parent_path())) return std::nullopt;
  auto content = files::read_file(file.string(), kMostBytes, "a kept world");
  const std::size_t header = kMagic.size() + 2 * kDigits;
  if (!content || content->size() < header || !content->starts_with(std::string(kMagic) + key)) return std::nullopt;
  const std::string hash = content->substr(kMagic.size() + kDigits, kDigits);
  content->erase(0, header);
  if (sha256(*content) != hash) return std::nullopt;
  std::error_code unknown;
  fs::last_write_time(file, fs::file_time_type::clock::now(), unknown);  // used
  return std::move(*content);
}

/// Makes room for so many bytes: what was used longest ago goes first.
void make_room(const fs::path& in, std::uintmax_t bytes) {
  struct Kept {
    fs::file_time_type used;
    fs::path path;
    std::uintmax_t bytes;
  };
  std::vector<Kept> kept;
  std::error_code unknown;
  for (const auto& file : fs::directory_iterator(in, unknown)) {
    if (!file.is_regular_file(unknown) || !is_kept_world(file.path())) continue;
    kept.push_back({file.last_write_time(unknown), file.path(), file.file_size(unknown)});
    bytes += kept.back().bytes;
  }
  std::ranges::sort(kept, {}, &Kept::used);
  for (const auto& oldest : kept) {
    if (bytes <= kMostBytes) return;
    fs::remove(oldest.path, unknown);
    bytes -= oldest.bytes;
  }
}

void keep(const fs::path& in, const std::string& key, const std::string& bytes) {
  std::error_code wrong;
  if (!fs::exists(in, wrong)) {
    fs::create_directories(in.parent_path(), wrong);
    ::mkdir(in.c_str(), 0700);
  }
  if (kMostBytes / 2 < bytes.size() || !ours_alone(in)) return;
  make_room(in, bytes.size());
  try {
    write_file(file_of(in, key).string(), std::string(kMagic) + key + sha256(bytes) + bytes, true);
  } catch (const Failure&) {  // a full or read-only disk: the next call builds again
  }
}

}  // namespace

CachedWorld::CachedWorld(WorldInput input)
    : input_(std::move(input)), folder_(folder().string()), key_(folder_.empty() ? "" : key_of(input_)) {}

std::shared_ptr<const plan::World> CachedWorld::kept() const {
  if (key_.empty()) return nullptr;
  const auto bytes = read(file_of(folder_, key_), key_);
  if (!bytes) return nullptr;
  return plan::rebuilt(plan::unbuilt_world(input_.grid, input_.model, input_.vehicle, input_.method, input_.margin),
                       {.kept = *bytes}, run_shown);
}

std::shared_ptr<const plan::World> CachedWorld::made() const {
  progress("building the world");
  const auto begin = std::chrono::steady_clock::now();
  auto world =
      plan::rebuilt(plan::unbuilt_world(input_.grid, input_.model, input_.vehicle, input_.method, input_.margin),
                    {.voxels = map::all_of(input_.grid.size()), .around = input_.around}, run_shown);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  if (!key_.empty() && took.count() > kWorthKeeping) keep(folder_, key_, plan::kept_of(*world));
  return world;
}

std::shared_ptr<const plan::World> world_of(WorldInput input) {
  const CachedWorld cached(std::move(input));
  auto world = cached.kept();
  return world ? world : cached.made();
}

}  // namespace backwash::services
