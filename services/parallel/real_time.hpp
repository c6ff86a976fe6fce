// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace backwash {

/// Gives the calling thread SCHED_FIFO with this priority (1 … 98). False, with errno set, if that is not allowed.
bool set_fifo(int priority) noexcept;
/// `priority` if a thread of this process may have SCHED_FIFO with it, else 0. The calling thread keeps its own.
int allowed_fifo(int priority);

}  // namespace backwash
