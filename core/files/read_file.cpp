// SPDX-License-Identifier: BSD-3-Clause
#include "core/files/read_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>

namespace backwash::files {
namespace {

using Kind = FileError::Kind;

constexpr std::size_t kReadAtOnce = std::size_t{1} << 20;

FileError unreadable(const std::string& wanted) {
  return {Kind::not_found, "cannot be read: " + std::string(std::strerror(errno)) + "; needs " + wanted};
}

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  return "no regular file";
}

/// A regular file that is open; closes it at the end of the scope.
class Open {
 public:
  // Without O_NONBLOCK the open of a FIFO waits for its writer.
  explicit Open(const std::string& path) : fd_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)) {}
  ~Open() {
    if (fd_ >= 0) ::close(fd_);
  }
  Open(const Open&) = delete;
  Open& operator=(const Open&) = delete;

  /// Bytes that it has.
  tl::expected<std::uint64_t, FileError> size(std::size_t most_bytes, const std::string& wanted) const {
    struct stat status {};
    if (fd_ < 0 || ::fstat(fd_, &status) != 0) return tl::unexpected(unreadable(wanted));
    if (!S_ISREG(status.st_mode))
      return tl::unexpected(
          FileError{Kind::not_regular, std::string("is ") + kind_of(status.st_mode) + "; needs " + wanted});
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (size > most_bytes)
      return tl::unexpected(FileError{Kind::too_large, "has " + std::to_string(size >> 20) + " MiB, the cap is " +
                                                           std::to_string(most_bytes >> 20) + " MiB; needs " + wanted});
    return size;
  }
  /// Reads on into `to` until it is full or the file ends; how many bytes, below 0 where it cannot be read.
  ssize_t read(char* to, std::size_t room) const {
    std::size_t done = 0;
    while (done < room) {
      const ssize_t n = ::read(fd_, to + done, room - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return n;
      if (n == 0) break;
      done += static_cast<std::size_t>(n);
    }
    return static_cast<ssize_t>(done);
  }

 private:
  int fd_;
};

}  // namespace

tl::expected<std::string, FileError> read_file(const std::string& path, std::size_t most_bytes,
                                               const std::string& wanted) {
  const Open file(path);
  const auto size = file.size(most_bytes, wanted);
  if (!size) return tl::unexpected(size.error());
  std::string content(*size, '\0');
  const ssize_t done = file.read(content.data(), content.size());
  if (done < 0) return tl::unexpected(unreadable(wanted));
  content.resize(static_cast<std::size_t>(done));  // it may have become shorter meanwhile
  return content;
}

tl::expected<void, FileError> each_line(const std::string& path, std::size_t most_bytes, const std::string& wanted,
                                        const std::function<void(std::string_view)>& take) {
  const Open file(path);
  const auto size = file.size(most_bytes, wanted);
  if (!size) return tl::unexpected(size.error());
  std::string held;  // what is read and not taken
  for (std::uint64_t left = *size; left > 0;) {
    const std::size_t before = held.size(), now = std::min<std::uint64_t>(left, kReadAtOnce);
    held.resize(before + now);
    const ssize_t done = file.read(held.data() + before, now);
    if (done < 0) return tl::unexpected(unreadable(wanted));
    held.resize(before + static_cast<std::size_t>(done));
    left = static_cast<std::size_t>(done) < now ? 0 : left - now;
    std::size_t begin = 0;
    for (std::size_t end = held.find('\n', before); end != std::string::npos; end = held.find('\n', begin)) {
      take(std::string_view(held).substr(begin, end - begin));
      begin = end + 1;
    }
    held.erase(0, begin);
  }
  if (!held.empty()) take(held);
  return {};
}

}  // namespace backwash::files
