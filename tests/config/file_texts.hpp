// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "core/config/config.hpp"

namespace backwash::config {

/// The text of a file that the programs carry within them.
inline std::string shipped(const std::string& name) {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR "/core/config/files/") + name);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline std::string temporary_path() {
  return testing::TempDir() + "backwash_config_test_" + std::to_string(getpid()) + ".toml";
}

/// Writes text to a file of its own and removes it afterwards.
struct TemporaryFile {
  explicit TemporaryFile(const std::string& text) : path(temporary_path()) { std::ofstream(path) << text; }
  ~TemporaryFile() { std::filesystem::remove(path); }
  std::string path;
};

/// Message of the error that a file with this text gives, "" if it loads.
inline std::string message(bool vehicle, const std::string& text) {
  const TemporaryFile file(text);
  if (vehicle) {
    const auto v = load_vehicle(file.path);
    return v ? "" : v.error().message;
  }
  const auto m = load_model(file.path);
  return m ? "" : m.error().message;
}

/// The first `from` becomes `to`; it has to be there.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

}  // namespace backwash::config
