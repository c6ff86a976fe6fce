// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace backwash {
/// Version and commit of this build, for --version.
const char* version();
}  // namespace backwash
