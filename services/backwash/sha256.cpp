// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/sha256.hpp"

#include <openssl/evp.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// OpenSSL's, which takes the processor's own instructions where it has them.
class Hash {
 public:
  Hash() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    must(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr));
  }
  void add(const char* bytes, std::size_t count) { must(EVP_DigestUpdate(context_.get(), bytes, count)); }
  std::string digits() {
    std::array<std::uint8_t, 32> digest;
    must(EVP_DigestFinal_ex(context_.get(), digest.data(), nullptr));
    constexpr const char* kDigits = "0123456789abcdef";
    std::string text;
    for (const auto byte : digest) text += {kDigits[byte >> 4], kDigits[byte & 15]};
    return text;
  }

 private:
  static void must(int done) {
    if (done != 1)
      throw Failure(kSoftware, "OpenSSL gives no SHA-256; look at its configuration (openssl dgst -sha256)");
  }
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

}  // namespace

std::string sha256(std::string_view bytes) {
  Hash hash;
  hash.add(bytes.data(), bytes.size());
  return hash.digits();
}

std::string sha256_of_file(const std::string& path) {
  std::error_code unknown;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, unknown)) file.open(path, std::ios::binary);
  if (!file.is_open()) throw Failure(kNoInput, path + ":1: cannot be read; give the path of a file");
  Hash hash;
  std::vector<char> block(1 << 20);
  do {
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    hash.add(block.data(), static_cast<std::size_t>(file.gcount()));
  } while (file);
  if (file.bad()) throw Failure(kInputOutput, path + ":1: cannot be read to its end; look at the disk");
  return hash.digits();
}

}  // namespace backwash::services
