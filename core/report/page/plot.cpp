// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/plot.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

extern char** environ;

namespace backwash::report {
namespace {

/// A new folder that goes when this goes.
struct TemporaryFolder {
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "backwash-plot-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) path = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path.empty()) std::filesystem::remove_all(path, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path path;
};

std::string content(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

tl::unexpected<PlotError> fail(const std::string& message) { return tl::make_unexpected(PlotError{message}); }

/// Exit status of `gnuplot script`, its stderr in `complaints`; −1 if it cannot be started.
int run_gnuplot(const std::string& script, const std::string& complaints) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, complaints.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  std::string program = "gnuplot", argument = script;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, "gnuplot", &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  if (error != 0 || ::waitpid(child, &status, 0) != child) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

std::string gnuplot_quoted(const std::string& text) {
  std::string literal = "'";
  for (const char c : text) {
    const bool control = static_cast<unsigned char>(c) < ' ' || c == '\x7f';
    literal += c == '\'' ? "\u2019" : std::string(1, control ? '?' : c);
  }
  return literal + "'";
}

tl::expected<std::string, PlotError> draw(const std::string& script, Format format, int width, int height) {
  const TemporaryFolder folder;
  if (folder.path.empty())
    return fail("no folder for temporary files can be made; set TMPDIR to one that can be written");
  const auto script_path = folder.path / "script.gp", picture = folder.path / "picture",
             complaints = folder.path / "stderr";
  const bool svg = format == Format::svg;
  {
    std::ofstream file(script_path, std::ios::binary);
    file << "set encoding utf8\nset terminal " << (svg ? "svg dynamic" : "pngcairo") << " size " << width << ','
         << height << " enhanced font 'DejaVu Sans," << (svg ? 13 : 10) << "' background 'white'\n"
         << "set output " << gnuplot_quoted(picture.string()) << '\n'
         << script;
    if (!file.flush()) return fail("the plot script cannot be written; free some space in TMPDIR");
  }
  const int status = run_gnuplot(script_path, complaints);
  if (status < 0 || status == 127) return fail("gnuplot cannot be started; install gnuplot-nox");
  std::string drawn = content(picture);
  if (status != 0 || drawn.empty()) {
    std::string words = content(complaints);
    std::replace(words.begin(), words.end(), '\n', ' ');
    return fail("gnuplot failed: " + words.substr(0, 300));
  }
  if (svg) drawn.erase(0, drawn.find("<svg"));
  return drawn;
}

}  // namespace backwash::report
