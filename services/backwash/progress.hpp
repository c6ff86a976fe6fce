// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace backwash::services {

/// What is at work now. Work of more than 2 s is shown on stderr: on a terminal as a bar with rate and time left where
/// the amount is known, otherwise a line each 10 s.
void progress(const std::string& what);
/// How far it is; of any thread.
void progress(std::size_t done, std::size_t of);
/// Nothing is at work any more: takes the bar away. Before anything is printed.
void end_progress();
/// Nothing is shown from now on.
void be_quiet();

/// Parallel on all processors, its share shown as the progress of what is at work. Throws Interrupted between
/// two items once Ctrl-C was pressed and finish_what_is_done() was called.
void run_shown(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work);

/// The first Ctrl-C ends the work at hand and leaves what is finished to be written; the second ends the program.
void finish_what_is_done();
bool interrupted() noexcept;
struct Interrupted {};

/// The line that shows a stage of which `done` of `of` is done after `stage_s` seconds; `of` 0: the amount is not
/// known.
std::string progress_line(const std::string& what, std::size_t done, std::size_t of, double stage_s, bool bar);

}  // namespace backwash::services
