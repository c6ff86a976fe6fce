// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map_worker.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <thread>

#include "core/map/octomap_message.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::daemon {
namespace {

void record(Recorder& recorder, const MapMessage& message, bool accepted) {
  const study::MapRecord head{message.resolution, message.binary, accepted};
  std::vector<std::uint8_t> bytes(sizeof head + message.data.size());
  std::memcpy(bytes.data(), &head, sizeof head);
  if (!message.data.empty()) std::memcpy(bytes.data() + sizeof head, message.data.data(), message.data.size());
  recorder.append(study::RecordKind::map, bytes);
}

}  // namespace

void run_map_worker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle) {
  // Below everything else in the process, and below the kernel's workers that carry the serial line; inherited by the
  // threads that build the world.
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
  while (!channels.stop) {
    const MapMessage* message = channels.maps.take();
    if (!message) {
      channels.worlds.collect();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      continue;
    }
    const auto begun = now_ns();
    auto grid = map::decode_octomap(message->data, message->resolution, message->binary, message->id);
    record(recorder, *message, grid.has_value());
    channels.maps.give_back(message);
    if (!grid) {
      ++channels.maps_rejected;
      spdlog::warn("map rejected: {}", grid.error().message);
      continue;
    }
    const Index3 size = grid->size();
    auto world = plan::build_world(std::move(*grid), model, vehicle, reach::Method::tight, -1, run_parallel);
    channels.worlds.offer(std::make_unique<const std::shared_ptr<const plan::World>>(std::move(world)));
    ++channels.maps_accepted;
    spdlog::info("map accepted: {} x {} x {} voxels, world built in {} ms", size.x(), size.y(), size.z(),
                 (now_ns() - begun) / 1'000'000);
  }
}

}  // namespace backwash::daemon
