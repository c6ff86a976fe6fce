// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/record/recorder.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <utility>

#include "services/backwashd/channels.hpp"

namespace backwash::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kCheckEvery_ns = 500'000'000;  // that the file is still in its directory, and on the disk
constexpr std::uint64_t kFloor = 64u << 20;           // bytes that others on this disk keep, but no more than
constexpr std::uint64_t kFloorShare = 20;             // one part in so many of it
constexpr std::size_t kChunk = 1u << 20;              // bytes written at once
constexpr int kMostNumbers = 1'000'000;
constexpr std::string_view kLibrary = "backwashd";

std::string numbered(const fs::path& name, int number) {
  return (name.parent_path() / (name.stem().string() + "-" + std::to_string(number) + name.extension().string()))
      .string();
}

/// Whether so many bytes may still be written there: a log that takes the last of a disk takes the system with it.
bool room_for(int fd, std::size_t bytes) {
  struct statvfs disk {};
  if (::fstatvfs(fd, &disk) != 0) return true;  // the write itself will tell
  const std::uint64_t whole = std::uint64_t{disk.f_blocks} * disk.f_frsize;
  return std::uint64_t{disk.f_bavail} * disk.f_frsize >= bytes + std::min(kFloor, whole / kFloorShare);
}

std::int64_t wall_clock_ns() {
  using namespace std::chrono;
  return duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count();
}

template <typename T>
log::RawRecord record_of(std::int64_t t_ns, log::RecordKind kind, const T& content) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&content);
  return {{t_ns, kind, sizeof content}, {bytes, bytes + sizeof content}};
}

/// The highest N of the files STEM-N.EXTENSION beside `name`; 1 if there is none.
int highest_number(const fs::path& name) {
  const std::string before = name.stem().string() + "-", after = name.extension().string();
  int highest = 1;
  std::error_code gone;
  for (fs::directory_iterator at(name.has_parent_path() ? name.parent_path() : ".", gone), end; !gone && at != end;
       at.increment(gone)) {
    const std::string file = at->path().filename().string();
    if (file.size() <= before.size() + after.size() || !file.starts_with(before) || !file.ends_with(after)) continue;
    const char *digits = file.data() + before.size(), *last = file.data() + file.size() - after.size();
    int number = 0;
    const auto [read, failed] = std::from_chars(digits, last, number);
    if (failed == std::errc{} && read == last && number < kMostNumbers) highest = std::max(highest, number);
  }
  return highest;
}

}  // namespace

Recorder::Recorder(const std::string& name, std::uint64_t part_bytes)
    : name_(name), part_bytes_(part_bytes), log_(wall_clock_ns()), path_(name) {
  if (!create())
    throw std::runtime_error(name + ": raw log cannot be created: " + std::strerror(errno) +
                             "; give log.file a writable directory");
}

Recorder::~Recorder() {
  const bool nothing = written_ == begun_;
  if (nothing && file_.get() >= 0 && still_there()) ::unlink(path_.c_str());
}

bool Recorder::create() {
  const auto open_new = [this] {
    // Exclusive: an earlier flight's log, or a link, is never written to.
    return ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0640);
  };
  path_ = name_;
  int fd = open_new();
  if (fd < 0 && errno == EEXIST) {
    int number = highest_number(name_);
    do path_ = numbered(name_, ++number);
    while ((fd = open_new()) < 0 && errno == EEXIST && number < kMostNumbers);
  }
  file_ = firmware_bridge::FileDescriptor(fd);
  mcap_.emplace(kLibrary, kDrawnMaps);
  written_ = 0;
  told_lost_ = 0;
  if (fd < 0 || begin()) return fd >= 0;
  const int why = errno;
  ::unlink(path_.c_str());  // a full disk takes a name, and no byte behind it
  errno = why;
  return false;
}

/// What every file begins with: which part it is, and what an earlier part holds of the flight's world.
bool Recorder::begin() {
  const std::int64_t now = now_ns();
  const log::PartRecord part{log_, wall_clock_ns() - now, part_ + 1, static_cast<std::uint32_t>(kept_.size())};
  mcap_->take(record_of(now, log::RecordKind::part, part));
  for (const auto& [kind, record] : kept_) mcap_->take(record);
  if (!mcap_->writer().flush(sink_)) return false;
  begun_ = written_;
  ++part_;
  return true;
}

void Recorder::keep(const log::RawRecord& record) {
  const auto kind = record.header.kind;
  const auto* map = kind == log::RecordKind::map ? log::payload<log::MapRecord>(record) : nullptr;
  if (kind == log::RecordKind::constants || (map && map->accepted)) kept_[kind] = record;
}

/// The next part, if this one is large enough and its last tick commanded nothing. One that cannot be made is looked
/// for as one that has vanished.
void Recorder::leave_part() {
  if (written_ - begun_ < part_bytes_ || mode_ != static_cast<std::uint32_t>(Mode::passive)) return;
  finish();
  if (::fdatasync(file_.get()) != 0) spdlog::warn("{}: not on the disk yet: {}", path_, std::strerror(errno));
  const std::string before = path_;
  if (create()) spdlog::info("{} is full; the log goes on in {}", before, path_);
}

/// Ends the file with its index. Without, as a kill leaves it, readers go through it from its beginning.
void Recorder::finish() {
  if (file_.get() >= 0 && written_ > begun_ && !mcap_->finish(sink_))
    spdlog::warn("{}: has no index: {}", path_, std::strerror(errno));
}

bool Recorder::still_there() const {
  struct stat ours {
  }, named{};
  return ::fstat(file_.get(), &ours) == 0 && ::lstat(path_.c_str(), &named) == 0 && ours.st_ino == named.st_ino &&
         ours.st_dev == named.st_dev;
}

bool Recorder::write(std::uint64_t at, std::span<const std::uint8_t> bytes) {
  if (!room_for(file_.get(), bytes.size())) return errno = ENOSPC, false;
  if (::lseek(file_.get(), static_cast<::off_t>(at), SEEK_SET) < 0) return false;
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(file_.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      // Part of a batch would hide everything behind it.
      const int why = errno;
      (void)!::ftruncate(file_.get(), static_cast<::off_t>(written_));
      errno = why;
      return false;
    }
    done += static_cast<std::size_t>(n);
  }
  written_ = std::max(written_, at + bytes.size());
  return true;
}

void Recorder::append(log::RecordKind kind, std::span<const std::uint8_t> bytes) {
  const std::size_t size = sizeof(log::RecordHeader) + bytes.size();
  if (pending_bytes_.fetch_add(size) + size > kMostPending) {
    pending_bytes_ -= size;
    ++lost_;
    spdlog::warn("{}: the disk does not follow; the flight goes on, records are lost", name_);
    return;
  }
  log::RawRecord record{{now_ns(), kind, static_cast<std::uint32_t>(bytes.size())}, {bytes.begin(), bytes.end()}};
  const std::lock_guard lock(mutex_);
  pending_.push_back(std::move(record));
}

void Recorder::append(log::RecordKind kind, const std::string& text) {
  append(kind, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void Recorder::put(log::RawRecord record) {
  keep(record);
  const auto* tick = record.header.kind == log::RecordKind::tick ? log::payload<log::TickRecord>(record) : nullptr;
  if (tick && std::exchange(mode_, tick->mode) != tick->mode) sync_due_ = true;
  batch_bytes_ += sizeof record.header + record.bytes.size();
  batch_.push_back(std::move(record));
}

void Recorder::fail(const char* why) {
  lost_ += batch_.size();
  batch_.clear();
  batch_bytes_ = 0;
  if (!std::exchange(failing_, true)) spdlog::warn("{}: {}; the flight goes on, records are lost", path_, why);
}

/// Whether there is a file to write to, made anew if it has vanished: no more often than it is looked for, because a
/// directory that is gone stays so for a while.
bool Recorder::open_again(std::int64_t now) {
  const bool check = now - checked_ns_ > kCheckEvery_ns;
  if (check) {
    sync_due_ = sync_due_ || checked_ns_ != 0;
    checked_ns_ = now;
  }
  if (file_.get() >= 0 && !(check && !still_there())) return true;
  if (!check || !create()) {
    file_ = firmware_bridge::FileDescriptor();
    return false;
  }
  failing_ = true;
  return true;
}

void Recorder::write_batch(std::uint64_t lost_in_ring) {
  if (batch_.empty()) return;
  const std::int64_t now = now_ns();
  if (!open_again(now)) return fail("is gone");
  const log::LostRecord lost{lost_ + lost_in_ring};
  if (lost.records != told_lost_) mcap_->take(record_of(now, log::RecordKind::lost, lost));
  for (const log::RawRecord& record : batch_) mcap_->take(record);
  if (!mcap_->writer().flush(sink_)) {
    mcap_->writer().drop();
    return fail(std::strerror(errno));
  }
  told_lost_ = lost.records;
  batch_.clear();
  batch_bytes_ = 0;
  if (std::exchange(failing_, false)) spdlog::warn("{}: written again after {} records were lost", path_, lost.records);
  leave_part();
}

void Recorder::drain(Channels& channels) {
  const auto when_full = [&] {
    if (batch_bytes_ > kChunk) write_batch(channels.records_lost());
  };
  const auto control = [&](auto& ring) {
    while (const auto record = ring.pop()) {
      put({record->header, {record->bytes.begin(), record->bytes.begin() + record->header.size}});
      when_full();
    }
  };
  control(channels.control_log);
  control(channels.command_log);
  std::vector<log::RawRecord> bulk;
  {
    const std::lock_guard lock(mutex_);
    bulk.swap(pending_);
  }
  for (log::RawRecord& record : bulk) {
    const std::size_t bytes = sizeof record.header + record.bytes.size();
    put(std::move(record));
    when_full();
    pending_bytes_ -= bytes;
  }
  write_batch(channels.records_lost());
  if (std::exchange(sync_due_, false) && file_.get() >= 0 && ::fdatasync(file_.get()) != 0)
    spdlog::warn("{}: not on the disk yet: {}", path_, std::strerror(errno));
}

void Recorder::run(Channels& channels, const std::atomic<bool>& end) {
  while (!end) {
    drain(channels);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  drain(channels);
  finish();
}

}  // namespace backwash::daemon
