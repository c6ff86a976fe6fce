// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/window_front.hpp"

#include <spdlog/spdlog.h>

#include <utility>

namespace backwash::daemon {

WindowFront::WindowFront(const config::Daemon& config, const dds::Participant& participant, Mapped& mapped,
                         Recorder& recorder)
    : mapped_(mapped), recorder_(recorder), clouds_(config) {
  const config::MapWindow& window = config.map.window;
  for (const bool free : {false, true}) {
    const std::string& topic = free ? window.free : window.occupied;
    if (topic.empty()) continue;
    kinds_.push_back({free,
                      {participant, dds::TopicOf<dds::PointCloud>::type(), topic, dds::Delivery::scans},
                      BoundWriter(topic),
                      std::make_unique<std::atomic<std::uint64_t>>(0),
                      std::make_unique<std::atomic<std::uint64_t>>(0),
                      std::make_unique<std::atomic<std::uint64_t>>(0)});
  }
}

void WindowFront::add_to(dds::WaitSet& waitset) const {
  for (const Kind& kind : kinds_) waitset.add(kind.reader);
}

void WindowFront::add_to(std::vector<const dds::detail::ReaderBase*>& readers) const {
  for (const Kind& kind : kinds_) readers.push_back(&kind.reader);
}

void WindowFront::take(Kind& kind, const map::OccupancyGrid* known, const std::optional<Vec3>& vehicle_W,
                       Refusals& refusals) {
  const auto refuse = [&](auto&& why) {
    ++mapped_.scans_rejected;
    refusals.add(*kind.rejected, why);
  };
  kind.reader.take([&](const dds::PointCloud& m, const dds::Guid& writer) {
    if (!kind.writer.hears(writer)) return refuse([&] { return kind.writer.refusal(writer); });
    auto cloud = clouds_.judge(kind.free, m, writer, vehicle_W, now_ns());
    if (!cloud) return refuse([&] { return cloud.error(); });
    if (kind.writer.bind(writer)) spdlog::info("{} is taken from writer {}", kind.reader.topic(), dds::text(writer));
    if (const auto& line = clouds_.beyond()) refusals.add(*kind.beyond, [&] { return *line; });
    std::size_t fresh = 0;
    if (known && !kind.free) {
      const NewVoxels voxels = new_voxels(*known, *cloud);
      fresh = voxels.count;
      if (fresh > 0) mapped_.scan_voxels.push_or_count(voxels);
    }
    recorder_.append(log::RecordKind::scan, std::string(kind.free ? "free" : "occupied") + " window of " +
                                                std::to_string(cloud->voxels.size()) + " voxels, " +
                                                std::to_string(fresh) + " new voxels");
    auto owned = std::make_unique<WindowCloud>(std::move(*cloud));
    if (mapped_.windows.push(owned.get()))
      static_cast<void>(owned.release());  // the ring holds it
    else
      refuse([&] { return kind.reader.topic() + ": the map worker has 16 clouds waiting"; });
  });
  const auto bound = kind.writer.writer();
  if (!kind.writer.let_go(kind.reader.departed(), true, now_ns())) return;
  clouds_.forget(kind.free);
  const std::string line = kind.reader.topic() + " of writer " + dds::text(*bound) +
                           " is gone: what it has shown is flown in, and nothing beyond";
  refusals.add(*kind.gone, [&] { return line; });
  recorder_.append(log::RecordKind::world, "window: " + line);
}

void WindowFront::take(const map::OccupancyGrid* known, const std::optional<Vec3>& vehicle_W, Refusals& refusals) {
  for (Kind& kind : kinds_) take(kind, known, vehicle_W, refusals);
}

}  // namespace backwash::daemon
