// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/page_parts.hpp"

#include <fstream>
#include <sstream>

#include "core/config/builtin_files.hpp"

namespace backwash::services {
namespace {

std::string shell_word(const std::string& word) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == word.npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string content(const std::string& path) {
  std::ostringstream text;
  if (std::ifstream file(path, std::ios::binary); file) text << file.rdbuf();
  return text.str();
}

std::string file_text(const std::string& path, const std::string& ending) {
  constexpr std::string_view kBuiltin = "builtin:";
  if (!path.starts_with(kBuiltin)) return content(path);
  for (const auto& file : config::builtin_files())
    if (file.name == path.substr(kBuiltin.size()) + ending) return std::string(file.text);
  return "";
}

}  // namespace

std::string own_command() {
  std::istringstream words(content("/proc/self/cmdline"));
  std::string line = "backwash", word;
  std::getline(words, word, '\0');
  while (std::getline(words, word, '\0')) line += " " + shell_word(word);
  return line;
}

std::vector<std::pair<std::string, std::string>> parameter_files(const std::string& vehicle, const std::string& model) {
  std::vector<std::pair<std::string, std::string>> files;
  if (auto text = file_text(vehicle, ".vehicle.toml"); !text.empty()) files.emplace_back("Vehicle " + vehicle, text);
  if (auto text = file_text(model, ".model.toml"); !text.empty()) files.emplace_back("Model " + model, text);
  return files;
}

}  // namespace backwash::services
