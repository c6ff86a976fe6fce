// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <zlib.h>

#include <random>

#include "core/files/read_file.hpp"

namespace backwash::files {
namespace {

std::string zipped(const std::string& plain) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, plain.size()) + 64, '\0');
  std::string in = plain;
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string noise(std::size_t bytes) {
  std::mt19937_64 random(5);
  std::string text(bytes, '\0');
  for (char& c : text) c = static_cast<char>(random() & 0xff);
  return text;
}

TEST(Unzipped, GivesBackWhatWasPackedAndLeavesTheRestAsItIs) {
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{5}, std::size_t{3} << 20}) {
    const std::string text = noise(bytes);
    EXPECT_EQ(unzipped(zipped(text), 4u << 20), text) << bytes;
  }
  EXPECT_EQ(unzipped("t_s,x_m\n", 100), "t_s,x_m\n");
  EXPECT_EQ(unzipped("", 100), "");
  EXPECT_EQ(unzipped(zipped("one\n") + zipped("two\n"), 100), "one\ntwo\n") << "gzip files may follow one another";
}

TEST(Unzipped, HoldsNoMoreThanTheCapOfABomb) {
  const auto bomb = unzipped(zipped(std::string(std::size_t{64} << 20, '0')), std::size_t{8} << 20);
  ASSERT_FALSE(bomb);
  EXPECT_NE(bomb.error().find("unpacks to more than the cap of 8 MiB"), std::string::npos);
}

TEST(Unzipped, SaysWhatIsCutShortOrDamaged) {
  const std::string whole = zipped(noise(100'000));
  for (const std::size_t left : {std::size_t{2}, std::size_t{10}, whole.size() / 2, whole.size() - 1}) {
    const auto cut = unzipped(whole.substr(0, left), 1u << 20);
    ASSERT_FALSE(cut) << left;
    EXPECT_NE(cut.error().find("cut short"), std::string::npos) << cut.error();
  }
  for (std::size_t at = 10; at < whole.size(); at += 997) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    EXPECT_FALSE(unzipped(damaged, 1u << 20)) << at;
  }
}

}  // namespace
}  // namespace backwash::files
