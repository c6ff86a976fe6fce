// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/dds/dds.hpp"

/// Large samples that are on their way: the middleware tells of one when it is whole, and of the others nothing.
namespace backwash::dds {

/// A sample of which not all fragments have come yet.
struct Partial {
  Guid writer{};
  std::uint64_t number = 0;                  ///< of the sample among its writer's
  std::size_t size = 0;                      ///< bytes of the sample
  std::uint32_t came = 0, count = 0;         ///< fragments, and how many it has
  std::int64_t begun_ns = 0, newest_ns = 0;  ///< when the first and the last new one came, ns by the caller's clock
};

constexpr std::size_t kLargeSample = 1u << 20;  ///< smaller ones are not looked at

constexpr std::size_t kPartialSamples = 4;  ///< that are kept at a time, each of another writer

/// Notes the fragments of large samples in a datagram of RTPS. The newest such sample of each of the newest writers is
/// kept; what is encrypted cannot be seen. Takes nothing for granted in the bytes. Real-time: no allocation, never
/// waits; beside another caller it may note nothing.
void note_fragments(std::span<const std::uint8_t> datagram, std::int64_t now_ns) noexcept;

/// The samples that note_fragments() keeps and of which not all has come.
std::vector<Partial> partial_samples();

}  // namespace backwash::dds
