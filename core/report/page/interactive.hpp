// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/report/page/page_data.hpp"

namespace backwash::report {

/// Where Debian's packages of JavaScript libraries are: `javascript` below the folders of $XDG_DATA_DIRS.
std::vector<std::filesystem::path> javascript_folders();

/// What makes a page with drawings one with plots, a scene and files, all of it in the page.
struct Interactive {
  std::string notes;    ///< HTML for the body: the cursor of all plots, or which packages are missing
  std::string scripts;  ///< for html_page
};
/// dygraphs (libjs-dygraphs) and, where there is a scene, three.js (libjs-three) are copied in from the first folder
/// that holds them, with their licences; without them the drawings stay, and the notes say what to install.
Interactive interactive(const PageData& data, const std::vector<std::filesystem::path>& folders);

}  // namespace backwash::report
