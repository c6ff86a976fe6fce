// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/ulog.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/log/little_endian.hpp"

namespace backwash::log {
namespace {

constexpr std::uint8_t kMagic[] = {0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35};
constexpr std::uint8_t kSync[] = {0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12};
constexpr std::size_t kFileHeader = 16, kMostFields = 4096, kLargestData = 4096;

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
      return fail("no ULog magic; give a .ulg file");
    for (std::size_t at = kFileHeader; at < bytes_.size();) {
      if (!stands(at)) {
        at = past_damage(at);
        continue;
      }
      const std::size_t end = end_of(at);
      const auto body = body_of(at);
      switch (type_of(at)) {
        case 'B':
          for (std::size_t i = 8; i < 16; ++i)
            if (body[i] & (i == 8 ? 0xfe : 0xff)) return fail("incompatible flags that this reader does not know");
          break;  // appended data follow as ordinary messages
        case 'F':
          format(text_of(body));
          break;
        case 'A':
          subscribe(body);
          break;
        case 'P':
          parameter(body);
          break;
        case 'O':
          log_.loss.dropout(1e-3 * little<std::uint16_t>(body.data()));
          break;
        default:
          break;
      }
      type_of(at) == 'D' ? data(at, body) : log_.loss.read(end - at);
      at = end;
    }
    if (subscriptions_.empty()) return fail("no message that fits its format; the file is damaged throughout");
    log_.drop_misplaced();
    return std::move(log_);
  }

 private:
  struct Subscription {
    std::size_t topic;
    std::vector<Field> fields;
    std::size_t size, without_padding;
  };

  /// How well what begins at a byte is a message: not at all; by its frame, of a subscription or format that was lost;
  /// or by its content too.
  enum class Fit { none, frame, content };

  static tl::unexpected<std::string> fail(const std::string& what) { return tl::unexpected("byte 0: " + what); }
  char type_of(std::size_t at) const { return static_cast<char>(bytes_[at + 2]); }
  std::size_t end_of(std::size_t at) const { return at + 3 + little<std::uint16_t>(bytes_.data() + at); }
  /// What there is of it, to the end of the file.
  std::span<const std::uint8_t> body_of(std::size_t at) const {
    return bytes_.subspan(at + 3, std::min(end_of(at), bytes_.size()) - at - 3);
  }
  static std::string text_of(std::span<const std::uint8_t> body) {
    return {reinterpret_cast<const char*>(body.data()), body.size()};
  }
  static bool printable(std::span<const std::uint8_t> text) {
    return !text.empty() && std::ranges::all_of(text, [](auto c) { return c >= 0x20 && c < 0x7f; });
  }
  /// Whether a body has its key, "TYPE NAME" behind its length at `at`.
  static bool keyed(std::span<const std::uint8_t> body, std::size_t at) {
    if (body.size() <= at || body.size() <= at + body[at]) return false;
    const auto key = body.subspan(at + 1, body[at]);
    return printable(key) && std::ranges::count(key, ' ') == 1;
  }

  /// Whether a body is a line of text behind its level and so many bytes altogether.
  static bool said(std::span<const std::uint8_t> body, std::size_t text) {
    return body.size() > text && body[0] >= '0' && body[0] <= '7' &&
           std::ranges::all_of(body.subspan(text), [](auto c) { return c >= 0x20 || c == '\t' || c == '\n'; });
  }

  Fit fit(std::size_t at) const {
    if (at + 3 > bytes_.size()) return Fit::none;
    const std::size_t size = end_of(at) - at - 3;
    const auto body = body_of(at);
    const auto when = [](bool good) { return good ? Fit::content : Fit::none; };
    switch (type_of(at)) {
      case 'D': {
        if (body.size() < 2) return when(size > 1);  // the file ends here
        const auto found = subscriptions_.find(little<std::uint16_t>(body.data()));
        if (found == subscriptions_.end()) {
          if (size < 10 || size > kLargestData || body.size() < size) return Fit::none;
          return !newest_s_ || std::abs(time_of(at) - *newest_s_) < kNeighbours_s ? Fit::frame : Fit::none;
        }
        return when(size - 2 >= found->second.without_padding && size - 2 <= found->second.size);
      }
      case 'A':
        if (size < 4 || body.size() < size || !printable(body.subspan(3))) return Fit::none;
        return formats_.contains(text_of(body.subspan(3))) ? Fit::content : Fit::frame;
      case 'F':
        return when(body.size() == size && printable(body) && std::ranges::count(body, ':') > 0 && body[0] != ':');
      case 'B':
        return when(at == kFileHeader && size >= 40 && body.size() == size);
      case 'I':
        return when(keyed(body, 0));
      case 'P':
        return when(keyed(body, 0) && size == std::size_t{5} + body[0]);
      case 'M':
      case 'Q':
        return when(keyed(body, 1) && body[0] < 4);
      case 'L':
        return when(said(body, 9));
      case 'C':
        return when(said(body, 11));
      case 'S':
        return when(size == sizeof kSync && body.size() == size && std::ranges::equal(body, kSync));
      case 'O':
      case 'R':
        return when(size == 2 && body.size() == size);
      default:  // a later version's, which is told as lost
        return Fit::none;
    }
  }

  /// Whether a message is wholly there and another one begins where it ends, or the file ends there. Where bytes were
  /// lost within it, what follows it is none: the format has no checksum.
  bool stands(std::size_t at, int frames = 0) const {
    if (fit(at) == Fit::none || end_of(at) > bytes_.size()) return false;
    const std::size_t end = end_of(at);
    if (bytes_.size() - end < 3) return true;
    constexpr int kMostFrames = 3;
    const Fit next = fit(end);
    return next == Fit::content || (next == Fit::frame && (frames == kMostFrames || stands(end, frames + 1)));
  }

  /// Skips to the next message that stands; a last one that is cut short is told as such.
  std::size_t past_damage(std::size_t at) {
    std::size_t next = at + 1;
    while (next < bytes_.size() && !stands(next)) ++next;
    const bool cut = next == bytes_.size() && (bytes_.size() - at < 3 || (fit(at) != Fit::none && end_of(at) > next));
    cut ? log_.loss.cut(next - at) : log_.loss.skip(next - at);
    return next;
  }

  void format(const std::string& text) {
    const auto colon = text.find(':');
    formats_[text.substr(0, colon)] = text.substr(colon + 1);
  }

  void parameter(std::span<const std::uint8_t> body) {
    const std::string key = text_of(body.subspan(1, body[0]));
    const auto space = key.find(' ');
    const char kind = key.starts_with("int32_t ") ? 'i' : 'f';
    log_.parameters[key.substr(space + 1)] = *number_at(body.data() + 1 + key.size(), kind);
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

  /// Without a format that is known and begins with uint64_t timestamp there is none: its data are lost.
  void subscribe(std::span<const std::uint8_t> body) {
    const std::string name = text_of(body.subspan(3));
    Subscription s{log_.topics.size(), {}, 0, 0};
    if (!expand(name, "", 0, s.fields) || s.fields.empty() || s.fields.front().name != "timestamp" ||
        s.fields.front().kind != 'Q')
      return;
    for (const auto& f : s.fields) {
      s.size += f.size;
      if (f.kind != '_') s.without_padding = s.size;
    }
    log_.topics.push_back({name, body[0], {}, {}});
    subscriptions_[little<std::uint16_t>(body.data() + 1)] = std::move(s);
  }

  double time_of(std::size_t at) const { return 1e-6 * static_cast<double>(little<std::uint64_t>(&bytes_[at + 5])); }

  /// Whether the time of data is one of its neighbours'.
  bool believed(std::size_t at) const {
    const double t = time_of(at);
    if (newest_s_ && t - *newest_s_ < kNeighbours_s) return true;
    int looked_at = 0;
    for (std::size_t next = end_of(at); next < bytes_.size() && looked_at < kNeighbours && stands(next);
         next = end_of(next))
      if (type_of(next) == 'D' && fit(next) == Fit::content) {
        if (std::abs(t - time_of(next)) < kNeighbours_s) return true;
        ++looked_at;
      }
    return !newest_s_;
  }

  void data(std::size_t at, std::span<const std::uint8_t> body) {
    const auto found = subscriptions_.find(little<std::uint16_t>(body.data()));
    if (found == subscriptions_.end() || !believed(at)) return log_.loss.skip(end_of(at) - at);
    const Subscription& s = found->second;
    TopicLog::Topic& topic = log_.topics[s.topic];
    newest_s_ = std::max(newest_s_.value_or(0), time_of(at));
    log_.loss.read(end_of(at) - at, time_of(at));
    const std::uint8_t* p = body.data() + 2;
    for (const auto& f : s.fields) {
      if (f.kind != '_') {
        const double value = *number_at(p, f.kind);
        if (&f == &s.fields.front())
          topic.t_s.push_back(1e-6 * value);
        else
          topic.columns[f.name].push_back(value);
      }
      p += f.size;
    }
  }

  std::span<const std::uint8_t> bytes_;
  std::map<std::string, std::string> formats_;
  std::map<std::uint16_t, Subscription> subscriptions_;
  std::optional<double> newest_s_;
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
