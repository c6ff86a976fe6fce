// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/child.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <filesystem>

#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

constexpr int kNotRun = 127;  // as sh says it

/// In the child, between fork and exec: calls that may be made there alone.
[[noreturn]] void become(const std::vector<char*>& words, const char* folder, int output, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kNotRun);  // it ended before the line above
  const int nothing = ::open("/dev/null", O_RDONLY);
  if (nothing < 0 || ::dup2(nothing, STDIN_FILENO) < 0) ::_exit(kNotRun);
  if (output >= 0 && ::dup2(output, STDOUT_FILENO) < 0) ::_exit(kNotRun);
  if (*folder != 0 && ::chdir(folder) != 0) ::_exit(kNotRun);
  ::execvp(words.front(), words.data());
  ::_exit(kNotRun);
}

}  // namespace

std::string own_program() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

Child start(const std::vector<std::string>& command, const std::string& folder, bool capture) {
  std::vector<std::string> words = command;
  if (words.front() == "backwash") words.front() = own_program();
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  int ends[2] = {-1, -1};
  if (capture && ::pipe2(ends, O_CLOEXEC) != 0) throw Failure(kSystem, "no pipe can be made; close some programs");
  const pid_t parent = ::getpid(), process = ::fork();
  if (process == 0) become(pointers, folder.c_str(), ends[1], parent);
  if (ends[1] >= 0) ::close(ends[1]);
  if (process > 0) return {process, ends[0]};
  if (ends[0] >= 0) ::close(ends[0]);
  throw Failure(kSystem, "no process can be started; close some programs");
}

std::string read_to_end(Child& child) {
  std::string text;
  std::array<char, 65536> block;
  for (ssize_t n = 1; n != 0;) {
    n = ::read(child.output, block.data(), block.size());
    if (n < 0 && errno != EINTR) break;
    if (n > 0) text.append(block.data(), static_cast<std::size_t>(n));
  }
  ::close(child.output);
  child.output = -1;
  return text;
}

int code_of(int status) noexcept { return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status); }

int wait_for(const Child& child) {
  int status = 0;
  while (::waitpid(child.process, &status, 0) < 0 && errno == EINTR) continue;
  return code_of(status);
}

std::string end_in_words(int code) {
  if (code > 128) return "was ended by signal " + std::to_string(code - 128);
  return code == kNotRun ? "cannot be run" : "ended with " + std::to_string(code);
}

std::string shell_line(const std::vector<std::string>& words) {
  std::string line;
  for (const auto& word : words) {
    if (!line.empty()) line += ' ';
    const bool plain = !word.empty() && word.find_first_not_of(
                                            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                            "_-./:=,@%+") == word.npos;
    if (plain) {
      line += word;
      continue;
    }
    line += '\'';
    for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += '\'';
  }
  return line;
}

}  // namespace backwash::services
