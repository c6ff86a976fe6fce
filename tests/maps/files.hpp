// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "services/maps/geometry.hpp"

namespace backwash::maps {

/// A folder of its own for each test's files.
class MapFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "map_files_" + std::to_string(::getpid()) + "/";
    std::filesystem::create_directory(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  /// Reads a file of that name and content.
  Read read(const std::string& name, const std::string& content) {
    std::ofstream(folder_ + name, std::ios::binary) << content;
    return read_geometry(folder_ + name);
  }
  /// The file is refused, by its name and these words.
  void refused(const std::string& name, const std::string& content, const std::string& words) {
    const auto got = read(name, content);
    ASSERT_FALSE(got) << words;
    EXPECT_EQ(got.error().message.find(folder_ + name), 0u) << got.error().message;
    EXPECT_NE(got.error().message.find(words), std::string::npos) << got.error().message << "\n  wanted: " << words;
  }
  std::string folder_;
};

/// A number's bytes, as this machine has them or turned around.
template <typename T>
std::string bytes_of(T value, bool turned = false) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return turned ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

}  // namespace backwash::maps
