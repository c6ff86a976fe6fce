// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/map_front.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/in/localization.hpp"
#include "services/backwashd/out/shown_segment.hpp"
#include "services/backwashd/text.hpp"

namespace backwash::daemon {

namespace {

std::optional<WindowFront> window_front(const config::Daemon& config, const dds::Participant& participant,
                                        Channels& channels, Recorder& recorder) {
  if (!config.map.window.declared()) return std::nullopt;
  return std::optional<WindowFront>(std::in_place, config, participant, channels, recorder);
}

std::vector<const dds::detail::ReaderBase*> read_of(const dds::Reader<dds::Octomap>& maps,
                                                    const dds::Reader<dds::MapPart>& parts,
                                                    const dds::Reader<dds::PointCloud>& scans,
                                                    const std::optional<WindowFront>& window) {
  std::vector<const dds::detail::ReaderBase*> all{&maps, &parts, &scans};
  if (window) window->add_to(all);
  return all;
}

}  // namespace

MapFront::MapFront(const config::Daemon& config, double body_radius, Channels& channels, Recorder& recorder)
    : channels_(channels),
      recorder_(recorder),
      map_frame_(config.frames.map),
      sensor_range_(config.map.sensor_range),
      placement_(config, body_radius),
      refusals_(channels.refused_map),
      assembly_(kMaxMapBytes, config.frames.map),
      participant_(static_cast<std::uint32_t>(config.dds.domain), config.dds.interface,
                   {.apart = true,
                    .topics = dds::topics(config.dds.name_space, {config.map.window.occupied, config.map.window.free})},
                   config.dds.security),
      maps_(dds::make_reader<dds::Octomap>(participant_, config.dds.name_space)),
      scans_(dds::make_reader<dds::PointCloud>(participant_, config.dds.name_space)),
      parts_(dds::make_reader<dds::MapPart>(participant_, config.dds.name_space)),
      window_(window_front(config, participant_, channels, recorder)),
      foreign_(participant_, read_of(maps_, parts_, scans_, window_)),
      receipts_(participant_, dds::TopicOf<dds::MapReceipt>::type(),
                dds::topic(config.dds.name_space, dds::TopicOf<dds::MapReceipt>::kName), config.dds,
                dds::Delivery::parts),
      tube_(participant_, config.dds),
      trajectory_(participant_, config.dds),
      markers_(participant_, config.dds),
      disturbance_(participant_, config.dds),
      waitset_(participant_) {
  waitset_.add(maps_);
  waitset_.add(parts_);
  waitset_.add(scans_);
  if (!config.dds.security.empty()) silent_.emplace();
  if (window_) window_->add_to(waitset_);
}

MapFront::~MapFront() { channels_.worlds.reader.give_back(world_); }

void MapFront::take_poses() {
  if (const auto shift = channels_.map_from_odom.read_new()) placement_.close(*shift);
  while (const auto sample = channels_.poses.pop()) placement_.add(*sample);
}

void MapFront::take_scans() {
  if (const auto* newest = channels_.worlds.reader.take())
    channels_.worlds.reader.give_back(std::exchange(world_, newest));
  take_poses();
  scans_.take([&](const dds::PointCloud& m, const dds::Guid& writer) {
    if (!scan_writer_.hears(writer))
      return refusals_.add(channels_.scans_rejected, [&] { return scan_writer_.refusal(writer); });
    auto scan = placement_.scan(m, now_ns());
    if (!scan) return refusals_.add(channels_.scans_rejected, [&] { return scan.error(); });
    if (scan_writer_.bind(writer)) spdlog::info("scans are taken from writer {}", dds::text(writer));
    std::size_t fresh = 0;
    if (world_) {
      const NewVoxels voxels = new_voxels(world_->world->grid, *scan, sensor_range_);
      fresh = voxels.count;
      if (fresh > 0) channels_.scan_voxels.push_or_count(voxels);
    }
    recorder_.append(log::RecordKind::scan, "scan of " + std::to_string(scan->points_W.size()) + " points, " +
                                                std::to_string(fresh) + " new voxels, " + std::to_string(scan->own) +
                                                " points on the vehicle left out");
    auto owned = std::make_unique<Scan>(std::move(*scan));
    if (channels_.scans.push(owned.get()))
      static_cast<void>(owned.release());  // the ring holds it
    else
      refusals_.add(channels_.scans_rejected, [] { return "a scan: the map worker has 16 waiting"; });
  });
}

/// Who sent one that is not looked at any more waits for no verdict.
void MapFront::offer(MapMessage message) {
  const auto before = channels_.maps.offer(std::make_unique<const MapMessage>(std::move(message)));
  assembly_.displaced(before.get());
}

void MapFront::take_maps() {
  // The map worker judges what is in a map.
  if (const auto good = channels_.map_writer.read_new(); good && good->term == term_ && map_writer_.bind(good->writer))
    spdlog::info("maps are taken from writer {}", dds::text(good->writer));
  maps_.take([&](const dds::Octomap& m, const dds::Guid& writer) {
    if (silent_) silent_->heard(writer);
    if (!map_writer_.hears(writer))
      return refusals_.add(channels_.maps_rejected, [&] { return map_writer_.refusal(writer); });
    const std::string frame = m.header.frame_id ? m.header.frame_id : "";
    if (frame != map_frame_)
      return refusals_.add(channels_.maps_rejected,
                           [&] { return wrong_frame("the map", frame, "'" + map_frame_ + "'").value(); });
    if (m.data._length > kMaxMapBytes)
      return refusals_.add(channels_.maps_rejected, [&] {
        return "a map of " + std::to_string(m.data._length) + " bytes, at most " + std::to_string(kMaxMapBytes);
      });
    MapMessage message;
    message.from = {term_, writer};
    message.data.assign(reinterpret_cast<const std::int8_t*>(m.data._buffer),
                        reinterpret_cast<const std::int8_t*>(m.data._buffer) + m.data._length);
    message.resolution = m.resolution;
    message.binary = m.binary;
    message.id = printable(m.id ? m.id : "");
    message.received_ns = now_ns();
    offer(std::move(message));
  });
}

// With a pause of its own: it is said beside the refusals of whoever sends meanwhile.
void MapFront::tell_lost(const std::optional<std::string>& line) {
  if (!line) return;
  ++channels_.maps_rejected;
  refusals_.add(maps_lost_, [&] { return *line; });
}

void MapFront::take_parts() {
  if (const auto verdict = channels_.map_verdict.read_new()) assembly_.judge(*verdict);
  parts_.take([&](const dds::MapPart& part, const dds::Guid& by) {
    const dds::Guid writer = dds::participant_of(by);  // who has a writer for each of what may overtake one another
    const auto refuse = [&](const std::string& why) { refusals_.add(channels_.maps_rejected, [&] { return why; }); };
    if (!map_writer_.hears(writer)) {
      assembly_.refuse(part, writer, map_writer_.refusal(writer), now_ns());
      return refuse(map_writer_.refusal(writer));
    }
    const auto taken = assembly_.take(part, writer, now_ns());
    if (!taken) return refuse(taken.error());
    if (*taken == MapParts::Taken::begins) spdlog::info("{} begins to arrive", assembly_.what());
    if (*taken != MapParts::Taken::whole) return;
    spdlog::info("{} is whole after {:.1f} s", assembly_.what(), assembly_.age_s(now_ns()));
    MapMessage message = assembly_.message();
    message.from.term = term_;
    offer(std::move(message));
  });
  tell_lost(assembly_.stalled(now_ns()));
  if (const auto receipt = assembly_.receipt(now_ns())) receipts_.write(*receipt);
}

void MapFront::let_writers_go() {
  scan_writer_.let_go(scans_.departed(), true, now_ns());
  auto departed = maps_.departed();
  for (const dds::Guid& writer : parts_.departed()) departed.push_back(dds::participant_of(writer));
  tell_lost(assembly_.let_go(departed));
  if (!map_writer_.let_go(departed, true, now_ns())) return;
  ++term_;
  // What the next writer said was refused while this one was not known to be gone; a map may be said once.
  maps_.renew(waitset_);
}

void MapFront::watch_what_does_not_come() {
  auto lines = partial_.look(dds::partial_samples(), now_ns());
  if (silent_)
    for (std::string& line : silent_->look(maps_.known(), now_ns())) lines.push_back(std::move(line));
  for (const std::string& line : lines) refusals_.add(late_, [&] { return line; });
}

/// Where somebody looks.
void MapFront::show_disturbance() {
  constexpr double kFarthest = 1e6;  // m: indices of voxels beyond it are no numbers
  const auto vehicle_W = placement_.newest_W();
  if (vehicle_W && !(vehicle_W->cwiseAbs().maxCoeff() < kFarthest)) return;
  if (!world_ || !vehicle_W || disturbance_.matched() == 0 || !shows_.due(*world_->world, *vehicle_W, now_ns())) return;
  disturbance_.write(ShownField(*world_->world, *vehicle_W, map_frame_).cloud());
}

void MapFront::run_readers() {
  while (!channels_.stop) {
    waitset_.wait(0.1);
    take_poses();
    take_scans();
    if (window_) window_->take(world_ ? &world_->world->grid : nullptr, placement_.newest_W(), refusals_);
    take_maps();
    take_parts();
    let_writers_go();
    watch_what_does_not_come();
    show_disturbance();
    if (const auto news = foreign_.take_new(); news.count > 0) {
      channels_.foreign_writers += news.count - 1;
      refusals_.add(channels_.foreign_writers, [&] { return printable(news.first, 240) + ": it is not listened to"; });
    }
  }
}

void MapFront::send(const track::AcceptedSegment& segment) {
  const ShownSegment shown(segment, map_frame_);
  tube_.write(shown.tube());
  trajectory_.write(shown.trajectory());
  markers_.write(shown.markers());
}

}  // namespace backwash::daemon
