// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/map.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <utility>
#include <vector>

#include "core/config/file_hash.hpp"
#include "core/config/map_window.hpp"
#include "core/map/load_map.hpp"
#include "core/map/octomap/octomap_message.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::ctl {
namespace {

constexpr double kBitsPerByte = 8, kTold_s = 5;
// In turn: a best-effort reader leaves out what one writer's later sample has overtaken, and 50 ms of jitter make every
// fourth part such a one. At 1 Mbit/s a writer's parts are 170 ms apart.
constexpr int kWriters = 16;

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

map::OccupancyGrid load(const std::string& file) {
  auto grid = map::load_map(file);
  if (grid) return std::move(*grid);
  using Kind = map::MapError::Kind;
  const bool missing = grid.error().kind == Kind::not_found || grid.error().kind == Kind::unknown_name;
  throw StartError(missing ? kNoInput : kBadData, grid.error().message);
}

/// The parts of one map and the receipts of it.
class Transfer {
 public:
  Transfer(const Options& options, const MapOptions& map, const map::OccupancyGrid& grid)
      : map_(map),
        data_(map::encode_octomap(grid)),
        participant_(static_cast<std::uint32_t>(options.domain), options.interface,
                     {.topics = dds::topics(options.name_space)}, judged(options.security)),
        receipts_(dds::make_reader<dds::MapReceipt>(participant_, options.name_space)),
        waitset_(participant_) {
    waitset_.add(receipts_);
    for (int n = 0; n < kWriters; ++n)
      parts_.push_back(dds::make_writer<dds::MapPart>(participant_, options.name_space));
    std::random_device random;
    part_.transfer = std::uint64_t{random()} << 32 | random();
    part_.frame_id = dds::c_string(map_.frame);
    part_.id = dds::c_string(id_);
    part_.binary = true;
    part_.resolution = grid.resolution();
    part_.hash = config::fnv1a({reinterpret_cast<const char*>(data_.data()), data_.size()});
    part_.size = static_cast<std::uint32_t>(data_.size());
  }

  std::size_t bytes() const noexcept { return data_.size(); }
  /// Whether a daemon listens within `timeout_s`.
  bool heard(double timeout_s) {
    const std::int64_t begun = now_ns();
    while (!interrupted() && seconds(now_ns() - begun) < timeout_s) {
      if (parts_.front().matched() > 0) return true;
      waitset_.wait(0.02);
    }
    return false;
  }
  /// Sends what is due and takes what was answered.
  void step(dds::MapSending& sending) {
    while (const auto number = sending.next(now_ns())) write(*number);
    waitset_.wait(0.002);
    receipts_.departed();  // so that known() is of now
    receipts_.take([&](const dds::MapReceipt& receipt, const dds::Guid& writer) {
      if (receipt.transfer != part_.transfer || several_) return;
      const auto writers = receipts_.known();
      // A daemon that restarted answers by a writer of its own, once the one before is gone.
      const bool before = writer_ && std::ranges::find(writers, *writer_) != writers.end();
      several_ = (before && *writer_ != writer) ||
                 (receipt.state == backwash_msgs_msg_dds__MAPRECEIPT_ACCEPTED && writers.size() > 1);
      writer_ = writer;
      if (several_) return;
      sending.hear(receipt, now_ns());
      state_ = receipt.state;
      reason_ = receipt.reason ? receipt.reason : "";
    });
  }
  /// Whether not one alone answers as the daemon: what is said of the map may be another's word.
  bool several() const noexcept { return several_; }
  bool accepted() const noexcept { return state_ == backwash_msgs_msg_dds__MAPRECEIPT_ACCEPTED; }
  /// The daemon has it all and is at it, which takes as long as its worlds do.
  bool whole() const noexcept { return state_ == backwash_msgs_msg_dds__MAPRECEIPT_WHOLE; }
  bool refused() const noexcept { return state_ == backwash_msgs_msg_dds__MAPRECEIPT_REFUSED; }
  const std::string& reason() const noexcept { return reason_; }

 private:
  void write(std::uint32_t number) {
    const std::size_t begin = number * dds::kPartBytes;
    const auto size = static_cast<std::uint32_t>(std::min(dds::kPartBytes, data_.size() - begin));
    part_.number = number;
    part_.sent = static_cast<std::uint64_t>(now_ns());
    part_.data = {size, size, reinterpret_cast<std::uint8_t*>(data_.data() + begin), false};
    parts_[++turn_ % kWriters].write(part_);
  }

  MapOptions map_;
  std::string id_ = "OcTree", reason_;
  std::vector<std::int8_t> data_;
  dds::MapPart part_{};
  std::uint8_t state_ = backwash_msgs_msg_dds__MAPRECEIPT_ARRIVING;
  dds::Participant participant_;
  std::vector<dds::Writer<dds::MapPart>> parts_;
  std::size_t turn_ = 0;
  dds::Reader<dds::MapReceipt> receipts_;
  std::optional<dds::Guid> writer_;  // of receipts
  bool several_ = false;
  dds::WaitSet waitset_;
};

void tell(const dds::MapSending& sending, std::size_t bytes, double took_s) {
  const double share = static_cast<double>(sending.held()) / sending.count();
  std::fprintf(stderr, "%.1f of %.1f MiB acknowledged after %.0f s, sending at %.0f kbit/s\n",
               share * static_cast<double>(bytes) / (1 << 20), static_cast<double>(bytes) / (1 << 20), took_s,
               sending.rate() * kBitsPerByte * 1e-3);
}

}  // namespace

std::string given_up(const dds::MapSending& sending, std::size_t bytes, double took_s, double silent_s) {
  char line[512];
  const double mib = static_cast<double>(bytes) / (1 << 20);
  const std::uint32_t held = sending.held(), count = sending.count();
  const int size = std::snprintf(
      line, sizeof line,
      "not arrived: a map of %.1f MiB in %u parts; %llu were sent in %.0f s, %u are acknowledged (%.0f %%, the first "
      "missing is %u), none in the last %.0f s. ",
      mib, count, static_cast<unsigned long long>(sending.sent()), took_s, held, 100.0 * held / count,
      sending.first_missing(), silent_s);
  const char* advice =
      held == count ? "The daemon has it all and says nothing of it: see its log"
      : held == 0
          ? "Nothing came back: see that the daemon's dds.interface is on this line, or give a larger --patience"
          : "Give a larger --patience, a --rate below what the line carries, or a smaller map: backwash map "
            "convert has --crop and --resolution";
  return std::string(line, static_cast<std::size_t>(std::max(size, 0))) + advice;
}

std::optional<std::string> needs_more(const map::OccupancyGrid& grid) {
  constexpr double kMib = 1 << 20;
  const double needed =
      std::ceil(static_cast<double>(grid.cell_count()) * static_cast<double>(config::kWorldBytesPerVoxel) / kMib);
  if (needed <= config::kMaxMib) return std::nullopt;
  char line[320];
  std::snprintf(
      line, sizeof line,
      "a map of %d x %d x %d voxels: the daemon takes it with map.max_mib = %.0f or more (%.0f where it is not "
      "set), or by parts with a [map.window]; otherwise it refuses it once all is there",
      grid.size().x(), grid.size().y(), grid.size().z(), needed, config::kMaxMib);
  return line;
}

Outcome send_map(const Options& options, const MapOptions& map, bool quiet) {
  Outcome outcome{"map", false, std::nullopt, ""};
  const map::OccupancyGrid grid = load(map.file);
  if (const auto line = needs_more(grid)) std::fprintf(stderr, "backwashctl map: %s\n", line->c_str());
  Transfer transfer(options, map, grid);
  if (transfer.bytes() == 0) throw StartError(kBadData, map.file + ": nothing is known in it");
  if (!transfer.heard(options.timeout_s)) {
    outcome.why = interrupted() ? "interrupted" : "no daemon listens to parts of maps; is backwashd running?";
    return outcome;
  }
  const std::int64_t begun = now_ns();
  dds::MapSending sending(transfer.bytes(), std::max(dds::MapSending::kLeast, map.rate_kbit_s * 1e3 / kBitsPerByte),
                          begun);
  double told_s = 0;
  while (!transfer.accepted() && !transfer.refused() && !interrupted()) {
    transfer.step(sending);
    if (transfer.several()) {
      outcome.why =
          "not known: more than one process writes map_receipt in this namespace, and one of them may be no "
          "daemon, or one that ended less than 10 s ago; see whose map is in use by backwashctl status, and end the "
          "other";
      return outcome;
    }
    const std::int64_t news_ns = transfer.whole() ? sending.heard_ns() : sending.progress_ns();
    const double took_s = seconds(now_ns() - begun), silent_s = seconds(now_ns() - news_ns);
    if (silent_s > map.patience_s) {
      outcome.why = given_up(sending, transfer.bytes(), took_s, silent_s);
      return outcome;
    }
    if (quiet || took_s - told_s < kTold_s) continue;
    told_s = took_s;
    tell(sending, transfer.bytes(), took_s);
  }
  if (transfer.accepted()) {
    outcome.accepted = outcome.done.emplace(true);
    if (!quiet)
      std::printf("a map of %.1f MiB is in use after %.1f s; %llu parts were sent, %u needed\n",
                  static_cast<double>(transfer.bytes()) / (1 << 20), seconds(now_ns() - begun),
                  static_cast<unsigned long long>(sending.sent()), sending.count());
  } else {
    outcome.why = transfer.refused() ? "refused: " + transfer.reason()
                                     : "interrupted; " + given_up(sending, transfer.bytes(), seconds(now_ns() - begun),
                                                                  seconds(now_ns() - sending.progress_ns()));
  }
  return outcome;
}

}  // namespace backwash::ctl
