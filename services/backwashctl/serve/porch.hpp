// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string_view>

namespace backwash::ctl {

/// Connections whose request has not said its head yet. They cost no thread, and no memory of this process but a line
/// of a table: what has come stays in the kernel until the head is whole. At most kYoung: for a further one the oldest
/// goes, so that each has its time whatever number comes. One thread.
class Porch {
 public:
  static constexpr std::size_t kYoung = 512, kHeadBytes = 16 << 10;
  static constexpr std::chrono::seconds kHead{3};  ///< within which a head must be whole
  /// Takes a connection over, unread, with what can be seen of its request: its whole head at least.
  using Take = std::function<void(int socket, std::string_view seen)>;

  /// `listener` listens, and outlives this.
  explicit Porch(int listener);
  ~Porch();
  Porch(const Porch&) = delete;
  Porch& operator=(const Porch&) = delete;

  /// Lets in who waits, and hands over whose head is whole. Waits at most `milliseconds`.
  void step(int milliseconds, const Take& take);

 private:
  using Clock = std::chrono::steady_clock;
  struct Young {
    int socket;
    Clock::time_point until;
  };
  using Entry = std::map<std::uint64_t, Young>::iterator;
  void let_in(const Take& take);
  bool look(Entry young, const Take& take);
  void end(Entry young);

  int listener_, epoll_;
  std::map<std::uint64_t, Young> young_;  // by age
  std::uint64_t last_ = 0;
  std::array<char, kHeadBytes> seen_;
};

/// Whether 32 hexadecimal digits that `is_key` knows stand anywhere in a head.
bool shows_key(std::string_view head, const std::function<bool(std::string_view)>& is_key);

}  // namespace backwash::ctl
