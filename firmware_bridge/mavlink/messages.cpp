// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/mavlink/messages.hpp"

namespace backwash::mavlink {
namespace {

template <class... Messages>
constexpr auto infos(MessageList<Messages...>) noexcept {
  std::array table{info<Messages>()...};
  std::ranges::sort(table, {}, &MessageInfo::id);
  return table;
}
constexpr auto kInfos = infos(KnownMessages{});

}  // namespace

const MessageInfo* find_message(std::uint32_t id) noexcept {
  const auto found = std::ranges::lower_bound(kInfos, id, {}, &MessageInfo::id);
  return found != kInfos.end() && found->id == id ? &*found : nullptr;
}

}  // namespace backwash::mavlink
