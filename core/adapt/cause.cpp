// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/cause.hpp"

#include <array>
#include <cstddef>

namespace backwash::adapt {
namespace {

struct Words {
  const char *name, *explained;
};
constexpr std::array<Words, 5> kCauses{{{"none", "as promised"},
                                        {"unknown", "the flight cannot tell whether it is the air"},
                                        {"constant", "most of it is constant: a load, a push, a trim"},
                                        {"motion", "most of it follows the commanded motion: delay, lag or gains"},
                                        {"air", "the air is rougher"}}};

}  // namespace

const char* to_string(Cause cause) noexcept { return kCauses[static_cast<std::size_t>(cause)].name; }
const char* explained(Cause cause) noexcept { return kCauses[static_cast<std::size_t>(cause)].explained; }

}  // namespace backwash::adapt
