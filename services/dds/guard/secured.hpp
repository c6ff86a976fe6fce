// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

struct dds_qos;

namespace backwash::dds {

/// Quality of a participant that speaks by the middleware's plug-ins of DDS Security with this folder of credentials;
/// null, the usual one, without a folder. The caller deletes it.
dds_qos* secured(const std::string& credentials);

}  // namespace backwash::dds
