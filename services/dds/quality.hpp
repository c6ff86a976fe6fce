// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "services/dds/dds.hpp"

struct dds_qos;

namespace backwash::dds {

enum class Role { reader, writer };

/// Quality of a reader or writer of this delivery. Its user data has the hash of the type, by its name on the wire, as
/// ROS 2 from Iron on looks for it ("typehash=RIHS01_…;"). The caller deletes it.
dds_qos* quality(Delivery delivery, Role role, std::string_view type);

}  // namespace backwash::dds
