// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/private_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

#include "services/backwash/verb.hpp"

namespace backwash::services {

void write_private(const std::string& path, const std::string& content, bool force) {
  const std::string part = path + ".part-" + std::to_string(::getpid());
  const auto failed = [&](ExitCode code, const std::string& what) {
    const std::string reason = std::generic_category().message(errno);
    ::unlink(part.c_str());
    return Failure(code, path + ":1: " + what + ": " + reason);
  };
  const int fd = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) throw Failure(kCannotCreate, path + ":1: cannot be created: " + std::generic_category().message(errno));
  const bool whole = ::fchmod(fd, 0600) == 0 &&
                     ::write(fd, content.data(), content.size()) == static_cast<ssize_t>(content.size()) &&
                     ::fsync(fd) == 0;
  if (::close(fd) != 0 || !whole) throw failed(kInputOutput, "cannot be written to its end");
  // A link is made only where there is nothing; a rename replaces.
  const int placed = force ? std::rename(part.c_str(), path.c_str()) : ::link(part.c_str(), path.c_str());
  if (placed != 0)
    throw failed(kCannotCreate, errno == EEXIST ? "exists already; --force replaces it" : "cannot be put there");
  if (!force) ::unlink(part.c_str());
}

}  // namespace backwash::services
