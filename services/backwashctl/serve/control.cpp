// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/control.hpp"

#include <algorithm>

namespace backwash::ctl {
namespace {

using std::chrono::duration;

std::chrono::steady_clock::duration seconds(double s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(duration<double>(s));
}

}  // namespace

std::optional<Vec3> point_of(const nlohmann::json& said) {
  if (!said.is_array() || said.size() != 3 || !std::ranges::all_of(said, [](const auto& n) { return n.is_number(); }))
    return std::nullopt;
  const Vec3 p(said[0], said[1], said[2]);
  return p.allFinite() ? std::optional(p) : std::nullopt;
}

const Control::Verb Control::kVerbs[] = {{"stop", backwash_msgs_msg_dds__COMMAND_STOP, 3},
                                         {"land", backwash_msgs_msg_dds__COMMAND_LAND, 2},
                                         {"hold", backwash_msgs_msg_dds__COMMAND_HOLD, 1},
                                         {"goto", backwash_msgs_msg_dds__COMMAND_GOTO, 0},
                                         {"release", backwash_msgs_msg_dds__COMMAND_RELEASE, 0}};

/// Pages that have been gone for long.
void Control::forget(Clock::time_point now) {
  std::erase_if(pages_,
                [&](const auto& entry) { return entry.second.left && now - *entry.second.left > seconds(kGone_s); });
}

bool Control::full(bool admitted) const {
  const auto alike = [&](const auto& entry) { return entry.second.admitted == admitted; };
  return std::ranges::count_if(pages_, alike) >= static_cast<std::ptrdiff_t>(kPages);
}

bool Control::enter(const std::string& page) {
  const std::lock_guard lock(mutex_);
  forget(Clock::now());
  const auto known = pages_.find(page);
  if (known != pages_.end() ? !known->second.left : full(false)) return false;
  pages_[page].left.reset();
  return true;
}

bool Control::admit(const std::string& page) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  forget(now);
  const auto known = pages_.find(page);
  if ((known == pages_.end() || !known->second.admitted) && full(true)) return false;
  if (known == pages_.end())
    pages_[page] = {true, now};
  else
    known->second.admitted = true;
  return true;
}

bool Control::admitted(const std::string& page) const {
  const std::lock_guard lock(mutex_);
  const auto known = pages_.find(page);
  return known != pages_.end() && known->second.admitted;
}

void Control::leave(const std::string& page) {
  const std::lock_guard lock(mutex_);
  pages_[page].left = Clock::now();
}

bool Control::gone(const std::string& page, Clock::time_point now) const {
  const auto known = pages_.find(page);
  return known == pages_.end() || (known->second.left && now - *known->second.left > seconds(kGone_s));
}

bool Control::held_by_another(const std::string& page, Clock::time_point now) const {
  return holder_ && holder_->page != page && now < holder_->until && !gone(holder_->page, now);
}

Reply Control::command(const nlohmann::json& said, const std::string& remote) {
  const auto text = [&](const char* key) {
    return said.is_object() && said.contains(key) && said[key].is_string() ? said[key].get<std::string>() : "";
  };
  const std::string page = text("page"), name = text("verb");
  const auto* verb = std::ranges::find_if(kVerbs, [&](const Verb& v) { return name == v.name; });
  if (verb == std::end(kVerbs)) return refusal(400, "verb must be stop, land, hold, goto or release");
  const bool flies = name == "goto";
  const auto goal = flies && said.contains("goal") ? point_of(said["goal"]) : std::nullopt;
  if (flies && !goal) return refusal(400, "goal must be three finite numbers, m in the map");
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  const bool stops = name == "stop", others = held_by_another(page, now);
  if (gone(page, now) && !stops) return refusal(409, "page must be one that listens to /events");
  // A page repeats what was not delivered: what was asked for before a STOP must not come after it.
  if (flies && !(said.contains("stops") && said["stops"] == stops_))
    return refusal(409, "a STOP has come since this was asked for; ask again");
  if (others && !stops) return refusal(409, "read-only: the session is held by another page, of " + holder_->remote);
  if (wish_ && wish_->verb->urgency > verb->urgency)
    return refusal(409, std::string(wish_->verb->name) + " is sent first");
  // A STOP takes no session from anybody, nor one for itself: whoever lands next need not wait.
  if (!others && (!stops || (holder_ && holder_->page == page)))
    holder_ = Holder{page, remote, now + seconds(kLease_s)};
  wish_ = Wish{verb, goal.value_or(Vec3::Zero()), ++numbers_, now};
  stops_ += stops;
  say(*wish_, "sent", "");
  wished_.notify_all();
  return {202, nlohmann::json{{"number", numbers_}}.dump()};
}

void Control::say(const Wish& wish, const std::string& state, const std::string& reason) {
  if (wish.number < numbers_) return;  // a later one is told of
  command_ = {{"number", wish.number},
              {"verb", wish.verb->name},
              {"state", state},
              {"reason", reason},
              {"after_s", duration<double>(Clock::now() - wish.since).count()}};
}

nlohmann::json Control::told(const std::string& page) const {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  const bool others = held_by_another(page, now), mine = holder_ && holder_->page == page && now < holder_->until;
  const double left = others || mine ? duration<double>(holder_->until - now).count() : 0;
  return {{"session",
           {{"mine", mine},
            {"holder", others ? "another page, of " + holder_->remote : ""},
            {"left_s", left},
            {"stops", stops_}}},
          {"command", command_}};
}

bool Control::cut_off(int urgency) const {
  const std::lock_guard lock(mutex_);
  return wish_ && wish_->verb->urgency > urgency;
}

void Control::carry_out(const Wish& wish) {
  const bool stops = wish.verb->code == backwash_msgs_msg_dds__COMMAND_STOP;
  const auto given_up = [&] { return cut_off(wish.verb->urgency); };
  if (wish.verb->code == backwash_msgs_msg_dds__COMMAND_RELEASE) {
    station_.release(given_up);
    const std::lock_guard lock(mutex_);
    ours_until_ = {};
    holder_.reset();
    return say(wish, "accepted", "session released");
  }
  std::optional<Station::Result> result;
  do result = station_.send(wish.verb->code, wish.goal_W, 0, {}, given_up);
  while (stops && !result && !interrupted());
  const std::lock_guard lock(mutex_);
  ours_until_ = Clock::now() + seconds(kLease_s);
  if (!result) return say(wish, "silent", "no daemon answered");
  if (result->result == backwash_msgs_msg_dds__ACK_NOT_YOURS) {
    holder_.reset();
    ours_until_ = {};
  }
  say(wish, result->result == backwash_msgs_msg_dds__ACK_ACCEPTED ? "accepted" : "refused", result->reason);
}

/// Ends the daemon's session where no page has ours any more: other stations need not wait.
void Control::let_go() {
  {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    if (now >= ours_until_ || (holder_ && now < holder_->until && !gone(holder_->page, now))) return;
    ours_until_ = {};
    holder_.reset();
  }
  station_.release([this] { return cut_off(-1); });
}

void Control::run(const std::stop_token& stopped) {
  while (!interrupted() && !stopped.stop_requested()) {
    std::optional<Wish> wish;
    {
      std::unique_lock lock(mutex_);
      wished_.wait_for(lock, std::chrono::milliseconds(100), [&] { return wish_.has_value(); });
      std::swap(wish, wish_);
    }
    if (wish)
      carry_out(*wish);
    else
      let_go();
  }
}

}  // namespace backwash::ctl
