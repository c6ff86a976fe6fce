// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/recorder.hpp"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

namespace backwash::daemon {

Recorder::Recorder(const std::string& path) : file_(path, std::ios::binary | std::ios::trunc) {
  file_ << study::kRawLogMagic << std::flush;
  if (!file_) throw std::runtime_error(path + ": raw log cannot be created; give log.file a writable directory");
}

void Recorder::append(study::RecordKind kind, std::span<const std::uint8_t> bytes) {
  BulkRecord record{{now_ns(), kind, static_cast<std::uint32_t>(bytes.size())}, {bytes.begin(), bytes.end()}};
  const std::lock_guard lock(mutex_);
  pending_.push_back(std::move(record));
}

void Recorder::append(study::RecordKind kind, const std::string& text) {
  append(kind, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void Recorder::write(const study::RecordHeader& header, const std::uint8_t* bytes) {
  if (!file_) {
    ++lost_;
    return;
  }
  file_.write(reinterpret_cast<const char*>(&header), sizeof header);
  file_.write(reinterpret_cast<const char*>(bytes), header.size);
}

bool Recorder::drain(Channels& channels) {
  bool any = false;
  while (const auto record = channels.control_log.pop()) {
    write(record->header, record->bytes.data());
    any = true;
  }
  std::vector<BulkRecord> bulk;
  {
    const std::lock_guard lock(mutex_);
    bulk.swap(pending_);
  }
  for (const auto& record : bulk) write(record.header, record.bytes.data());
  return any || !bulk.empty();
}

void Recorder::run(Channels& channels) {
  while (!channels.stop) {
    if (drain(channels)) file_.flush();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  drain(channels);
  file_.flush();
}

}  // namespace backwash::daemon
