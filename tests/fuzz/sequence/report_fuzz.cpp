// SPDX-License-Identifier: BSD-3-Clause
// Whatever happened to the daemon, `backwash report` tells its log: flights that faults and orders have ended anyhow,
// and logs that a kill has cut at any byte. What it counts is counted here from the bytes.
//   BACKWASH_FUZZ_REPORTS   logs (40)
//   BACKWASH_FUZZ_SEED      of the first sequence (1); the next ones follow
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/fuzz/sequence/daemon_rig.hpp"

namespace backwash::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr int kLongest = 1500;  // ticks of a flight: half a minute

unsigned long number(const char* name, unsigned long otherwise) {
  const char* text = std::getenv(name);
  return text ? std::strtoul(text, nullptr, 10) : otherwise;
}

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

std::string bytes_of(const log::RawLog& log) {
  std::string bytes = log::kRawLogMagic;
  for (const auto& [header, body, offset] : log.records) {
    bytes.append(reinterpret_cast<const char*>(&header), sizeof header);
    bytes.append(reinterpret_cast<const char*>(body.data()), body.size());
  }
  return bytes;
}

std::string csv_of(const std::vector<std::pair<std::int64_t, Vec3>>& truth) {
  std::string rows = "t_s,x_m,y_m,z_m\n";
  char row[120];
  for (const auto& [t_ns, p] : truth) {
    std::snprintf(row, sizeof row, "%.3f,%.6f,%.6f,%.6f\n", 1e-9 * static_cast<double>(t_ns), p.x(), p.y(), p.z());
    rows += row;
  }
  return rows;
}

/// A sequence in which every other flight's VIO drifts, too: what was drawn seldom leads out of a set.
std::vector<Event> drawn(std::uint64_t seed, std::mt19937_64& draws) {
  auto events = sequence(seed, kLongest);
  if (draws() % 2) return events;
  const auto share = [&draws] { return 2 * static_cast<double>(draws() >> 11) * 0x1p-53 - 1; };
  const Event drift{300 + static_cast<int>(draws() % 400), Event::Kind::vio_drift, 400, share(), share(), share() / 4};
  events.insert(std::ranges::upper_bound(events, drift.tick, {}, &Event::tick), drift);
  return events;
}

/// What the ticks in some bytes of a log say (core/log/raw/raw_log.hpp: a head of 16 bytes, the kind at its byte 8).
struct Counted {
  std::size_t ticks = 0, judged = 0, inside = 0, setpoints = 0;
  bool held = false, whole = false;
};
Counted counted(const std::string& bytes) {
  constexpr std::size_t kMagic = 19, kHead = 16, kMode = 24, kSent = 32, kJudged = 36, kInside = 40;
  constexpr std::uint32_t kTick = 8, kHold = 3;
  const auto word = [&](std::size_t at) {
    std::uint32_t value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  Counted count;
  std::size_t at = kMagic;
  while (at + kHead <= bytes.size() && at + kHead + word(at + 12) <= bytes.size()) {
    const std::size_t body = at + kHead;
    if (word(at + 8) == kTick) {
      ++count.ticks;
      count.judged += word(body + kJudged);
      count.inside += word(body + kJudged) * word(body + kInside);
      count.setpoints += word(body + kSent) & 1;
      count.held = count.held || word(body + kMode) == kHold;
    }
    at = body + word(at + 12);
  }
  count.whole = at == bytes.size();
  return count;
}

class Reports : public testing::Test {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    fs::create_directories(folder_);
  }
  void TearDown() override {
    fs::remove_all(folder_);
    spdlog::set_level(spdlog::level::info);
  }

  /// What the program says of the log, after it looked at how it ended and at its page.
  nlohmann::json told(const std::string& options) {
    fs::remove(folder_ / "page.html");
    const std::string in = folder_.string() + "/";
    const int status =
        std::system((BACKWASH_BINARY_DIR "/services/backwash report " + in + "flight.bwlog --json --quiet --out " + in +
                     "page.html" + options + " >" + in + "json 2>" + in + "said")
                        .c_str());
    const std::string said = content(folder_ / "said");
    EXPECT_TRUE(WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 1)) << status << ": " << said;
    auto json = nlohmann::json::parse(content(folder_ / "json"), nullptr, false);
    if (json.is_discarded()) return {};
    EXPECT_EQ(json["ok"].get<bool>(), WEXITSTATUS(status) == 0);
    EXPECT_EQ(json["ok"].get<bool>(), said.empty()) << said;
    return json;
  }

  const fs::path folder_ = fs::temp_directory_path() / ("backwash_reports." + std::to_string(::getpid()));
};

TEST_F(Reports, TellEachLogThatTheDaemonWrote) {
  const unsigned long first = number("BACKWASH_FUZZ_SEED", 1), count = number("BACKWASH_FUZZ_REPORTS", 40);
  unsigned long cut = 0, unflown = 0, held = 0, outside = 0, good = 0;
  for (unsigned long seed = first; seed < first + count && !HasFailure(); ++seed) {
    SCOPED_TRACE("sequence " + std::to_string(seed));
    std::mt19937_64 draws(seed);
    DaemonRig rig(drawn(seed, draws), daemon::test::Medium::udp);
    const bool whole = draws() % 4;
    const auto violation = rig.run(whole ? kLongest : static_cast<int>(draws() % kLongest));
    ASSERT_FALSE(violation) << violation->what;
    std::string bytes = bytes_of(rig.logged());
    // At any byte; one in four soon after the start, before anything was commanded.
    if (draws() % 2) bytes.resize(draws() % (bytes.size() / (draws() % 4 ? 1 : 50) + 1));
    write(folder_ / "flight.bwlog", bytes);
    const bool with_truth = rig.truth().size() > 1 && draws() % 2;
    if (with_truth) write(folder_ / "truth.csv", csv_of(rig.truth()));

    const Counted own = counted(bytes);
    const auto json = told(with_truth ? " --truth " + (folder_ / "truth.csv").string() : "");
    ASSERT_FALSE(json.empty());
    EXPECT_EQ(json["samples"], own.judged);
    EXPECT_EQ(json["samples_inside"], own.inside);
    EXPECT_EQ(json["cut_at"].is_null(), own.whole);
    EXPECT_EQ(json["ticks_beyond_truth"], 0u);
    const auto& replay = json["replay"];
    EXPECT_EQ(replay["differing_ticks"], 0u);
    EXPECT_EQ(replay["ticks_missing"], 0u);
    EXPECT_TRUE(replay["ticks"] == own.ticks || (!own.whole && replay["why_not"] != "")) << replay;
    const std::string page = content(folder_ / "page.html");
    EXPECT_NE(page.find("</html>"), page.npos);
    EXPECT_NE(page.find(std::to_string(own.inside) + " of " + std::to_string(own.judged) + "</td>"), page.npos);
    cut += !own.whole;
    unflown += own.setpoints == 0;
    held += own.held;
    outside += own.inside < own.judged;
    good += json["ok"].get<bool>();
  }
  std::printf("%lu logs: %lu cut, %lu without a set-point, %lu held, %lu outside, %lu good\n", count, cut, unflown,
              held, outside, good);
  EXPECT_GT(cut, count / 4);
  EXPECT_GT(unflown, 0u);
  EXPECT_GT(held, count / 10);
  EXPECT_GT(outside, 0u);
}

}  // namespace
}  // namespace backwash::fuzz
