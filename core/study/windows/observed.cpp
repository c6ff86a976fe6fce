// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/observed.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

namespace backwash::study {
namespace {

/// Appends what it is given; whoever is packed and whoever is unpacked is visited by the same functions.
struct Packer {
  std::string bytes;
  static constexpr bool good = true;
  void refuse() {}
  void raw(void* value, std::size_t size) { bytes.append(static_cast<const char*>(value), size); }
  std::size_t count(std::size_t n) {
    raw(&n, sizeof n);
    return n;
  }
};

/// Reads it back in the same order; `good` until the bytes do not suffice.
struct Unpacker {
  std::string_view bytes;
  bool good = true;
  void refuse() { good = false; }
  void raw(void* value, std::size_t size) {
    good = good && size <= bytes.size();
    if (!good) return;
    std::memcpy(value, bytes.data(), size);
    bytes.remove_prefix(size);
  }
  /// How many follow, each of a byte or more: a count from damaged bytes asks for no memory.
  std::size_t count(std::size_t) {
    std::size_t n = 0;
    raw(&n, sizeof n);
    good = good && n <= bytes.size();
    return good ? n : 0;
  }
};

template <typename A>
struct Visitor {
  A& archive;

  template <typename... T>
  void operator()(T&... values) {
    (visit(values), ...);
  }

 private:
  void visit(double& value) { archive.raw(&value, sizeof value); }
  void visit(int& value) { archive.raw(&value, sizeof value); }
  void visit(std::size_t& value) { archive.raw(&value, sizeof value); }
  void visit(bool& value) {
    auto byte = static_cast<std::uint8_t>(value);
    archive.raw(&byte, 1);
    value = byte != 0;
  }
  void visit(Gate& gate) {
    auto number = static_cast<std::size_t>(gate);
    visit(number);
    if (number > static_cast<std::size_t>(Gate::outside)) {
      number = 0;
      archive.refuse();
    }
    gate = static_cast<Gate>(number);
  }
  template <int rows, int columns>
  void visit(Eigen::Matrix<double, rows, columns>& value) {
    archive.raw(value.data(), sizeof(double) * static_cast<std::size_t>(value.size()));
  }
  template <typename T, std::size_t n>
  void visit(std::array<T, n>& all) {
    for (auto& each : all) visit(each);
  }
  template <typename T>
  void visit(std::vector<T>& all) {
    const std::size_t n = archive.count(all.size());
    for (std::size_t k = 0; k < n && archive.good; ++k) {
      if (k == all.size()) all.resize(k + 1);
      visit(all[k]);
    }
  }
  void visit(std::string& text) {
    text.resize(archive.count(text.size()));
    archive.raw(text.data(), text.size());
  }
  template <typename T>
  void visit(std::optional<T>& value) {
    bool there = value.has_value();
    visit(there);
    if (there) visit(value ? *value : value.emplace());
  }
  template <typename S, typename T>
  void visit(std::pair<S, T>& both) {
    (*this)(both.first, both.second);
  }
  /// A set or a map, as a list in its order.
  template <typename T, typename Container>
  void visit_as(Container& all) {
    std::vector<T> list(all.begin(), all.end());
    visit(list);
    all = Container(list.begin(), list.end());
  }
  void visit(PlaceAround& a) { (*this)(a.height, a.ceiling_gap, a.walls, a.whole_walls); }
  void visit(RotorLine& l) { (*this)(l.excess, l.amplitude2, l.floor2, l.folded); }
  void visit(Fourth& f) { (*this)(f.at_once, f.apart); }
  void visit(FirstStage& s) { (*this)(s.instruments, s.followed); }
  void visit(Delays::ThrustMoments& m) { (*this)(m.window, m.delay, m.slope, m.mean, m.stage); }
  void visit(DelayStage::Seen& s) { (*this)(s.window, s.y, s.design); }
  void visit(DelayStage& stage) {
    auto seen = stage.seen();
    visit(seen);
    stage = {};
    for (const auto& s : seen) stage.add(s.window, s.y, s.design);
  }
  void visit(Delays& d) { (*this)(d.thrust, d.command, d.tilt); }
  void visit(WindowRow::Led& l) { (*this)(l.give, l.slowed, l.asked_W, l.asked2, l.off_W); }
  /// The names are counted by the compiler: a field that is new in WindowRow has to be named here, too.
  void visit(WindowRow& row) {
    auto& [flight, segment, t, duration, p_W, v_W, speed, speeds, shares, R_WB, thrust_acc, voltage, temperature,
           around, path, led, held_off, varied2, sigma, ln_sigma_moved, delay_gain, slope_gain, mean_gain, delay_at,
           slope_at, climbs, command_gain, lag_gain, drag_gain, tilt_gain, measured_variance, lines] = row;
    (*this)(flight, segment, t, duration, p_W, v_W, speed, speeds, shares, R_WB, thrust_acc, voltage);
    (*this)(temperature, around, path, led, held_off, varied2, sigma, ln_sigma_moved, delay_gain);
    (*this)(slope_gain, mean_gain, delay_at, slope_at, climbs, command_gain, lag_gain, drag_gain, tilt_gain);
    visit(measured_variance);
    visit(lines);
  }
  void visit(Observations& seen) {
    auto& [flights, windows, first, units, row_period, y, weight, gated_out, missing, sound_rotors] = seen;
    (*this)(flights, windows, first, row_period, y, weight);
    visit_as<std::pair<Gate, std::size_t>>(gated_out);
    static_cast<void>(units);
    static_cast<void>(missing);  // made when all flights are together
    static_cast<void>(sound_rotors);
  }

 public:
  void visit(Observed& all) {
    auto& [seen, delays, tails, ever, strayed] = all;
    (*this)(seen, delays, tails, strayed);
    visit_as<std::string>(ever);
  }
};

bool sound(const WindowRow& row) { return row.path.empty() || row.path.size() == kPoints; }

/// Whether every number is within what it counts, so that nothing beyond it is read.
bool sound(const Observed& all) {
  const Observations& seen = all.seen;
  const std::size_t n = seen.windows.size();
  const auto within = [n](const auto& list) {
    return std::ranges::all_of(list, [n](auto& w) { return w.window < n; });
  };
  const auto measured = [n](const auto& channels) {
    return std::ranges::all_of(channels, [n](auto& c) { return c.size() == n; });
  };
  return seen.first.size() == seen.flights + 1 && seen.first.front() == 0 && seen.first.back() == n &&
         std::ranges::is_sorted(seen.first) && measured(seen.y) && measured(seen.weight) && all.tails.size() == n &&
         std::ranges::all_of(seen.windows, [&](auto& row) { return sound(row) && row.flight < seen.flights; }) &&
         within(all.delays.thrust) && within(all.delays.command[0].seen()) && within(all.delays.command[1].seen()) &&
         within(all.delays.tilt.seen());
}

}  // namespace

std::string packed(Observed flights) {
  Packer packer;
  Visitor<Packer>{packer}.visit(flights);
  return std::move(packer.bytes);
}

std::optional<Observed> unpacked(std::string_view bytes) {
  Unpacker unpacker{bytes};
  Observed flights;
  Visitor<Unpacker>{unpacker}.visit(flights);
  if (!unpacker.good || !unpacker.bytes.empty() || !sound(flights)) return std::nullopt;
  return flights;
}

}  // namespace backwash::study
