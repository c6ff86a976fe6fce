// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/foreign_table.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string_view>

#include "core/log/columns/import_columns.hpp"
#include "core/log/raw/log_file.hpp"

namespace backwash::log {
namespace {

constexpr std::size_t kSample = 3;  // rows of numbers, one below the other, that begin a table
constexpr std::string_view kBlanks = " \t\r\"";
using Cells = std::vector<std::string_view>;

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

std::string_view bare(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// Blanks: runs of them.
Cells cut(std::string_view line, char separator) {
  Cells cells;
  if (separator == ' ') line = bare(line);
  while (true) {
    const auto end = line.find(separator);
    cells.push_back(bare(line.substr(0, end)));
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(separator == ' ' ? std::min(line.find_first_not_of(' ', end), line.size()) : end + 1);
  }
}

/// "2024-08-23 16:23:49.12", with a T between or a zone behind: s since 1970, as a clock there. Nothing: it is no date.
std::optional<double> date_in(const std::string& text) {
  int year = 0;
  unsigned month = 0, day = 0, hour = 0, minute = 0;
  double second = 0;
  char between = 0;
  if (std::sscanf(text.c_str(), "%4d-%2u-%2u%c%2u:%2u:%lf", &year, &month, &day, &between, &hour, &minute, &second) !=
      7)
    return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
  if (!date.ok() || hour > 23 || minute > 59 || !(second < 61)) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return 86400.0 * static_cast<double>(days) + 3600.0 * hour + 60.0 * minute + second;
}

/// NaN of a gap; nothing of a text.
std::optional<double> number_in(std::string_view cell, bool decimal_comma) {
  const std::string text = lower_case(cell);
  if (text.empty() || text == "nan" || text == "null" || text == "na") return std::numeric_limits<double>::quiet_NaN();
  std::string plain = text;
  if (decimal_comma) std::ranges::replace(plain, ',', '.');
  const char* begin = plain.data() + (plain.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(begin, plain.data() + plain.size(), value);
  if (end != plain.data() + plain.size() && plain.size() > 10) return date_in(plain);
  if (error != std::errc{} || end != plain.data() + plain.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// How a file is cut into a table.
struct Shape {
  char separator = ',';
  bool decimal_comma = false;
  std::size_t first = 0, cells = 0;  ///< line of the first row of numbers, from 0; cells of a row
};

/// Whether a line may be a row: two numbers, and more numbers and gaps than texts.
bool is_row(const Cells& cells, bool decimal_comma) {
  std::size_t numbers = 0, texts = 0;
  for (const auto cell : cells) {
    const auto value = number_in(cell, decimal_comma);
    numbers += value && std::isfinite(*value) ? 1U : 0U;
    texts += value ? 0U : 1U;
  }
  return numbers >= 2 && texts <= numbers && number_in(cells.front(), decimal_comma);
}

std::optional<Shape> shape_of(const std::vector<std::string_view>& lines) {
  for (const char separator : {'\t', ';', ',', ' '}) {
    const bool comma = separator != ',';
    std::size_t held = 0, cells = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const Cells now = cut(lines[i], separator);
      if (!is_row(now, comma)) {
        held = 0;
        continue;
      }
      held = now.size() == cells ? held + 1 : 1;
      cells = now.size();
      if (held == kSample || (held > 0 && i + 1 == lines.size())) return Shape{separator, comma, i + 1 - held, cells};
    }
  }
  return std::nullopt;
}

/// The cells of a line above the rows, as many as those have; empty: it is no line of the header.
Cells header_line(std::string_view line, const Shape& shape) {
  line = bare(line);
  line.remove_prefix(std::min(line.find_first_not_of("#% "), line.size()));
  for (const char separator : {shape.separator, ',', ' '}) {
    Cells cells = cut(line, separator);
    while (cells.size() > shape.cells && cells.back().empty()) cells.pop_back();
    if (cells.size() == shape.cells) return cells;
    if (separator == shape.separator && separator != ' ' && cells.size() + 1 == shape.cells) {
      cells.emplace_back();  // a last one without a name
      return cells;
    }
  }
  return {};
}

bool blank(const Cells& cells) { return std::ranges::all_of(cells, &std::string_view::empty); }

/// "name [unit]" or "name (unit)" apart, where the unit is known or empty; of "name_unit" the unit alone.
std::pair<std::string, std::string> apart(std::string_view text) {
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}}) {
    const auto at = text.rfind(open);
    if (at == std::string_view::npos || at == 0 || !text.ends_with(close)) continue;
    const auto inner = bare(text.substr(at + 1, text.size() - at - 2));
    if (const auto unit = unit_called(std::string(inner)); !unit.empty() || inner.empty())
      return {std::string(bare(text.substr(0, at))), unit};
  }
  return {std::string(text), unit_in_name(std::string(text))};
}

/// Empty cells take what stands left of them.
std::vector<std::string> filled(const Cells& cells) {
  std::vector<std::string> all;
  for (const auto cell : cells) all.emplace_back(cell.empty() && !all.empty() ? all.back() : std::string(cell));
  return all;
}

using TableColumns = std::vector<ForeignTable::Column>;

/// Names by the lines of a header, the lowest last.
void give_names(TableColumns& columns, std::vector<Cells> header) {
  const auto units = [](const Cells& cells) {
    return std::ranges::all_of(cells, [](auto c) { return c.empty() || !unit_called(std::string(c)).empty(); });
  };
  if (header.size() > 1 && units(header.back())) {
    for (std::size_t i = 0; i < columns.size(); ++i) columns[i].unit = unit_called(std::string(header.back()[i]));
    header.pop_back();
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto [called, unit] = apart(header.back()[i]);
    columns[i].name = called;
    if (!unit.empty()) columns[i].unit = unit;
  }
  const auto twice = [&](const std::string& called) {
    return called.empty() || std::ranges::count(columns, called, &ForeignTable::Column::name) > 1;
  };
  header.pop_back();
  for (std::size_t above = header.size(); above-- > 0;) {
    const auto groups = filled(header[above]);
    if (std::ranges::none_of(columns, [&](const auto& c) { return twice(c.name); })) break;
    for (std::size_t i = 0; i < columns.size(); ++i)
      if (!groups[i].empty()) columns[i].name = groups[i] + (columns[i].name.empty() ? "" : " " + columns[i].name);
  }
  std::map<std::string, int> seen;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    auto& called = columns[i].name;
    if (called.empty()) called = "column " + std::to_string(i + 1);
    if (const int again = seen[called]++; again > 0) called += " (" + std::to_string(again + 1) + ")";
  }
}

/// A rate that the lines above a table state: alone in a line, or beside a word for it. 1/s.
std::optional<double> stated_rate(std::span<const std::string_view> lines) {
  for (const auto line : lines)
    for (const char separator : {'\t', ',', ';'}) {
      const Cells cells = cut(line, separator);
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const auto value = number_in(cells[i], false);
        const std::string before = i > 0 ? lower_case(cells[i - 1]) : "";
        const bool word = before.find("rate") != std::string::npos || before.find("frequency") != std::string::npos;
        if (value && *value > 0 && (word || cells.size() == 1)) return value;
      }
    }
  return std::nullopt;
}

/// Times of counted frames, where no column is called like a time.
void add_frame_times(TableColumns& columns, std::optional<double> rate) {
  const auto called = [&](std::string_view what) {
    return std::ranges::find_if(columns, [&](const auto& c) { return lower_case(c.name).starts_with(what); });
  };
  const auto frame = called("frame");
  if (!rate || frame == columns.end() || called("time") != columns.end()) return;
  ForeignTable::Column time{.name = kFrameTime, .unit = "s", .values = frame->values, .text = ""};
  for (double& t : time.values) t /= *rate;
  columns.push_back(std::move(time));
}

}  // namespace

const ForeignTable::Column* ForeignTable::find(const std::string& name) const {
  const auto at = std::ranges::find(columns, name, &Column::name);
  return at == columns.end() ? nullptr : &*at;
}

std::string ForeignTable::names() const {
  std::string all;
  for (const auto& column : columns) all += (all.empty() ? "" : ", ") + column.name;
  return all;
}

std::string unit_called(const std::string& text) {
  static const std::map<std::string, std::string> known{
      {"seconds", "s"},      {"sec", "s"},      {"meters", "m"},    {"metres", "m"},    {"millimeters", "mm"},
      {"millimetres", "mm"}, {"m s^-1", "m/s"}, {"m s-1", "m/s"},   {"m s^-2", "m/s2"}, {"m/s^2", "m/s2"},
      {"m s-2", "m/s2"},     {"m/s²", "m/s2"},  {"degrees", "deg"}, {"°", "deg"},       {"radians", "rad"},
      {"µs", "us"},          {"volt", "V"},     {"%", "percent"},   {"rpm", "1/min"},   {"inches", "in"},
      {"inch", "in"},        {"feet", "ft"},    {"mps", "m/s"},     {"mps2", "m/s2"},   {"celsius", "degC"},
      {"kmh", "km/h"},       {"knots", "kn"},   {"nsec", "ns"},     {"usec", "us"},     {"msec", "ms"},
      {"secs", "s"},         {"cmps", "cm/s"},  {"mmps", "mm/s"}};
  if (const auto at = known.find(lower_case(text)); at != known.end()) return at->second;
  static const std::vector<std::string> ours = all_units();
  for (const auto& unit : ours)
    if (unit == text || (unit.size() > 1 && lower_case(unit) == lower_case(text))) return unit;
  return "";
}

std::string unit_in_name(const std::string& name) {
  const auto at = name.find_last_of("_ ");
  if (at == std::string::npos || at == 0) return "";
  const auto unit = unit_called(name.substr(at + 1));
  return unit == "1" ? "" : unit;  // "motor_1" counts
}

tl::expected<ForeignTable, LogError> read_foreign_table(const std::string& path) {
  const auto content = read_log_file(path, files::kLargestTable, "a readable table");
  if (!content) return tl::make_unexpected(content.error());
  const auto bad = [&](std::size_t line, const std::string& what) {
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":" + std::to_string(line) + ": " + what});
  };
  std::string_view text = *content;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // spreadsheets write it
  std::vector<std::string_view> lines;
  const char line_end = text.find('\n') == text.npos ? '\r' : '\n';
  while (!text.empty()) {
    const auto end = std::min(text.find(line_end), text.size());
    lines.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  const auto shape = shape_of(lines);
  if (!shape) return bad(1, "no rows of numbers between tabs, semicolons, commas or blanks; give a table");
  ForeignTable table;
  table.columns.resize(shape->cells);
  std::vector<Cells> header;
  std::size_t above = shape->first;
  while (above > 0) {
    const Cells cells = header_line(lines[above - 1], *shape);
    if (cells.empty() || blank(cells)) break;
    header.insert(header.begin(), cells);
    --above;
  }
  table.named = !header.empty();
  give_names(table.columns, table.named ? header : std::vector<Cells>{Cells(shape->cells)});
  for (std::size_t i = shape->first; i < lines.size(); ++i) {
    if (bare(lines[i]).empty() || bare(lines[i]).starts_with('#')) continue;
    Cells cells = cut(lines[i], shape->separator);
    while (cells.size() > shape->cells && cells.back().empty()) cells.pop_back();
    if (cells.size() != shape->cells)
      return bad(i + 1, std::to_string(cells.size()) + " cells in a table of " + std::to_string(shape->cells) +
                            " columns; give one number per column");
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const auto value = number_in(cells[c], shape->decimal_comma);
      if (!value && table.columns[c].text_line == 0) {
        table.columns[c].text_line = i + 1;
        table.columns[c].text = cells[c];
      }
      if (value && !table.columns[c].dates && cells[c].size() > 10 && cells[c].find(':') != cells[c].npos)
        table.columns[c].dates = true;
      table.columns[c].values.push_back(value.value_or(std::numeric_limits<double>::quiet_NaN()));
    }
  }
  add_frame_times(table.columns, stated_rate(std::span(lines).first(above)));
  return table;
}

}  // namespace backwash::log
