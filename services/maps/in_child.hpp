// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <tl/expected.hpp>

namespace backwash::maps {

/// Takes bytes that the child says.
using Sink = std::function<void(const char* bytes, std::size_t count)>;

/// Runs `work` in a process of its own and returns what it said. For libraries that damaged input may end or keep for
/// ever, or make ask for all memory: the child has `seconds` of processor time and `most_bytes` of addresses (not held
/// under an address sanitizer, which takes 2^44 for itself). Error: how the child ended, as "ended with signal 11", or
/// that it could not be made. Precondition: this process has no other thread.
tl::expected<std::string, std::string> in_child(const std::function<void(const Sink&)>& work, std::size_t seconds,
                                                std::size_t most_bytes);

}  // namespace backwash::maps
