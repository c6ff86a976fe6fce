// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace backwash::services {

/// Path of the program that runs now.
std::string own_program();

/// A program that was started. It is killed when this one ends, whatever ends this one.
struct Child {
  pid_t process;
  int output;  ///< reads its standard output; −1 where that is this program's own
};
/// Starts `command` in `folder` (empty: here) with nothing to read. A first word `backwash` is this program, one
/// without a slash is looked for in PATH. Started from the thread that lives longest: the child ends with its thread.
/// Throws Failure 71 where no process can be made; a program that cannot be run ends with 127.
Child start(const std::vector<std::string>& command, const std::string& folder, bool capture);
/// Everything that is still to come of its output; closes it.
std::string read_to_end(Child& child);
/// Waits for it: its exit code, or 128 and the number of the signal that ended it.
int wait_for(const Child& child);
/// The code in a status of waitpid, in the same way.
int code_of(int status) noexcept;
/// "ended with 65", "was ended by signal 9".
std::string end_in_words(int code);

/// The words as a line for sh, each quoted where it has to be.
std::string shell_line(const std::vector<std::string>& words);

}  // namespace backwash::services
