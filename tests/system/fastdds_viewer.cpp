// SPDX-License-Identifier: BSD-3-Clause
// What RViz and ROS 2's diagnostic tools see, through Fast DDS with types written by hand, member by member.
//   fastdds_viewer DOMAIN NAMESPACE SECONDS
// Prints the last of each: "diagnostics LEVEL HARDWARE NAME: MESSAGE", "markers COUNT in FRAME: line of POINTS, boxes
// up to LARGEST m wide", "disturbance COUNT in FRAME from Z to Z: level LEAST to LARGEST, vertical LEAST to LARGEST"
// and "path COUNT in FRAME to X Y Z, LENGTH m, LONGEST m at a time"; 1 if one of them did not come.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include "tests/system/fastdds_local.hpp"

namespace {

struct Seen {
  std::string line;
};

std::string text(Cdr& cdr) {
  std::string s;
  cdr >> s;
  return s;
}
template <typename T>
T number(Cdr& cdr) {
  T n{};
  cdr >> n;
  return n;
}
std::string header(Cdr& cdr) {
  number<std::int32_t>(cdr);
  number<std::uint32_t>(cdr);
  return text(cdr);
}
template <typename T>
void skip(Cdr& cdr, std::size_t count) {
  for (; count > 0; --count) number<T>(cdr);
}

class ReadType : public Type {
 public:
  using Type::Type;
  bool serialize(void*, Payload*) override { return false; }
  bool deserialize(Payload* payload, void* data) override {
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    static_cast<Seen*>(data)->line = read(cdr);
    return true;
  }
  void* createData() override { return new Seen; }
  void deleteData(void* data) override { delete static_cast<Seen*>(data); }
  virtual std::string read(Cdr& cdr) = 0;
};

class DiagnosticsType : public ReadType {
 public:
  DiagnosticsType() : ReadType("diagnostic_msgs::msg::dds_::DiagnosticArray_", 16384) {}
  std::string read(Cdr& cdr) override {
    header(cdr);
    if (number<std::uint32_t>(cdr) != 1) return "not one status";
    const int level = number<std::uint8_t>(cdr);
    const std::string name = text(cdr), message = text(cdr), hardware = text(cdr);
    for (auto values = number<std::uint32_t>(cdr); values > 0; --values) {
      text(cdr);
      text(cdr);
    }
    return "diagnostics " + std::to_string(level) + " " + hardware + " " + name + ": " + message;
  }
};

class MarkersType : public ReadType {
 public:
  MarkersType() : ReadType("visualization_msgs::msg::dds_::MarkerArray_", 1 << 20) {}
  std::string read(Cdr& cdr) override {
    std::string frame;
    std::uint32_t line = 0;
    double widest = 0;
    const auto count = number<std::uint32_t>(cdr);
    for (std::uint32_t n = 0; n < count; ++n) {
      frame = header(cdr);
      text(cdr);                  // ns
      number<std::int32_t>(cdr);  // id
      const auto type = number<std::int32_t>(cdr), action = number<std::int32_t>(cdr);
      skip<double>(cdr, 7);  // pose
      std::array<double, 3> scale{};
      for (double& s : scale) s = number<double>(cdr);
      skip<float>(cdr, 4);         // colour
      skip<std::int32_t>(cdr, 2);  // lifetime
      number<bool>(cdr);           // frame_locked
      const auto points = number<std::uint32_t>(cdr);
      skip<double>(cdr, std::size_t{3} * points);
      skip<float>(cdr, std::size_t{4} * number<std::uint32_t>(cdr));  // colours
      text(cdr);                                                      // texture_resource
      header(cdr);
      text(cdr);  // texture
      skip<std::uint8_t>(cdr, number<std::uint32_t>(cdr));
      skip<float>(cdr, std::size_t{2} * number<std::uint32_t>(cdr));  // uv_coordinates
      text(cdr);
      text(cdr);
      text(cdr);  // text, mesh_resource, mesh_file.filename
      skip<std::uint8_t>(cdr, number<std::uint32_t>(cdr));
      number<bool>(cdr);  // mesh_use_embedded_materials
      if (action == 0 && type == 4) line = points;
      if (action == 0 && type == 1) widest = std::max(widest, *std::max_element(scale.begin(), scale.end()));
    }
    char said[160];
    std::snprintf(said, sizeof said, "markers %u in %s: line of %u, boxes up to %.3f m wide", count, frame.c_str(),
                  line, widest);
    return said;
  }
};

class CloudType : public ReadType {
 public:
  CloudType() : ReadType("sensor_msgs::msg::dds_::PointCloud2_", 1 << 22) {}
  std::string read(Cdr& cdr) override {
    const std::string frame = header(cdr);
    const auto height = number<std::uint32_t>(cdr), width = number<std::uint32_t>(cdr);
    std::string fields;
    for (auto count = number<std::uint32_t>(cdr); count > 0; --count) {
      fields += text(cdr);
      fields += "@" + std::to_string(number<std::uint32_t>(cdr));
      fields += ":" + std::to_string(number<std::uint8_t>(cdr)) + " ";
      if (number<std::uint32_t>(cdr) != 1) return "a field of several";
    }
    if (fields != "x@0:7 y@4:7 z@8:7 level@12:7 vertical@16:7 ") return "other fields: " + fields;
    const bool big_endian = number<bool>(cdr);
    const auto step = number<std::uint32_t>(cdr), row = number<std::uint32_t>(cdr), bytes = number<std::uint32_t>(cdr);
    if (big_endian || height != 1 || step != 20 || row != width * step || bytes != row) return "other sizes";
    std::array<float, 5> least, largest;
    least.fill(1e9F);
    largest.fill(-1e9F);
    for (std::uint32_t n = 0; n < width; ++n) {
      std::array<std::uint8_t, 20> raw;
      for (auto& byte : raw) byte = number<std::uint8_t>(cdr);
      std::array<float, 5> point;
      std::memcpy(point.data(), raw.data(), raw.size());
      for (std::size_t k = 0; k < 5; ++k) {
        least[k] = std::min(least[k], point[k]);
        largest[k] = std::max(largest[k], point[k]);
      }
    }
    char said[200];
    std::snprintf(
        said, sizeof said, "disturbance %u in %s from %.3f to %.3f: level %.3f to %.3f, vertical %.3f to %.3f", width,
        frame.c_str(), static_cast<double>(least[2]), static_cast<double>(largest[2]), static_cast<double>(least[3]),
        static_cast<double>(largest[3]), static_cast<double>(least[4]), static_cast<double>(largest[4]));
    return said;
  }
};

class BatteryType : public ReadType {
 public:
  BatteryType() : ReadType("sensor_msgs::msg::dds_::BatteryState_", 4096) {}
  std::string read(Cdr& cdr) override {
    header(cdr);
    std::array<float, 7> values{};  // voltage, temperature, current, charge, two capacities, percentage
    for (float& v : values) v = number<float>(cdr);
    const int kinds = number<std::uint8_t>(cdr) + number<std::uint8_t>(cdr) + number<std::uint8_t>(cdr);
    const bool present = number<bool>(cdr);
    skip<float>(cdr, number<std::uint32_t>(cdr));  // cells
    skip<float>(cdr, number<std::uint32_t>(cdr));
    const std::string texts = text(cdr) + text(cdr);
    const auto unknown = std::count_if(values.begin(), values.end(), [](float v) { return std::isnan(v); });
    char said[160];
    std::snprintf(said, sizeof said, "battery %s %.2f V, %.2f, %d not known, kinds %d \"%s\"",
                  present ? "present" : "absent", static_cast<double>(values[0]), static_cast<double>(values[6]),
                  static_cast<int>(unknown), kinds, texts.c_str());
    return said;
  }
};

class PathType : public ReadType {
 public:
  PathType() : ReadType("nav_msgs::msg::dds_::Path_", 1 << 20) {}
  std::string read(Cdr& cdr) override {
    const std::string frame = header(cdr);
    const auto count = number<std::uint32_t>(cdr);
    std::array<double, 7> last{}, pose{};  // position, orientation
    double length = 0, longest = 0;
    for (std::uint32_t n = 0; n < count; ++n, last = pose) {
      if (header(cdr) != frame) return "a pose in another frame";
      for (double& v : pose) v = number<double>(cdr);
      if (std::abs(std::hypot(std::hypot(pose[3], pose[4]), std::hypot(pose[5], pose[6])) - 1) > 1e-9) return "no turn";
      const double step = n == 0 ? 0 : std::hypot(pose[0] - last[0], pose[1] - last[1], pose[2] - last[2]);
      length += step;
      longest = std::max(longest, step);
    }
    char said[160];
    std::snprintf(said, sizeof said, "path %u in %s to %.2f %.2f %.2f, %.3f m, %.3f m at a time", count, frame.c_str(),
                  last[0], last[1], last[2], length, longest);
    return said;
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 64;
  const std::string name_space = std::string("rt/") + argv[2] + "/";
  const auto domain = static_cast<unsigned>(std::atoi(argv[1]));
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(domain, local_only(domain));
  if (!participant) return 70;
  auto* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  const auto reader_of = [&](fast::TopicDataType* made, const std::string& name) {
    fast::TypeSupport type(made);
    type.register_type(participant);
    fast::DataReaderQos qos;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    if (name != "rt/diagnostics")  // the markers of a plan stay for who comes later
      qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
    return subscriber->create_datareader(participant->create_topic(name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT),
                                         qos);
  };
  fast::DataReader* readers[] = {
      reader_of(new DiagnosticsType, "rt/diagnostics"), reader_of(new MarkersType, name_space + "markers"),
      reader_of(new CloudType, name_space + "disturbance"), reader_of(new PathType, name_space + "trajectory"),
      reader_of(new BatteryType, name_space + "battery")};
  Seen seen[5];
  for (int n = 0; n < 20 * std::atoi(argv[3]); ++n) {
    fast::SampleInfo info;
    for (int r = 0; r < 5; ++r)
      while (readers[r]->take_next_sample(&seen[r], &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  for (const Seen& s : seen) std::printf("%s\n", s.line.c_str());
  return std::any_of(seen, seen + 5, [](const Seen& s) { return s.line.empty(); }) ? 1 : 0;
}
