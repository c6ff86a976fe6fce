// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/sealed_row.hpp"

#include <stdexcept>
#include <string_view>

#include "core/files/read_file.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kLargestRows = std::size_t{16} << 30;
constexpr std::string_view kSeal = ",\"sha256\":\"";
constexpr std::size_t kSealed = kSeal.size() + 64 + 2;  // its hash, and what closes text and row

/// The row without its seal.
std::string unsealed(std::string_view line) {
  if (line.size() <= kSealed || line.substr(line.size() - kSealed, kSeal.size()) != kSeal) return "";
  return std::string(line.substr(0, line.size() - kSealed)) + "}";
}

/// What is wrong with a line that should be a row; empty: nothing.
std::string wrong_with(std::string_view line, const Json& row, const Json& made) {
  if (row.is_discarded() || !row.is_object() || !row.contains("made") || !row.contains("log")) return "no row";
  if (line.substr(line.size() - 66, 64) != sha256(unsealed(line))) return "was changed after it was written";
  for (const auto& [name, value] : made.items())
    if (row["made"].value(name, Json()) != value)
      return "was made with another " + name + ": " + row["made"].value(name, Json()).dump() + ", here it is " +
             value.dump();
  return "";
}

}  // namespace

std::string file_identity(const std::string& path) {
  return path.empty() || path.starts_with("builtin:") ? path : sha256_of_file(path);
}

std::string sealed(const Json& row) {
  try {
    std::string text = row.dump();
    const std::string hash = sha256(text);
    text.pop_back();
    return text.append(kSeal) + hash + "\"}\n";
  } catch (const Json::type_error&) {
    throw Failure(kBadData, row.at("log").get<std::string>() + ":1: its name is no UTF-8; give it another");
  }
}

void read_sealed(const std::string& path, const std::string& verb, const Json& made,
                 const std::function<void(const Json&)>& take) {
  std::size_t number = 0;
  const auto each = [&](std::string_view line) {
    const auto refuse = [&](const std::string& what) {
      throw Failure(kBadData, path + ":" + std::to_string(number) + ": " + what + "; make it again with " + verb);
    };
    ++number;
    const auto row = Json::parse(unsealed(line), nullptr, false);
    const auto wrong = wrong_with(line, row, made);
    if (wrong == "no row") refuse("is no line of it, or is cut short");
    if (!wrong.empty()) refuse(wrong);
    try {
      take(row);
    } catch (const Failure& wrong_row) {
      refuse(wrong_row.what());
    } catch (const std::out_of_range&) {
      refuse("is no line of it");
    } catch (const Json::exception&) {
      refuse("is no line of it");
    }
  };
  const auto read = files::each_line(path, kLargestRows, "a file of what " + verb + " printed", each);
  if (!read) throw Failure(kNoInput, path + ":1: " + read.error().message);
  if (number == 0) throw Failure(kBadData, path + ":1: is empty; fill it with " + verb);
}

}  // namespace backwash::services
