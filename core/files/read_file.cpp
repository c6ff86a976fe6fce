// SPDX-License-Identifier: BSD-3-Clause
#include "core/files/read_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace backwash::files {
namespace {

using Kind = FileError::Kind;

/// Closes at the end of the scope.
struct Descriptor {
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  int fd;
};

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  return "no regular file";
}

}  // namespace

tl::expected<std::string, FileError> read_file(const std::string& path, std::size_t most_bytes,
                                               const std::string& wanted) {
  const auto error = [&](Kind kind, const std::string& what) {
    return tl::unexpected(FileError{kind, what + "; needs " + wanted});
  };
  const auto unreadable = [&] {
    return error(Kind::not_found, "cannot be read: " + std::string(std::strerror(errno)));
  };
  // Without O_NONBLOCK the open of a FIFO waits for its writer.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)};
  if (file.fd < 0) return unreadable();
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) return unreadable();
  if (!S_ISREG(status.st_mode)) return error(Kind::not_regular, std::string("is ") + kind_of(status.st_mode));
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (size > most_bytes) {
    return error(Kind::too_large,
                 "has " + std::to_string(size >> 20) + " MiB, the cap is " + std::to_string(most_bytes >> 20) + " MiB");
  }
  std::string content(size, '\0');
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t n = ::read(file.fd, content.data() + done, content.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return unreadable();
    if (n == 0) break;  // it became shorter meanwhile
    done += static_cast<std::size_t>(n);
  }
  content.resize(done);
  return content;
}

}  // namespace backwash::files
