// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/campaign_shard.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <utility>

#include "core/files/read_file.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kLargestShard = std::size_t{4} << 30;

std::string path_of(const std::string& folder, std::size_t shard, const char* kind) {
  return folder + "/shard-" + std::to_string(shard) + kind;
}
std::string part_path(const std::string& folder, std::size_t shard) { return path_of(folder, shard, ".part"); }

std::string head_of(const CampaignPlan& plan, std::size_t shard) {
  return Json{{"campaign", plan.sha256}, {"shard", shard}}.dump() + "\n";
}
std::string foot_of(std::size_t rows, const std::string& all_before) {
  return Json{{"rows", rows}, {"sha256", sha256(all_before)}}.dump() + "\n";
}

/// Whether `file` is what the path names now: it may have been finished while its lock was waited for.
bool still_named(int file, const std::string& path) {
  struct stat ours {
  }, named{};
  return ::fstat(file, &ours) == 0 && ::stat(path.c_str(), &named) == 0 && ours.st_ino == named.st_ino;
}

/// Of a whole file, against every other open file.
struct flock whole_lock() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

/// Whether some process holds the part's lock. Asks alone: a lock taken to find out would turn away who begins now.
bool locked(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
  if (file < 0) return false;
  auto lock = whole_lock();
  const bool held = ::fcntl(file, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  ::close(file);
  return held;
}

/// On the disk a name lasts once its folder does.
void sync_folder(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

}  // namespace

std::string shard_path(const std::string& folder, std::size_t shard) { return path_of(folder, shard, ".jsonl"); }

bool taken(const std::string& folder, std::size_t shard) {
  return std::filesystem::exists(shard_path(folder, shard)) || locked(part_path(folder, shard));
}

std::optional<ShardWriter> ShardWriter::begin(const std::string& folder, const CampaignPlan& plan, std::size_t shard) {
  const std::string path = part_path(folder, shard), whole = shard_path(folder, shard);
  for (;;) {
    if (std::filesystem::exists(whole)) return std::nullopt;
    // A link in a folder from elsewhere must not empty a file of the user's.
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644);
    if (file < 0) throw Failure(kCannotCreate, path + ":1: cannot be created; give the campaign a folder to write to");
    // File systems without locks are taken as they are: two who do one shard write the same bytes.
    auto lock = whole_lock();
    if (::fcntl(file, F_OFD_SETLK, &lock) != 0 && (errno == EAGAIN || errno == EACCES)) {
      ::close(file);
      throw Failure(kUnavailable, path + ":1: is being written by another process; wait for it, or end it first");
    }
    if (!still_named(file, path) || std::filesystem::exists(whole)) {
      if (still_named(file, path)) ::unlink(path.c_str());
      ::close(file);
      continue;
    }
    ShardWriter writer(folder, shard, file);
    if (::ftruncate(file, 0) != 0) throw Failure(kInputOutput, path + ":1: cannot be written; look at the disk");
    writer.write(head_of(plan, shard));
    return writer;
  }
}

ShardWriter::ShardWriter(ShardWriter&& other) noexcept
    : folder_(std::move(other.folder_)),
      shard_(other.shard_),
      file_(std::exchange(other.file_, -1)),
      text_(std::move(other.text_)),
      rows_(other.rows_) {}

ShardWriter::~ShardWriter() {
  if (file_ < 0) return;
  ::unlink(part_path(folder_, shard_).c_str());
  ::close(file_);
}

void ShardWriter::write(const std::string& text) {
  text_ += text;
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t n = ::write(file_, text.data() + at, text.size() - at);
    if (n < 0 && errno != EINTR)
      throw Failure(kInputOutput, part_path(folder_, shard_) + ":1: cannot be written to its end; free some space");
    at += n > 0 ? static_cast<std::size_t>(n) : 0;
  }
}

void ShardWriter::add(const std::string& rows) {
  rows_ += static_cast<std::size_t>(std::ranges::count(rows, '\n'));
  write(rows);
}

void ShardWriter::finish(double seconds) {
  const std::string path = part_path(folder_, shard_), whole = shard_path(folder_, shard_);
  write(foot_of(rows_, text_));
  const std::string took = path_of(folder_, shard_, ".seconds");
  ::unlink(took.c_str());
  std::ofstream(took) << seconds << '\n';
  if (::fsync(file_) != 0 || ::rename(path.c_str(), whole.c_str()) != 0)
    throw Failure(kInputOutput, whole + ":1: cannot be written to its end; free some space");
  sync_folder(folder_);
  ::close(std::exchange(file_, -1));
}

tl::expected<ShardRows, std::string> read_shard(const std::string& path, const CampaignPlan& plan) {
  const auto wrong = [&](const std::string& what) { return tl::unexpected(path + ":1: " + what); };
  const auto text = files::read_file(path, kLargestShard, "a shard");
  if (!text) return wrong(text.error().message);
  const auto head_end = text->find('\n');
  const auto head = Json::parse(text->substr(0, head_end), nullptr, false);
  if (head_end == text->npos || !head.is_object() || !head.contains("campaign") || !head.contains("shard") ||
      !head["shard"].is_number_unsigned())
    return wrong("is no shard; take it out of the folder");
  if (head["campaign"] != plan.sha256) return wrong("is a shard of another campaign; take it out of the folder");
  const std::size_t shard = head["shard"];
  if (shard >= plan.shards.size()) return wrong("is shard " + std::to_string(shard) + ", which there is none of");
  const auto foot_begin = text->find_last_of('\n', text->size() - 2) + 1;
  const auto foot = Json::parse(text->substr(foot_begin), nullptr, false);
  if (text->back() != '\n' || foot_begin <= head_end || !foot.is_object() || !foot.contains("sha256") ||
      !foot.contains("rows"))
    return wrong("is cut short; remove it and run shard " + std::to_string(shard) + " again");
  const auto body = text->substr(head_end + 1, foot_begin - head_end - 1);
  const auto count = static_cast<std::size_t>(std::ranges::count(body, '\n'));
  if (foot_of(count, text->substr(0, foot_begin)) != text->substr(foot_begin))
    return wrong("was changed after it was written; remove it and run shard " + std::to_string(shard) + " again");
  return ShardRows{shard, count, body};
}

Survey survey(const std::string& folder, const CampaignPlan& plan, const std::function<void(ShardRows&&)>& take) {
  Survey found;
  std::map<std::size_t, std::string> by_number;
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto name = entry.path().filename().string();
    if (name.starts_with("shard-") && !name.ends_with(".part") && !name.ends_with(".seconds")) names.push_back(name);
  }
  std::ranges::sort(names);
  for (const auto& name : names) {
    const std::string path = folder + "/" + name;
    auto rows = read_shard(path, plan);
    const auto known = rows ? by_number.find(rows->shard) : by_number.end();
    if (!rows)
      found.wrong.push_back(rows.error());
    else if (known != by_number.end())
      found.wrong.push_back(path + ":1: is shard " + std::to_string(rows->shard) + ", which " + known->second +
                            " is, too; remove one of them");
    else {
      by_number.emplace(rows->shard, path);
      take(std::move(*rows));
    }
  }
  double left_estimate_s = 0;
  for (std::size_t k = 0; k < plan.shards.size(); ++k) {
    if (by_number.contains(k)) {
      found.done.push_back(k);
      double seconds = 0;
      if (std::ifstream(path_of(folder, k, ".seconds")) >> seconds) {
        found.done_s += seconds;
        found.done_estimate_s += plan.seconds(k);
      }
      continue;
    }
    (locked(part_path(folder, k)) ? found.running : found.missing).push_back(k);
    left_estimate_s += plan.seconds(k);
  }
  const double measured = found.done_s > 0 && found.done_estimate_s > 0 ? found.done_s / found.done_estimate_s : 1;
  found.left_s = left_estimate_s * measured;
  return found;
}

std::string ranges(const std::vector<std::size_t>& numbers) {
  std::string text;
  for (std::size_t k = 0; k < numbers.size();) {
    std::size_t last = k;
    while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
    text += (text.empty() ? "" : ",") + std::to_string(numbers[k]);
    if (last > k) text += "-" + std::to_string(numbers[last]);
    k = last + 1;
  }
  return text;
}

}  // namespace backwash::services
