// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>

namespace backwash::report {

/// Why a figure could not be drawn; one line that says what would be right (gnuplot missing, or its own words).
struct PlotError {
  std::string message;
};

enum class Format { svg, png };

/// Text as gnuplot's literal string, quotes included, whatever it holds: within single quotes nothing is run or
/// replaced. A control character, which would end the command there, becomes '?', an apostrophe ’ (doubled ones, the
/// documented way, gnuplot 5.4 takes for the end where two of them meet). What others chose (a file's name) enters a
/// script by this alone.
std::string gnuplot_quoted(const std::string& text);

/// Runs gnuplot (Debian: gnuplot-nox) as a subprocess on a script that has neither terminal nor output, and returns the
/// picture: SVG text without XML prolog, ready to stand inside HTML, or PNG bytes. Sizes in pixels. About 50 ms.
tl::expected<std::string, PlotError> draw(const std::string& script, Format format, int width, int height);

}  // namespace backwash::report
