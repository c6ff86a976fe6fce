// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/kinds/recording.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "core/files/read_file.hpp"
#include "core/log/autopilot/dataflash.hpp"
#include "core/log/autopilot/ulog.hpp"
#include "core/log/columns/import_airgarage.hpp"
#include "core/log/columns/import_columns.hpp"
#include "core/log/columns/import_crazypad.hpp"
#include "core/log/raw/raw_flight.hpp"

namespace backwash::log {
namespace {

using Form = RecordingKind::Form;
using std::string_view_literals::operator""sv;

tl::expected<FlightLog, LogError> read_raw_flight(const std::string& path) {
  return read_raw_log(path).and_then([&](const RawLog& log) { return flight_of_raw_log(log, path); });
}
tl::expected<FlightLog, LogError> read_own(const std::string& path) {
  auto log = read_csv(path);
  if (!log || log->t_s.size() < 2) return log;
  if (const auto turned = turned_axes(*log); !turned.empty())
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + turned});
  return log;
}

constexpr std::array kRead{RecordingKind{"airgarage", Form::table, "a table of airgarage", import_airgarage},
                           RecordingKind{"ardupilot", Form::autopilot, "a DataFlash log of ArduPilot", read_dataflash},
                           RecordingKind{"crazypad", Form::table, "a table of CrazyPAD", import_crazypad},
                           RecordingKind{"flight-log", Form::table, "a flight log", read_own},
                           RecordingKind{"mcap", Form::raw_log, "a raw log of backwashd", read_raw_flight},
                           RecordingKind{"ulog", Form::autopilot, "a ULog of PX4", read_ulog}};

constexpr const RecordingKind& kind_called(std::string_view name) {
  return *std::ranges::find(kRead, name, &RecordingKind::name);
}

/// A table that needs a column map.
constexpr RecordingKind kTable{"", Form::table, "a table", nullptr, "backwash import --propose FILE > map.toml"};

/// What a file begins with, and which kind that is.
struct Magic {
  std::size_t at;
  std::string_view bytes;
  const RecordingKind* kind;
};

constexpr RecordingKind other(std::string_view words, std::string_view way) {
  return {"", Form::other, words, nullptr, way};
}
constexpr RecordingKind kRosbag2 =
    other("a rosbag2 of SQLite", "ros2 bag play FILE & ros2 topic echo --csv /odometry > flight.csv");
constexpr RecordingKind kRosbag1 = other("a ROS 1 bag", "rostopic echo -b FILE -p /odometry > flight.csv");
constexpr RecordingKind kTlog =
    other("a telemetry log (tlog)", "mavlogdump.py --types LOCAL_POSITION_NED --format csv FILE > flight.csv");
constexpr RecordingKind kBlackbox = other("a blackbox log of Betaflight", "blackbox_decode FILE");
constexpr RecordingKind kText = other("ArduPilot's log as text", "give the .bin that the autopilot wrote");
constexpr RecordingKind kLfs = other("a pointer of Git LFS, not the file", "git lfs pull");
constexpr RecordingKind kAnnex = other("a pointer of git-annex, not the file", "git annex get FILE");
constexpr RecordingKind kPage = other("a page of the web, not the file", "download the file behind the page");
constexpr RecordingKind kMatlab =
    other("a MATLAB file", "matlab -batch \"s = load('FILE'); f = fieldnames(s); writetable(s.(f{1}), 'flight.csv')\"");
constexpr RecordingKind kHdf =
    other("an HDF5 file", "python3 -c \"import pandas; pandas.read_hdf('FILE').to_csv('flight.csv')\"");
constexpr RecordingKind kParquet =
    other("a Parquet file", "python3 -c \"import pandas; pandas.read_parquet('FILE').to_csv('flight.csv')\"");
constexpr RecordingKind kOctomap = other("a map (OctoMap)", "give it as --map");
constexpr RecordingKind kShape = other("a mesh or a cloud, no flight", "backwash map convert FILE -o map.bt");
constexpr RecordingKind kXz = other("packed by xz", "xz -dk FILE");
constexpr RecordingKind kZstd = other("packed by zstd", "zstd -d FILE");
constexpr RecordingKind kBzip2 = other("packed by bzip2", "bunzip2 -k FILE");
constexpr RecordingKind kSevenZip = other("packed by 7-Zip", "7z x FILE");
constexpr RecordingKind kTar = other("a tar archive", "tar xf FILE");

constexpr Magic kMagics[] = {{0, "ULog\x01\x12\x35"sv, &kind_called("ulog")},
                             {0, "\x89MCAP0\r\n"sv, &kind_called("mcap")},
                             {0, kRawLogMagic, &kind_called("mcap")},
                             {0, "SQLite format 3\0"sv, &kRosbag2},
                             {0, "#ROSBAG V"sv, &kRosbag1},
                             {0, "H Product:Blackbox"sv, &kBlackbox},
                             {0, "FMT, 128,"sv, &kText},
                             {0, "version https://git-lfs"sv, &kLfs},
                             {0, "/annex/objects/"sv, &kAnnex},
                             {0, "<!DOCTYPE html"sv, &kPage},
                             {0, "<!doctype html"sv, &kPage},
                             {0, "<html"sv, &kPage},
                             {0, "MATLAB "sv, &kMatlab},
                             {0, "\x89HDF\r\n\x1a\n"sv, &kHdf},
                             {0, "PAR1"sv, &kParquet},
                             {0, "# Octomap"sv, &kOctomap},
                             {0, "ply\n"sv, &kShape},
                             {0, "ply\r"sv, &kShape},
                             {0, "# .PCD"sv, &kShape},
                             {0, "glTF"sv, &kShape},
                             {0,
                              "\xfd"
                              "7zXZ\0"sv,
                              &kXz},
                             {0, "\x28\xb5\x2f\xfd"sv, &kZstd},
                             {0, "BZh"sv, &kBzip2},
                             {0, "7z\xbc\xaf\x27\x1c"sv, &kSevenZip},
                             {257, "ustar"sv, &kTar}};

constexpr std::size_t kBeginning = 65536;  // bytes that are looked at

/// A format message of DataFlash with a message behind it: damage may stand before.
bool has_dataflash(std::string_view begin) {
  constexpr std::string_view kFormat = "\xa3\x95\x80"sv;
  constexpr std::size_t kFormatSize = 89;
  for (auto at = begin.find(kFormat); at != begin.npos; at = begin.find(kFormat, at + 1))
    if (at + kFormatSize + 2 <= begin.size() && begin.substr(at + kFormatSize, 2) == kFormat.substr(0, 2)) return true;
  return false;
}

/// A stamp of µs, most significant byte first, of 2001 to 2100, and a MAVLink frame, twice.
bool is_tlog(std::string_view begin) {
  const auto frame = [&](std::size_t at) -> std::size_t {
    if (at + 10 > begin.size()) return 0;
    std::uint64_t stamp = 0;
    for (std::size_t k = 0; k < 8; ++k) stamp = stamp << 8 | static_cast<unsigned char>(begin[at + k]);
    const auto magic = static_cast<unsigned char>(begin[at + 8]), size = static_cast<unsigned char>(begin[at + 9]);
    if (stamp < 1'000'000'000'000'000 || stamp > 4'200'000'000'000'000) return 0;
    return magic == 0xFE ? 8 + 8 + std::size_t{size} : magic == 0xFD ? 8 + 12 + std::size_t{size} : 0;
  };
  const std::size_t first = frame(0);
  return first > 0 && frame(first) > 0;
}

/// A text of an OBJ, an STL or a glTF, by its first word that is in no comment.
bool is_shape(std::string_view text) {
  constexpr std::array kWords{"v", "vt", "vn", "o", "g", "f", "mtllib", "usemtl", "solid", "SOLID", "{"};
  while (text.starts_with('#')) text.remove_prefix(std::min(text.find_first_of("\r\n"), text.size() - 1) + 1);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  const auto word = text.substr(0, text.find_first_of(" \t\r\n\""));
  return std::ranges::find(kWords, word) != kWords.end();
}

/// Which table a text is, by the names in its first line; nothing: it is no text.
const RecordingKind* table_of(std::string_view begin) {
  const auto control = [](char c) {
    return static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\r' && c != '\n';
  };
  if (begin.empty() || std::ranges::any_of(begin, control)) return nullptr;
  if (is_shape(begin)) return &kShape;
  std::string first(begin.substr(0, begin.find('\n')));
  std::ranges::replace_if(
      first, [](char c) { return c == ';' || c == '\t'; }, ',');
  std::istringstream line(first);
  std::set<std::string> names;
  for (std::string name; std::getline(line, name, ',');) {
    std::erase_if(name, [](char c) { return c == ' ' || c == '\r' || c == '"'; });
    names.insert(name);
  }
  const auto has = [&](std::initializer_list<const char*> all) {
    return std::ranges::all_of(all, [&](const char* name) { return names.contains(name); });
  };
  if (has({"t_s", "ax_g", "battery_mV"})) return &kind_called("crazypad");
  if (has({"t_s", "x_m", "y_m", "z_m"})) return &kind_called("flight-log");
  if (has({"t", "x", "y", "z", "qx", "qy", "qz", "qw"})) return &kind_called("airgarage");
  return &kTable;
}

/// The first bytes of a file, unpacked.
tl::expected<std::string, LogError> beginning(const std::string& path) {
  const auto whole = [&] { return files::read_file(path, files::kLargestTable, "the path of a recording"); };
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown))
    return tl::make_unexpected(
        LogError{LogError::Kind::not_found, path + ":1: " + (whole() ? "" : whole().error().message)});
  std::string begin(kBeginning, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  if (!begin.starts_with("\x1f\x8b") && !begin.starts_with("PK\x03\x04")) return begin;
  auto content = whole();
  auto plain = content ? files::unzipped(std::move(*content), files::kLargestTable)
                       : tl::make_unexpected(content.error().message);
  if (!plain) return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + plain.error()});
  plain->resize(std::min(plain->size(), kBeginning));
  return std::move(*plain);
}

}  // namespace

std::span<const RecordingKind> importable_recordings() noexcept { return kRead; }

tl::expected<const RecordingKind*, LogError> recording_of(const std::string& path) {
  const auto begin = beginning(path);
  if (!begin) return tl::make_unexpected(begin.error());
  for (const auto& [at, bytes, kind] : kMagics)
    if (begin->size() >= at + bytes.size() && begin->compare(at, bytes.size(), bytes) == 0) return kind;
  if (has_dataflash(*begin)) return &kind_called("ardupilot");
  if (is_tlog(*begin)) return &kTlog;
  if (const auto* table = table_of(*begin)) return table;
  return tl::make_unexpected(LogError{
      LogError::Kind::bad_data,
      path + ":1: begins as no recording that is known: neither ULog nor DataFlash, MCAP, bag or table of numbers"});
}

LogError not_read(const std::string& path, const RecordingKind& kind) {
  std::string way(kind.way);
  for (auto at = way.find("FILE"); at != way.npos; at = way.find("FILE", at + path.size())) way.replace(at, 4, path);
  if (way.empty()) way = "give the autopilot's own log";
  return {LogError::Kind::bad_data, path + ":1: is " + std::string(kind.words) + "; " + way};
}

tl::expected<TopicLog, LogError> read_autopilots_log(const std::string& path) {
  const auto kind = recording_of(path);
  if (!kind) return tl::make_unexpected(kind.error());
  if ((*kind)->form != Form::autopilot) return tl::make_unexpected(not_read(path, **kind));
  const auto content = read_topic_file(path, "an autopilot's log");
  if (!content) return tl::make_unexpected(content.error());
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(content->data()), content->size());
  const bool ulog = (*kind)->name == "ulog";
  auto topics = ulog ? decode_ulog(bytes) : decode_dataflash(bytes);
  if (!topics) return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + topics.error()});
  return ulog ? std::move(*topics) : px4_names(*topics);
}

tl::expected<FlightLog, LogError> read_recording(const std::string& path) {
  const auto kind = recording_of(path);
  if (!kind) return tl::make_unexpected(kind.error());
  if (!(*kind)->read) return tl::make_unexpected(not_read(path, **kind));
  return (*kind)->read(path);
}

}  // namespace backwash::log
