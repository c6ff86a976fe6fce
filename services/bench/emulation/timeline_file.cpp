// SPDX-License-Identifier: BSD-3-Clause
#include <toml++/toml.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "services/bench/emulation/faults.hpp"

namespace backwash::bench {
namespace {

constexpr std::array<const char*, 4> kChannels{"odometry", "up", "down", "map"};
constexpr std::array<const char*, 7> kKinds{"off", "stuck", "garbage", "wrong", "slow", "delayed", "intermittent"};
constexpr std::array<const char*, 5> kWhats{"landed", "airborne", "moved", "speed", "clearance"};
constexpr double kLongest = 1e5;  // s, and of everything else

struct Wrong {
  std::string message;
};

/// A table of the file that accepts exactly the keys that are read.
class Reader {
 public:
  Reader(const std::string& file, const toml::table& table) : file_(file), table_(table) {}

  [[noreturn]] void fail(const std::string& key, const std::string& right) const {
    const toml::node* node = table_.get(key);
    std::ostringstream text;
    text << file_ << ':' << (node ? node->source() : table_.source()).begin.line << ": key '" << key << "'";
    if (node)
      node->visit([&](const auto& v) {
        if constexpr (toml::is_value<decltype(v)>) text << " = " << v.get();
      });
    throw Wrong{text.str() + (node ? ": " : " is missing: ") + right};
  }
  template <std::size_t N>
  std::size_t choice(const char* key, const std::array<const char*, N>& names) {
    known_.insert(key);
    const auto text = table_[key].value<std::string>();
    std::string all;
    for (std::size_t n = 0; n < N; ++n) {
      if (text == names[n]) return n;
      all += (n ? ", " : "needs one of ") + std::string(names[n]);
    }
    fail(key, all);
  }
  double number(const char* key, double low, double high) {
    known_.insert(key);
    const auto v = table_[key].value<double>();
    if (v && *v >= low && *v <= high) return *v;
    std::ostringstream right;
    right << "needs a number from " << low << " to " << high;
    fail(key, right.str());
  }
  double number_or(const char* key, double low, double high, double otherwise) {
    return table_.contains(key) ? number(key, low, high) : otherwise;
  }
  Vec3 vector(const char* key) {
    known_.insert(key);
    const toml::array* a = table_[key].as_array();
    Vec3 v = Vec3::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
      const auto x = a && a->size() == 3 ? (*a)[i].value<double>() : std::nullopt;
      if (!x || !(std::abs(*x) <= 1e3)) fail(key, "needs three numbers from -1000 to 1000");
      v[static_cast<int>(i)] = *x;
    }
    return v;
  }
  bool has(const char* key) const { return table_.contains(key); }
  void finish() const {
    for (const auto& [key, node] : table_)
      if (!known_.contains(std::string(key.str()))) fail(std::string(key.str()), "is not known here");
  }
  void allow(const char* key) { known_.insert(key); }

 private:
  const std::string& file_;
  const toml::table& table_;
  std::set<std::string> known_;
};

Fault fault_of(Reader r) {
  Fault f;
  f.channel = static_cast<Fault::Channel>(r.choice("channel", kChannels));
  f.kind = static_cast<Fault::Kind>(r.choice("kind", kKinds));
  f.from = r.number("from", 0, kLongest);
  f.until = r.number("until", f.from, kLongest);
  using enum Fault::Kind;
  const bool link = f.channel == Fault::Channel::up || f.channel == Fault::Channel::down;
  if (f.kind == wrong && !link) f.offset = r.vector("offset");
  if (f.kind == wrong && f.channel == Fault::Channel::odometry) f.yaw = r.number_or("yaw", -4, 4, 0);
  if (f.kind == slow) f.rate = r.number("rate", 1e-3, 1e7);
  if (f.kind == delayed) f.delay = r.number("delay", 0, kLongest);
  if (f.kind == intermittent) {
    f.on = r.number("on", 0, kLongest);
    f.off = r.number("off", 1e-3, kLongest);
  }
  r.finish();
  return f;
}

Expectation expectation_of(Reader r) {
  Expectation e;
  e.what = static_cast<Expectation::What>(r.choice("what", kWhats));
  using enum Expectation::What;
  if (e.what == landed || e.what == airborne)
    e.at = r.number("at", 0, kLongest);
  else if (e.what == clearance)
    e.limit = r.number("at_least", -kLongest, kLongest);
  else
    e.limit = r.number("at_most", 0, kLongest);
  r.finish();
  return e;
}

template <class Entry, class Read>
std::vector<Entry> list(const std::string& path, const toml::table& root, const char* key, Read read) {
  std::vector<Entry> all;
  if (!root.contains(key)) return all;
  const toml::array* tables = root[key].as_array();
  if (!tables || !tables->is_homogeneous<toml::table>())
    Reader(path, root).fail(key, "needs tables, [[" + std::string(key) + "]]");
  for (const toml::node& table : *tables) all.push_back(read(Reader(path, *table.as_table())));
  return all;
}

}  // namespace

const char* name_of(Fault::Channel channel) { return kChannels[static_cast<std::size_t>(channel)]; }
const char* name_of(Fault::Kind kind) { return kKinds[static_cast<std::size_t>(kind)]; }

tl::expected<Timeline, config::ConfigError> load_timeline(const std::string& path) {
  using enum config::ConfigError::Kind;
  if (std::error_code unknown; !std::filesystem::is_regular_file(path, unknown))
    return tl::unexpected(
        config::ConfigError{not_found, path + ": is no file that can be read; needs a timeline of faults, TOML"});
  try {
    const toml::table root = toml::parse_file(path);
    Reader r(path, root);
    r.allow("fault");
    r.allow("expect");
    Timeline t;
    if (r.has("after")) t.after_arming = r.choice("after", std::array<const char*, 2>{"start", "arming"}) == 1;
    r.finish();
    t.faults = list<Fault>(path, root, "fault", fault_of);
    t.expectations = list<Expectation>(path, root, "expect", expectation_of);
    return t;
  } catch (const Wrong& w) {
    return tl::unexpected(config::ConfigError{invalid, w.message});
  } catch (const toml::parse_error& e) {
    std::ostringstream text;
    text << path << ':' << e.source().begin.line << ": " << e.description();
    return tl::unexpected(config::ConfigError{e.source().begin.line ? invalid : not_found, text.str()});
  }
}

}  // namespace backwash::bench
