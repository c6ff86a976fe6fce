// SPDX-License-Identifier: BSD-3-Clause
// What the service manager is told (docs/faults.md row 36), and that nobody waits for it.
#include "services/backwashd/service_manager.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "services/backwashd/channels.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon {
namespace {

using namespace std::chrono_literals;

/// A service manager's socket of an abstract name; NOTIFY_SOCKET names it while it lives.
struct Listener {
  Listener() : socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    const std::string name = "@backwash-test-" + std::to_string(::getpid());
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path + 1, name.data() + 1, name.size() - 1);
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    EXPECT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), length), 0);
    ::setenv("NOTIFY_SOCKET", name.c_str(), 1);
  }
  ~Listener() {
    ::unsetenv("NOTIFY_SOCKET");
    ::close(socket);
  }
  std::vector<std::string> heard() const {
    std::vector<std::string> all;
    char bytes[512];
    for (ssize_t n = 0; (n = ::recv(socket, bytes, sizeof bytes, 0)) > 0;)
      all.emplace_back(bytes, static_cast<std::size_t>(n));
    return all;
  }
  int socket;
};

TEST(ServiceManagerTest, IsToldReadinessModeAndEnd) {
  const Listener listener;
  const auto manager = ServiceManager::of_environment(STDERR_FILENO);
  manager.ready();
  EXPECT_FALSE(manager.transition("hold", "deadline missed")) << "there is no journal here";
  manager.stopping();
  EXPECT_EQ(listener.heard(), (std::vector<std::string>{"READY=1", "STATUS=hold: deadline missed", "STOPPING=1"}));
}

TEST(ServiceManagerTest, WithoutOneNothingIsSaidAndNothingFails) {
  ::unsetenv("NOTIFY_SOCKET");
  const auto manager = ServiceManager::of_environment(STDERR_FILENO);
  manager.ready();
  manager.alive();
  EXPECT_FALSE(manager.has_journal());
}

TEST(ServiceManagerTest, OneThatReadsNothingDelaysNobody) {
  const Listener listener;
  const auto manager = ServiceManager::of_environment(STDERR_FILENO);
  const auto begun = std::chrono::steady_clock::now();
  for (int n = 0; n < 100'000; ++n) manager.alive();  // far more than a socket's queue holds
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 5s);
  EXPECT_LT(listener.heard().size(), 100'000u);
}

TEST(ServiceManagerTest, TheJournalIsSpokenToOnlyIfTheLogLeadsThere) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  struct stat status {};
  ASSERT_EQ(::fstat(ends[0], &status), 0);
  ::setenv("JOURNAL_STREAM", (std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino + 1)).c_str(), 1);
  EXPECT_FALSE(ServiceManager::of_environment(ends[1]).has_journal());
  ::unsetenv("JOURNAL_STREAM");
  for (const int end : ends) ::close(end);
}

// The watchdog is fed by the loop that flies, and by its ticks alone: where it hangs nothing is said.
TEST(Watchdog, IsFedByTheControlThreadsTicksAndByNothingElse) {
  const Listener listener;
  const auto manager = ServiceManager::of_environment(STDERR_FILENO);
  auto channels = std::make_unique<Channels>();
  firmware_bridge::AutopilotLink link(firmware_bridge::ClosedPort{}, std::nullopt, std::chrono::steady_clock::now());
  ControlLoop loop(*channels, link, test::vehicle_5in(), 0);
  std::thread control([&] { run_control(*channels, loop, manager); });
  while (channels->pulse.ticks < 5 * kAliveTicks) std::this_thread::sleep_for(1ms);
  channels->stop = true;
  control.join();
  const auto ticks = channels->pulse.ticks.load();
  const auto heard = listener.heard();
  EXPECT_EQ(heard.size(), ticks / kAliveTicks);
  for (const auto& message : heard) EXPECT_EQ(message, "WATCHDOG=1");
  std::this_thread::sleep_for(300ms);
  EXPECT_TRUE(listener.heard().empty());
}

}  // namespace
}  // namespace backwash::daemon
