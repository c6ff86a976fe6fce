// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>

#include "core/map/occupancy_grid.hpp"

// The node streams of OctoMap, walked without building a tree. liboctomap's own readers neither notice the end of the
// stream nor bound the depth and print to stderr, so untrusted bytes are read here.
namespace backwash::map::octomap_tree {

inline constexpr int kDepth = 16;        ///< Levels below the root: voxel keys are 16 bits per axis.
inline constexpr int kCenter = 1 << 15;  ///< Key of the voxel whose minimum corner is the world's origin.

/// What a walk found. `fault` is null for a whole, well-formed stream, else says what is wrong.
struct Walk {
  std::size_t nodes = 0;  ///< Inner nodes and leaves, as OctoMap's `size` header counts them.
  const char* fault = nullptr;
};

/// Bytes that a node of an occupancy tree's full stream holds between its log-odds and its children, by the tree's id
/// as liboctomap's AbstractOcTree knows it: a colour, or nothing. A time stamp is not written. Nothing: another tree.
inline std::optional<std::size_t> bytes_beside(std::string_view id) noexcept {
  if (id == "OcTree" || id == "OcTreeStamped") return 0;
  return id == "ColorOcTree" ? std::optional<std::size_t>(3) : std::nullopt;
}

/// Key of child i (bit 0: x, bit 1: y, bit 2: z) of the node at `key` whose children have `edge` voxels.
inline Index3 child_key(const Index3& key, int i, int edge) noexcept {
  return key + edge * Index3(i & 1, i >> 1 & 1, i >> 2 & 1);
}

/// Preorder reader of one stream; calls on_leaf(key of the minimum corner, edge in voxels, cell) for each leaf.
template <class OnLeaf>
class Reader {
 public:
  Reader(std::span<const std::int8_t> data, std::size_t beside, OnLeaf on_leaf)
      : data_(data), beside_(beside), on_leaf_(on_leaf) {}

  Walk read(bool binary) {
    if (data_.empty()) return {0, "the tree is empty"};
    walk_.nodes = 1;
    binary ? binary_node(Index3::Zero(), kDepth) : full_node(Index3::Zero(), kDepth);
    if (!walk_.fault && position_ != data_.size()) walk_.fault = "bytes are left over after the tree";
    return walk_;
  }

 private:
  /// Inner node of writeBinaryData: two bits per child, 01 free leaf, 10 occupied leaf, 11 inner node, then the latter.
  void binary_node(const Index3& key, int level) {
    std::uint16_t children = 0;
    if (!take(children)) return;
    if (children == 0) return fail("an inner node has no children");
    const int edge = 1 << (level - 1);
    for (int i = 0; i < 8 && !walk_.fault; ++i) {
      const int code = children >> (2 * i) & 3;
      if (code == 0) continue;
      ++walk_.nodes;
      const Index3 child = child_key(key, i, edge);
      if (code != 3) {
        on_leaf_(child, edge, code == 1 ? Cell::free : Cell::occupied);
      } else if (level == 1) {
        return fail("the tree is deeper than 16 levels");
      } else {
        binary_node(child, level - 1);
      }
    }
  }

  /// Node of writeData: log-odds as float, what is beside it, one bit per child, then the children. A leaf is occupied
  /// from p = 0.5, OcTree's default threshold; the stream carries none.
  void full_node(const Index3& key, int level) {
    float log_odds = 0;
    std::uint8_t children = 0;
    if (!take(log_odds) || !pass(beside_) || !take(children)) return;
    if (std::isnan(log_odds)) return fail("a node's log-odds is not a number");
    if (children == 0) return on_leaf_(key, 1 << level, log_odds >= 0 ? Cell::occupied : Cell::free);
    if (level == 0) return fail("the tree is deeper than 16 levels");
    const int edge = 1 << (level - 1);
    for (int i = 0; i < 8 && !walk_.fault; ++i) {
      if ((children >> i & 1) == 0) continue;
      ++walk_.nodes;
      full_node(child_key(key, i, edge), level - 1);
    }
  }

  bool pass(std::size_t bytes) {
    if (data_.size() - position_ < bytes) {
      fail("the data end in the middle of the tree");
      return false;
    }
    position_ += bytes;
    return true;
  }
  template <class T>
  bool take(T& value) {
    if (!pass(sizeof(T))) return false;
    // Little-endian, like every writer of these files.
    std::memcpy(&value, data_.data() + position_ - sizeof(T), sizeof(T));
    return true;
  }
  void fail(const char* what) { walk_.fault = what; }

  std::span<const std::int8_t> data_;
  std::size_t beside_;
  OnLeaf on_leaf_;
  std::size_t position_ = 0;
  Walk walk_;
};

/// Walks a stream of writeBinaryData (`binary`), which is the same for every occupancy tree, or writeData, whose nodes
/// hold `beside` bytes more (bytes_beside). O(bytes), recursion at most 16 deep.
template <class OnLeaf>
Walk walk(std::span<const std::int8_t> data, bool binary, std::size_t beside, OnLeaf on_leaf) {
  return Reader<OnLeaf>(data, beside, on_leaf).read(binary);
}

}  // namespace backwash::map::octomap_tree
