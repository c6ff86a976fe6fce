// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/page.hpp"

#include <string_view>

#include "core/report/page/page_files.hpp"

namespace backwash::report {
namespace {

/// Goes through a body tag by tag and adds what every page owes its reader: names, scopes, room to scroll.
class Framer {
 public:
  explicit Framer(std::string_view body) : rest_(body) {}

  std::string framed() {
    for (auto tag = next(); !tag.empty(); tag = next()) take(tag);
    return std::move(out_) + std::string(rest_);
  }

 private:
  /// Moves what stands before the next tag to the page; the tag, or nothing.
  std::string_view next() {
    const auto begin = rest_.find('<'), end = rest_.find('>', begin);
    if (end == rest_.npos) return {};
    const auto before = rest_.substr(0, begin), tag = rest_.substr(begin, end + 1 - begin);
    out_ += before;
    if (heading_) name_ += before;
    rest_.remove_prefix(end + 1);
    return tag;
  }

  void take(std::string_view tag) {
    if (tag == "<h2>" || tag == "<h3>") {
      heading_ = true;
      name_.clear();
    }
    if (tag == "</h2>" || tag == "</h3>") heading_ = false;
    if (tag == "<thead>" || tag == "</thead>") head_ = tag == "<thead>";
    if (tag.starts_with("<table"))
      open_table(tag);
    else if (tag == "</table>")
      out_ += "</table></div>";
    else if (tag.starts_with("<svg"))
      take_svg(tag);
    else if (tag == "<th>")
      open_head();
    else
      out_ += tag;
  }

  std::string scrolling() const { return "<div class=\"scroll\" role=\"group\" tabindex=\"0\" aria-label=\"" + name_; }

  void open_table(std::string_view tag) {
    // Two columns break their words and need no room; only what does scroll has to be reached by the keyboard.
    out_ += tag.find("wide") == tag.npos ? "<div class=\"scroll\">" : scrolling() + ", table\">";
    out_ += std::string(tag) + "<caption>" + name_ + "</caption>";
  }

  /// Within the picture nothing is ours.
  void take_svg(std::string_view tag) {
    out_ += "<div class=\"drawing\">" + scrolling() + ", figure\"><svg role=\"img\" aria-label=\"" + name_ + '"';
    out_ += tag.substr(4);
    const auto end = rest_.find("</svg>");
    if (end == rest_.npos) return;
    out_ += rest_.substr(0, end);
    out_ += "</svg></div></div>";
    rest_.remove_prefix(end + 6);
  }

  void open_head() {
    const bool empty = rest_.starts_with("</th>");
    if (empty) rest_.remove_prefix(5);
    out_ += empty ? "<td></td>" : head_ ? "<th scope=\"col\">" : "<th scope=\"row\">";
  }

  std::string_view rest_;
  std::string out_, name_;
  bool heading_ = false, head_ = false;
};

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

std::string table(const std::string& rows, bool wide) {
  return (wide ? "<table class=\"wide\">\n" : "<table>\n") + rows + "</table>\n";
}

std::string section(const std::string& title, const std::string& words, const std::string& content) {
  return "<section><h2>" + escaped(title) + "</h2>\n" + (words.empty() ? "" : "<p>" + words + "</p>\n") + content +
         "</section>\n";
}

std::string html_page(const std::string& title, const std::string& body, const std::string& scripts) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
         "content=\"width=device-width, initial-scale=1\">\n<meta http-equiv=\"Content-Security-Policy\" "
         "content=\"default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src "
         "'unsafe-inline'\">\n<title>" +
         escaped(title) + "</title>\n<style>" + kStyle +
         "</style>\n</head>\n<body>\n<a class=\"skip\" href=\"#content\">To the content</a>\n<main id=\"content\" "
         "tabindex=\"-1\">\n" +
         Framer(body).framed() + "</main>\n" + scripts + "</body>\n</html>\n";
}

}  // namespace backwash::report
