// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page.hpp"

namespace backwash::report {
namespace {

const char* const kStyle = R"(
:root { color-scheme: light; }
body { font: 16px/1.5 "DejaVu Sans", system-ui, sans-serif; color: #1d2430; background: #f4f6f8; margin: 0; }
main { max-width: 1060px; margin: 0 auto; padding: 32px 24px 64px; }
h1 { font-size: 1.7em; margin: 0 0 4px; } h2 { font-size: 1.15em; margin: 0 0 4px; }
.context { color: #5a6675; margin: 0 0 20px; font-size: 0.9em; }
.verdict { padding: 14px 20px; border-radius: 8px; font-weight: 600; margin: 0 0 24px; }
.passed { background: #e2f3e6; color: #17602c; border: 1px solid #a9d8b6; }
.failed { background: #fbe6e4; color: #8c1c13; border: 1px solid #e8b2ac; }
section { background: #fff; border: 1px solid #dfe4ea; border-radius: 8px; padding: 18px 22px; margin: 0 0 20px; }
section p { color: #4b5766; margin: 0 0 10px; font-size: 0.9em; }
svg { width: 100%; height: auto; display: block; } svg image { image-rendering: pixelated; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 6px 10px; border-bottom: 1px solid #e8ecf0; font-weight: normal; }
th { color: #4b5766; width: 55%; } .wide th { width: auto; } .wide { font-size: 0.78em; } thead th { font-weight: 600; color: #1d2430; }
)";

}  // namespace

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else if (c == '&')
      safe += "&amp;";
    else if (c == '"')
      safe += "&quot;";
    else
      safe += c;
  }
  return safe;
}

std::string html_page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>" + escaped(title) +
         "</title>\n<style>" + kStyle + "</style>\n</head>\n<body>\n<main>\n" + body + "</main>\n</body>\n</html>\n";
}

}  // namespace backwash::report
