// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/report/page/page_data.hpp"

namespace backwash::report {

/// Where Debian's packages of JavaScript libraries are: `javascript` below the folders of $XDG_DATA_DIRS.
std::vector<std::filesystem::path> javascript_folders();

/// What gives a page's charts zoom and cursor, its scene and its files, all of it in the page.
struct Interactive {
  std::string notes;    ///< HTML for the body: the cursor of all plots, or which package is missing
  std::string scripts;  ///< for html_page
};
/// Where there is a scene, three.js (libjs-three) is copied in from the first folder that holds it, with its licence;
/// without it the notes say what to install.
Interactive interactive(const PageData& data, const std::vector<std::filesystem::path>& folders);

}  // namespace backwash::report
