// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/recorder.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <thread>
#include <utility>

namespace backwash::daemon {
namespace {

constexpr std::int64_t kCheckEvery_ns = 500'000'000;  // that the file is still in its directory

}  // namespace

Recorder::Recorder(const std::string& path) : path_(path) {
  if (!create()) throw std::runtime_error(path + ": raw log cannot be created; give log.file a writable directory");
}

bool Recorder::create() {
  file_ = firmware_bridge::FileDescriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  written_ = 0;
  const std::string_view magic(study::kRawLogMagic);
  return file_.get() >= 0 && write({magic.begin(), magic.end()});
}

bool Recorder::still_there() const {
  struct stat ours {
  }, named{};
  return ::fstat(file_.get(), &ours) == 0 && ::stat(path_.c_str(), &named) == 0 && ours.st_ino == named.st_ino &&
         ours.st_dev == named.st_dev;
}

bool Recorder::write(const std::vector<std::uint8_t>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(file_.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      // Part of a batch would hide everything behind it.
      const int why = errno;
      (void)!::ftruncate(file_.get(), written_);
      ::lseek(file_.get(), written_, SEEK_SET);
      errno = why;
      return false;
    }
    done += static_cast<std::size_t>(n);
  }
  written_ += static_cast<std::int64_t>(bytes.size());
  return true;
}

void Recorder::append(study::RecordKind kind, std::span<const std::uint8_t> bytes) {
  BulkRecord record{{now_ns(), kind, static_cast<std::uint32_t>(bytes.size())}, {bytes.begin(), bytes.end()}};
  const std::lock_guard lock(mutex_);
  pending_.push_back(std::move(record));
}

void Recorder::append(study::RecordKind kind, const std::string& text) {
  append(kind, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void Recorder::put(std::vector<std::uint8_t>& to, const study::RecordHeader& header, const std::uint8_t* bytes) {
  const auto* head = reinterpret_cast<const std::uint8_t*>(&header);
  to.insert(to.end(), head, head + sizeof header);
  to.insert(to.end(), bytes, bytes + header.size);
}

void Recorder::fail(std::uint64_t records, const char* why) {
  lost_ += records;
  if (!std::exchange(failing_, true)) spdlog::warn("{}: {}; the flight goes on, records are lost", path_, why);
}

void Recorder::drain(Channels& channels) {
  std::vector<std::uint8_t> batch;
  std::uint64_t records = 0;
  while (const auto record = channels.control_log.pop()) put(batch, record->header, record->bytes.data()), ++records;
  std::vector<BulkRecord> bulk;
  {
    const std::lock_guard lock(mutex_);
    bulk.swap(pending_);
  }
  for (const auto& record : bulk) put(batch, record.header, record.bytes.data()), ++records;
  if (records == 0) return;

  const std::int64_t now = now_ns();
  const bool check = now - checked_ns_ > kCheckEvery_ns;
  if (check) checked_ns_ = now;
  if (file_.get() < 0 || (check && !still_there())) {
    // Made anew no more often than it is looked for: a directory that is gone stays so for a while.
    if (!check) return fail(records, "cannot be created again");
    if (!create()) {
      file_ = firmware_bridge::FileDescriptor();
      return fail(records, "is gone");
    }
    failing_ = true;
  }
  std::vector<std::uint8_t> out;
  if (failing_) {
    const study::LostRecord lost{lost_};
    put(out, {now, study::RecordKind::lost, sizeof lost}, reinterpret_cast<const std::uint8_t*>(&lost));
  }
  out.insert(out.end(), batch.begin(), batch.end());
  if (!write(out)) return fail(records, std::strerror(errno));
  if (std::exchange(failing_, false)) spdlog::warn("{}: written again after {} records were lost", path_, lost_.load());
}

void Recorder::run(Channels& channels) {
  while (!channels.stop) {
    drain(channels);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  drain(channels);
}

}  // namespace backwash::daemon
