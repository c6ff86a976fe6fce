// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/key_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <span>
#include <string_view>
#include <system_error>

namespace backwash::config {
namespace {

constexpr std::size_t kLargest = 80;  // bytes: 64 digits and some white space

/// The first bytes of the open file, at most as many as fit. It is judged as it is open, not by its name.
tl::expected<std::size_t, std::string> read_private(int fd, std::span<char> into) {
  struct stat about {};
  if (::fstat(fd, &about) != 0 || !S_ISREG(about.st_mode)) return tl::unexpected<std::string>("needs a regular file");
  if ((about.st_mode & 0177) != 0) {
    std::array<char, 80> text;
    std::snprintf(text.data(), text.size(), "has mode %04o, needs 0600: nobody but its owner may read a key",
                  about.st_mode & 07777U);
    return tl::unexpected<std::string>(text.data());
  }
  const auto n = ::read(fd, into.data(), into.size());
  if (n < 0) return tl::unexpected("cannot be read: " + std::generic_category().message(errno));
  return static_cast<std::size_t>(n);
}

tl::expected<SecretKey, std::string> key_of(std::string_view text) {
  SecretKey key{};
  if (text.size() == key.size()) {
    std::ranges::copy(text, key.begin());
  } else {
    text = text.substr(0, text.find_last_not_of(" \t\r\n") + 1);
    const auto digit = [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
    };
    if (text.size() != 2 * key.size() || !std::ranges::all_of(text, digit))
      return tl::unexpected<std::string>(
          "needs a file of 32 bytes or 64 hexadecimal digits, as of openssl rand -hex 32");
    for (std::size_t i = 0; i < key.size(); ++i)
      std::from_chars(text.data() + 2 * i, text.data() + 2 * i + 2, key[i], 16);
  }
  if (key == SecretKey{})
    return tl::unexpected<std::string>("needs a key that is not all zero: MAVLink has that mean none");
  return key;
}

}  // namespace

tl::expected<SecretKey, std::string> read_key_file(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd < 0) return tl::unexpected("cannot be opened: " + std::generic_category().message(errno));
  std::array<char, kLargest> text;
  const auto size = read_private(fd, text);
  ::close(fd);
  if (!size) return tl::unexpected(size.error());
  return key_of({text.data(), *size});
}

}  // namespace backwash::config
