// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/ulog.hpp"

#include <algorithm>
#include <optional>

#include "core/log/little_endian.hpp"

namespace backwash::log {
namespace {

constexpr std::uint8_t kMagic[] = {0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35};
constexpr std::size_t kFileHeader = 16, kMostFields = 4096;

struct Field {
  std::string name;
  char kind;  ///< of number_at(); '_' padding
  std::size_t size;
};

struct Basic {
  const char* name;
  char kind;
  std::size_t size;
};
constexpr Basic kBasics[] = {{"int8_t", 'b', 1},  {"uint8_t", 'B', 1},  {"int16_t", 'h', 2}, {"uint16_t", 'H', 2},
                             {"int32_t", 'i', 4}, {"uint32_t", 'I', 4}, {"int64_t", 'q', 8}, {"uint64_t", 'Q', 8},
                             {"float", 'f', 4},   {"double", 'd', 8},   {"bool", 'B', 1},    {"char", 'B', 1}};

class UlogDecoder {
 public:
  explicit UlogDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  tl::expected<TopicLog, std::string> run() {
    if (bytes_.size() < kFileHeader || std::memcmp(bytes_.data(), kMagic, sizeof kMagic) != 0)
      return fail(0, "no ULog magic; give a .ulg file");
    for (std::size_t at = kFileHeader; at + 3 <= bytes_.size();) {
      const std::size_t size = little<std::uint16_t>(bytes_.data() + at);
      const char type = static_cast<char>(bytes_[at + 2]);
      if (at + 3 + size > bytes_.size()) break;  // cut short
      if (auto error = message(at, type, bytes_.subspan(at + 3, size))) return tl::unexpected(*error);
      at += 3 + size;
    }
    return std::move(log_);
  }

 private:
  struct Subscription {
    std::size_t topic;
    std::vector<Field> fields;
    std::size_t size, without_padding;
  };

  static tl::unexpected<std::string> fail(std::size_t at, const std::string& what) {
    return tl::unexpected("byte " + std::to_string(at) + ": " + what);
  }

  std::optional<std::string> message(std::size_t at, char type, std::span<const std::uint8_t> body) {
    const auto bad = [&](const std::string& what) { return std::optional(fail(at, what).value()); };
    switch (type) {
      case 'B':
        if (body.size() < 40) return bad("flag bits of " + std::to_string(body.size()) + " bytes; 40 are needed");
        for (std::size_t i = 8; i < 16; ++i)
          if (body[i] & (i == 8 ? 0xfe : 0xff)) return bad("incompatible flags that this reader does not know");
        return std::nullopt;  // appended data follow as ordinary messages
      case 'F':
        return format(at, {reinterpret_cast<const char*>(body.data()), body.size()});
      case 'A':
        return subscribe(at, body);
      case 'D':
        return data(at, body);
      case 'O':
        if (body.size() < 2) return bad("a dropout without its length");
        log_.dropouts += 1;
        return std::nullopt;
      default:
        // Later versions may add messages, but all types are capital letters: anything else is damage.
        if (type < 'A' || type > 'Z') return bad("a message type that is no letter; the file is damaged here");
        return std::nullopt;
    }
  }

  std::optional<std::string> format(std::size_t at, const std::string& text) {
    const auto colon = text.find(':');
    if (colon == std::string::npos || colon == 0) return fail(at, "a format without a name; NAME:TYPE FIELD;…").value();
    formats_[text.substr(0, colon)] = text.substr(colon + 1);
    return std::nullopt;
  }

  /// Appends the fields of a format, nested ones in place. False: unknown type, too deep or too large.
  bool expand(const std::string& name, const std::string& prefix, int depth, std::vector<Field>& out) const {
    const auto found = formats_.find(name);
    if (found == formats_.end() || depth > 8) return false;
    const std::string& text = found->second;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find(';', begin), text.size());
      std::string field = text.substr(begin, end - begin);
      begin = end + 1;
      if (field.empty()) continue;
      const auto space = field.find(' ');
      if (space == std::string::npos) return false;
      std::string type = field.substr(0, space);
      const std::string label = prefix + field.substr(space + 1);
      std::size_t count = 1;
      const auto bracket = type.find('[');
      const bool array = bracket != std::string::npos;
      if (array) {
        count = std::strtoul(type.c_str() + bracket + 1, nullptr, 10);
        type.resize(bracket);
      }
      if (count > kMostFields) return false;
      const bool padding = field.substr(space + 1).starts_with("_padding");
      const auto basic = std::find_if(std::begin(kBasics), std::end(kBasics), [&](auto& b) { return type == b.name; });
      for (std::size_t i = 0; i < count; ++i) {
        const std::string full = array ? label + "[" + std::to_string(i) + "]" : label;
        if (basic == std::end(kBasics)) {
          if (!expand(type, full + ".", depth + 1, out)) return false;
        } else {
          out.push_back({full, padding ? '_' : basic->kind, basic->size});
        }
        if (out.size() > kMostFields) return false;
      }
    }
    return true;
  }

  std::optional<std::string> subscribe(std::size_t at, std::span<const std::uint8_t> body) {
    if (body.size() < 4) return fail(at, "a subscription without a name").value();
    const std::string name(reinterpret_cast<const char*>(body.data()) + 3, body.size() - 3);
    Subscription s{log_.topics.size(), {}, 0, 0};
    if (!expand(name, "", 0, s.fields) || s.fields.empty() || s.fields.front().name != "timestamp" ||
        s.fields.front().kind != 'Q')
      return fail(at, "no usable format for '" + name + "'; it must begin with uint64_t timestamp").value();
    for (const auto& f : s.fields) {
      s.size += f.size;
      if (f.kind != '_') s.without_padding = s.size;
    }
    log_.topics.push_back({name, body[0], {}, {}});
    subscriptions_[little<std::uint16_t>(body.data() + 1)] = std::move(s);
    return std::nullopt;
  }

  std::optional<std::string> data(std::size_t at, std::span<const std::uint8_t> body) {
    if (body.size() < 2) return fail(at, "data without an id").value();
    const auto id = little<std::uint16_t>(body.data());
    const auto found = subscriptions_.find(id);
    if (found == subscriptions_.end())
      return fail(at, "data of id " + std::to_string(id) + ", never subscribed").value();
    const Subscription& s = found->second;
    if (body.size() - 2 < s.without_padding || body.size() - 2 > s.size)
      return fail(at, "data of " + std::to_string(body.size() - 2) + " bytes where its format has " +
                          std::to_string(s.size))
          .value();
    TopicLog::Topic& topic = log_.topics[s.topic];
    const std::uint8_t* p = body.data() + 2;
    for (const auto& f : s.fields) {
      if (f.kind == '_') {
        p += f.size;
        continue;
      }
      const double value = *number_at(p, f.kind);
      p += f.size;
      if (&f == &s.fields.front())
        topic.t_s.push_back(1e-6 * value);
      else
        topic.columns[f.name].push_back(value);
    }
    return std::nullopt;
  }

  std::span<const std::uint8_t> bytes_;
  std::map<std::string, std::string> formats_;
  std::map<std::uint16_t, Subscription> subscriptions_;
  TopicLog log_;
};

}  // namespace

tl::expected<TopicLog, std::string> decode_ulog(std::span<const std::uint8_t> bytes) {
  return UlogDecoder(bytes).run();
}

tl::expected<FlightLog, LogError> read_ulog(const std::string& path) {
  return read_topics(path, "a .ulg file", decode_ulog);
}

}  // namespace backwash::log
