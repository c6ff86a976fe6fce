// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/interactive.hpp"

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "core/report/page/page.hpp"
#include "core/report/page/page_files.hpp"

namespace backwash::report {
namespace {

const char* const kFile = "three/three.min.js";
const char* const kAbout = "three.js r111, copyright 2010–2019 three.js authors";
const char* const kMit =
    "Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated "
    "documentation files (the \"Software\"), to deal in the Software without restriction, including without limitation "
    "the rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and "
    "to permit persons to whom the Software is furnished to do so, subject to the following conditions: The above "
    "copyright notice and this permission notice shall be included in all copies or substantial portions of the "
    "Software. THE SOFTWARE IS PROVIDED \"AS IS\", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT "
    "LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT "
    "SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION "
    "OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER "
    "DEALINGS IN THE SOFTWARE.";
/// The cursor of all plots.
std::string cursor(const PageData& data) {
  return "<div class=\"cursor\"><label for=\"time\">" + escaped(data.along) +
         "</label><input type=\"range\" id=\"time\" min=\"0\" max=\"1\" step=\"0.02\" value=\"0\"><output "
         "for=\"time\"></output><button type=\"button\" id=\"closer\">Zoom in</button><button type=\"button\" "
         "id=\"farther\">Zoom out</button><button type=\"button\" id=\"whole\">All of it</button></div>\n";
}

/// The text of three.js; empty if no folder holds it.
std::string found(const std::vector<std::filesystem::path>& folders) {
  for (const auto& folder : folders) {
    std::ostringstream text;
    if (std::ifstream file(folder / kFile, std::ios::binary); file && text << file.rdbuf()) return text.str();
  }
  return "";
}

/// A script that its own text cannot end: in strings and comments "<\/script" is "</script", and elsewhere there is
/// none.
std::string script(std::string text) {
  for (auto at = text.find("</script"); at != text.npos; at = text.find("</script", at + 1))
    text.replace(at, 2, "<\\/");
  return "<script>\n" + text + "\n</script>\n";
}

}  // namespace

std::vector<std::filesystem::path> javascript_folders() {
  const char* set = std::getenv("XDG_DATA_DIRS");
  std::istringstream all(set && *set ? set : "/usr/local/share:/usr/share");
  std::vector<std::filesystem::path> folders;
  for (std::string folder; std::getline(all, folder, ':');)
    folders.push_back(std::filesystem::path(folder) / "javascript");
  return folders;
}

Interactive interactive(const PageData& data, const std::vector<std::filesystem::path>& folders) {
  Interactive page;
  page.scripts = "<script type=\"application/json\" id=\"data\">" + to_json(data) + "</script>\n";
  const std::string library = data.scene ? found(folders) : "";
  if (!library.empty()) {
    page.scripts +=
        script("/*! " + std::string(kAbout) + "; MIT licence, see the end of this page's text */\n" + library);
    page.notes += "<details class=\"licence\"><summary>Library in this page</summary>\n<p>" + std::string(kAbout) +
                  ".</p>\n<p>" + kMit + "</p>\n</details>\n";
  } else if (data.scene) {
    page.notes +=
        "<p class=\"note\">There is no view in three dimensions: install Debian's libjs-three and write this page "
        "again.</p>\n";
  }
  page.scripts += script(kScript);
  if (!data.plots.empty()) page.notes += cursor(data);
  return page;
}

}  // namespace backwash::report
