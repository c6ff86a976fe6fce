// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace backwash::fuzz {

using Bytes = std::vector<std::uint8_t>;

/// Deterministic damage, a number of bytes long. BACKWASH_FUZZ_BYTES: bytes for each target (300,000 if not set);
/// BACKWASH_FUZZ_SEED. Both are printed, so that a failure can be made again.
class Mutator {
 public:
  /// `share` of the bytes is this target's.
  explicit Mutator(const char* target, double share = 1)
      : seed_(number("BACKWASH_FUZZ_SEED", 20261121)),
        left_(static_cast<double>(number("BACKWASH_FUZZ_BYTES", 300'000)) * share),
        random_(seed_) {
    std::printf("fuzz %s: seed %llu, %.3g bytes\n", target, static_cast<unsigned long long>(seed_), left_);
  }

  /// Takes `bytes` off the budget; false once it is spent.
  bool spend(std::size_t bytes) {
    left_ -= static_cast<double>(bytes);
    ++inputs_;
    return left_ > 0;
  }
  std::uint64_t inputs() const { return inputs_; }
  std::uint64_t bits() { return random_(); }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }
  bool one_in(std::size_t n) { return below(n) == 0; }

  Bytes noise(std::size_t size) {
    Bytes bytes(size);
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random_());
    return bytes;
  }

  /// One to eight changes: bits, bytes, words of extreme value, pieces cut, doubled, swapped in from elsewhere,
  /// inserted.
  Bytes damaged(Bytes b) {
    for (std::size_t n = 1 + below(8); n > 0 && !b.empty(); --n) change(b);
    return b;
  }

 private:
  static std::uint64_t number(const char* name, std::uint64_t otherwise) {
    const char* text = std::getenv(name);
    return text ? static_cast<std::uint64_t>(std::strtod(text, nullptr)) : otherwise;
  }

  // A place: every other one near the beginning, where headers are.
  std::size_t place(const Bytes& b) { return below(one_in(2) ? b.size() : std::min<std::size_t>(b.size(), 64)); }

  void change(Bytes& b) {
    const std::size_t at = place(b), length = 1 + below(std::min<std::size_t>(b.size() - at, 32));
    const auto from = b.begin() + static_cast<std::ptrdiff_t>(at), to = from + static_cast<std::ptrdiff_t>(length);
    switch (below(8)) {
      case 0:
      case 1:
        b[at] = static_cast<std::uint8_t>(b[at] ^ (1U << below(8)));
        break;
      case 2:
        b[at] = static_cast<std::uint8_t>(random_());
        break;
      case 3:
        extreme(b, at);
        break;
      case 4:
        b.erase(from, to);
        break;
      case 5: {
        const Bytes piece(from, to);
        b.insert(b.begin() + static_cast<std::ptrdiff_t>(below(b.size())), piece.begin(), piece.end());
        break;
      }
      case 6:
        std::copy(from, to, b.begin() + static_cast<std::ptrdiff_t>(below(b.size() - length + 1)));
        break;
      default:
        if (one_in(4)) b.resize(below(b.size()) + 1);
    }
  }

  // A word of 1, 2, 4 or 8 bytes that sizes and floats trip over.
  void extreme(Bytes& b, std::size_t at) {
    constexpr std::array<std::uint64_t, 10> kWords{0,
                                                   1,
                                                   0x7f,
                                                   0x80,
                                                   0xffff,
                                                   0x7fffffff,
                                                   0x80000000,
                                                   0x7ff8000000000000,  // NaN
                                                   0x7fefffffffffffff,  // the largest double
                                                   0xffffffffffffffff};
    const std::uint64_t word = kWords[below(kWords.size())];
    const std::size_t size = std::min<std::size_t>(std::size_t{1} << below(4), b.size() - at);
    for (std::size_t i = 0; i < size; ++i) b[at + i] = static_cast<std::uint8_t>(word >> (8 * i));
  }

  std::uint64_t seed_;
  double left_;
  std::mt19937_64 random_;
  std::uint64_t inputs_ = 0;
};

}  // namespace backwash::fuzz
