// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace backwash::files {

/// A picture as a PNG file (ISO/IEC 15948, 8 bits of red, green, blue, alpha). `rgba`: a pixel each, 0xRRGGBBAA, from
/// the top left in rows of `width`.
std::string png(std::size_t width, std::span<const std::uint32_t> rgba);

}  // namespace backwash::files
