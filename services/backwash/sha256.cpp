// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/sha256.hpp"

#include <sha2.h>  // libmd

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

std::string digits(SHA2_CTX& context) {
  std::array<std::uint8_t, SHA256_DIGEST_LENGTH> digest;
  SHA256Final(digest.data(), &context);
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const auto byte : digest) text += {kDigits[byte >> 4], kDigits[byte & 15]};
  return text;
}

}  // namespace

std::string sha256(std::string_view bytes) {
  SHA2_CTX context;
  SHA256Init(&context);
  SHA256Update(&context, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  return digits(context);
}

std::string sha256_of_file(const std::string& path) {
  std::error_code unknown;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, unknown)) file.open(path, std::ios::binary);
  if (!file.is_open()) throw Failure(kNoInput, path + ":1: cannot be read; give the path of a file");
  SHA2_CTX context;
  SHA256Init(&context);
  std::vector<char> block(1 << 20);
  do {
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    SHA256Update(&context, reinterpret_cast<const std::uint8_t*>(block.data()),
                 static_cast<std::size_t>(file.gcount()));
  } while (file);
  if (file.bad()) throw Failure(kInputOutput, path + ":1: cannot be read to its end; look at the disk");
  return digits(context);
}

}  // namespace backwash::services
