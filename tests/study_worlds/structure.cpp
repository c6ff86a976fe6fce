// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/structure.hpp"

#include <cmath>
#include <cstdio>

#include "tests/study_worlds/effects.hpp"

namespace study_worlds {
namespace {

using Kind = HiddenStructure::Kind;
using Quantity = HiddenStructure::Quantity;
using Where = HiddenStructure::Where;

double between(std::mt19937_64& rng, double low, double high) { return std::uniform_real_distribution(low, high)(rng); }
int one_of(std::mt19937_64& rng, int count) { return static_cast<int>(between(rng, 0, count)); }

double value_of(Quantity q, const Instant& now) {
  switch (q) {
    case Quantity::x:
      return now.p.x();
    case Quantity::y:
      return now.p.y();
    case Quantity::z:
      return now.p.z();
    case Quantity::yaw:
      return now.yaw;
    case Quantity::t:
      return now.t;
    default:
      return now.temperature;
  }
}

/// rad per unit of a quantity that changes its sign once or twice over a flight: what products are made of.
double slow(Quantity q, std::mt19937_64& rng) {
  if (q == Quantity::yaw) return 1 + one_of(rng, 2);
  if (q == Quantity::t) return 2 * M_PI / between(rng, 60, 200);
  if (q == Quantity::temperature) return 2 * M_PI / between(rng, 8, 14);
  return 2 * M_PI / between(rng, 2, 5);
}

void draw_bump(HiddenStructure& s, std::mt19937_64& rng) {
  constexpr Quantity kAlong[] = {Quantity::z, Quantity::t, Quantity::temperature};
  s.along[0] = kAlong[one_of(rng, 3)];
  if (s.along[0] == Quantity::z) s.number = {between(rng, 0.6, 1.6), between(rng, 0.15, 0.3)};
  if (s.along[0] == Quantity::t) s.number = {between(rng, 30, 90), between(rng, 10, 20)};
  if (s.along[0] == Quantity::temperature) s.number = {between(rng, 27, 33), between(rng, 1.5, 2.5)};
}

}  // namespace

HiddenStructure draw_structure(std::mt19937_64& rng) {
  HiddenStructure s;
  s.kind = static_cast<Kind>(one_of(rng, 5));
  s.where = static_cast<Where>(one_of(rng, 3));
  s.direction = between(rng, -M_PI, M_PI);
  s.phase = {between(rng, -M_PI, M_PI), between(rng, -M_PI, M_PI)};
  if (s.kind == Kind::tone) s.number[0] = 2 * M_PI * std::exp(between(rng, std::log(0.02), std::log(0.2)));
  if (s.kind == Kind::heading) {  // a level push that turns once with the heading is a trim
    const int least = s.where == Where::level ? 2 : 1;
    s.along[0] = Quantity::yaw;
    s.number[0] = least + one_of(rng, 6 - least);
  }
  if (s.kind == Kind::wave) {
    s.along[0] = static_cast<Quantity>(one_of(rng, 3));
    s.number[0] = 2 * M_PI / between(rng, 0.9, 2.5);
  }
  if (s.kind == Kind::product) {
    const int first = one_of(rng, 6), second = (first + 1 + one_of(rng, 5)) % 6;
    s.along = {static_cast<Quantity>(first), static_cast<Quantity>(second)};
    s.number = {slow(s.along[0], rng), slow(s.along[1], rng)};
  }
  if (s.kind == Kind::bump) draw_bump(s, rng);
  return s;
}

double value_at(const HiddenStructure& s, const Instant& now) {
  const double first = value_of(s.along[0], now);
  if (s.kind == Kind::bump) return 2.2 * std::exp(-std::pow((first - s.number[0]) / s.number[1], 2));
  const double wave = std::sqrt(2.0) * std::cos(s.number[0] * first + s.phase[0]);
  if (s.kind != Kind::product) return wave;
  return wave * std::sqrt(2.0) * std::cos(s.number[1] * value_of(s.along[1], now) + s.phase[1]);
}

std::string text_of(const HiddenStructure& s) {
  static const char* const kKinds[] = {"tone", "heading", "wave", "product", "bump"};
  static const char* const kQuantities[] = {"x", "y", "z", "yaw", "t", "temperature"};
  static const char* const kWhere[] = {"level", "up", "variance"};
  const auto of = [](Quantity q) { return kQuantities[static_cast<std::size_t>(q)]; };
  char text[96];
  std::snprintf(text, sizeof text, "%s of %s%s%s %.3g, %s", kKinds[static_cast<std::size_t>(s.kind)], of(s.along[0]),
                s.kind == Kind::product ? " and " : "", s.kind == Kind::product ? of(s.along[1]) : "",
                s.kind == Kind::tone ? s.number[0] / (2 * M_PI) : s.number[0],
                kWhere[static_cast<std::size_t>(s.where)]);
  return text;
}

}  // namespace study_worlds
