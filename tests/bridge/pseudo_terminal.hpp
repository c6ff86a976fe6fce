// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <string>

#include "tests/bridge/bytes.hpp"

namespace backwash::firmware_bridge::test {

using mavlink::test::Bytes;

/// The far end of a real serial line: the master of a pseudo-terminal, whose slave the code under test opens by path.
class PseudoTerminal {
 public:
  PseudoTerminal() : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    std::array<char, 64> name{};
    EXPECT_EQ(::grantpt(master_), 0);
    EXPECT_EQ(::unlockpt(master_), 0);
    EXPECT_EQ(::ptsname_r(master_, name.data(), name.size()), 0);
    path_ = name.data();
  }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;
  ~PseudoTerminal() { hang_up(); }

  const std::string& path() const { return path_; }
  int master() const { return master_; }
  void hang_up() {
    if (master_ >= 0) ::close(master_);
    master_ = -1;
  }
  /// A full buffer is waited for, for at most a second: the kernel hands its bytes over in its own time.
  void write(std::span<const std::uint8_t> bytes) {
    for (int i = 0; i < 1000 && !bytes.empty(); ++i) {
      const ssize_t n = ::write(master_, bytes.data(), bytes.size());
      if (n > 0) bytes = bytes.subspan(static_cast<std::size_t>(n));
      if (!bytes.empty()) ::usleep(1000);
    }
    ASSERT_TRUE(bytes.empty());
  }
  /// All that has arrived.
  Bytes read() {
    Bytes all;
    std::array<std::uint8_t, 4096> chunk;
    for (ssize_t n; (n = ::read(master_, chunk.data(), chunk.size())) > 0;)
      all.insert(all.end(), chunk.begin(), chunk.begin() + n);
    return all;
  }
  /// All that has arrived once something has, for at most a second.
  Bytes await() {
    Bytes bytes = read();
    for (int i = 0; i < 1000 && bytes.empty(); ++i) {
      ::usleep(1000);
      bytes = read();
    }
    return bytes;
  }

 private:
  int master_;
  std::string path_;
};

}  // namespace backwash::firmware_bridge::test
