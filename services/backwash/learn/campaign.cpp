// SPDX-License-Identifier: BSD-3-Clause
#include <wordexp.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "core/files/read_file.hpp"
#include "services/backwash/child.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

using Words = std::vector<std::string>;

constexpr std::size_t kTasks = 1000;  // Slurm's arrays end at 1001
constexpr std::size_t kLargestResult = std::size_t{16} << 30;

struct CampaignOptions {
  std::string commands, folder;
  std::vector<int> lines;
  std::optional<std::uint64_t> task;
  std::string partition, time, account;  ///< as sbatch takes them; empty: its own
  bool dry_run = false, json = false, force = false;
};

/// A command of the campaign and its line in the file, from 1.
struct Line {
  std::size_t number;
  Words words;
};

/// Words as sh would make them of the line; nothing is run for it. Throws Failure 65.
Words words_of(const std::string& line, const std::string& where) {
  wordexp_t expanded{};
  const int wrong = ::wordexp(line.c_str(), &expanded, WRDE_NOCMD | WRDE_UNDEF);
  Words words(expanded.we_wordv, expanded.we_wordv + (wrong == 0 ? expanded.we_wordc : 0));
  ::wordfree(&expanded);
  if (wrong != 0 || words.empty())
    throw Failure(kBadData, where + "is no command; give words as for sh, without pipes, ; and $( )");
  try {
    static_cast<void>(Json(words).dump());  // a result names them
  } catch (const Json::type_error&) {
    throw Failure(kBadData, where + "its words are no UTF-8; give files other names");
  }
  return words;
}

std::vector<Line> read_commands(const std::string& path) {
  const auto text = files::read_file(path, files::kLargestTable, "a file of commands, one a line");
  if (!text) throw Failure(kNoInput, path + ":1: " + text.error().message);
  std::vector<Line> lines;
  std::istringstream all(*text);
  std::size_t number = 0;
  for (std::string line; std::getline(all, line);) {
    ++number;
    if (const auto first = line.find_first_not_of(" \t\r"); first == line.npos || line[first] == '#') continue;
    lines.push_back({number, words_of(line, path + ":" + std::to_string(number) + ": ")});
  }
  if (lines.empty()) throw Failure(kBadData, path + ":1: has no command; give one a line");
  return lines;
}

std::string result_path(const std::string& folder, std::size_t number) {
  return folder + "/line-" + std::to_string(number) + ".jsonl";
}

/// What a result is made of: the command, this program, and every file that the command names.
class Made {
 public:
  Json of(const Words& words) {
    Json made{{"command", words}, {"program", nullptr}, {"inputs", Json::object()}};
    if (words.front() == "backwash") made["program"] = {{"version", kVersion}, {"sha256", hash(own_program())}};
    const std::string research = own_program() + "-" + (words.size() > 1 ? words[1] : "");
    if (words.front() == "backwash") add(research, made["inputs"]);  // a verb that is a program of its own
    for (const auto& word : words) {
      const auto value = word.starts_with("-") ? word.find('=') : std::string::npos;
      add(value == std::string::npos ? word : word.substr(value + 1), made["inputs"]);
    }
    return made;
  }

 private:
  /// A file, or the files that lie in a folder, without those in folders of its own. Words that are neither are no
  /// inputs.
  void add(const std::string& path, Json& inputs) {
    namespace fs = std::filesystem;
    std::error_code unknown;
    if (fs::is_regular_file(path, unknown)) inputs[path] = hash(path);
    if (!fs::is_directory(path, unknown)) return;
    for (fs::directory_iterator at(path, unknown), end; !unknown && at != end; at.increment(unknown))
      if (std::error_code odd; at->is_regular_file(odd)) inputs[at->path()] = hash(at->path());
  }
  std::string hash(const std::string& path) {
    auto& known = hashes_[path];
    if (known.empty()) known = sha256_of_file(path);
    return known;
  }
  std::map<std::string, std::string> hashes_;
};

/// What differs between what a result was made of and what it would be made of now; empty: nothing.
std::string difference(const Json& was, const Json& now) {
  if (was == now) return "";
  if (!was.is_object() || was.value("command", Json()) != now["command"]) return "command";
  if (was.value("program", Json()) != now["program"]) return "program";
  for (const auto& [path, hash] : now["inputs"].items())
    if (was.value("inputs", Json::object()).value(path, "") != hash) return path;
  return "file";
}

/// Rows of a result. Throws Failure 65 with its file for one that another command, program or file made.
std::string rows_of(const std::string& path, const Json& now) {
  auto text = files::read_file(path, kLargestResult, "what a line of the campaign printed");
  if (!text) throw Failure(kBadData, path + ":1: " + text.error().message);
  const auto end = text->find('\n');
  const auto head = Json::parse(text->substr(0, end), nullptr, false);
  if (end == std::string::npos || !head.is_object() || !head.contains("made"))
    throw Failure(kBadData, path + ":1: is no result of a campaign; remove it and run its line again");
  if (const auto other = difference(head["made"], now); !other.empty())
    throw Failure(kBadData, path + ":1: was made with another " + other + "; remove it and run its line again");
  return text->substr(end + 1);
}

/// Whether it is lines of JSON, one or more.
bool are_rows(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (!Json::accept(line)) return false;
  return text.ends_with('\n');
}

/// Does a line whose result is not there.
void do_line(const CampaignOptions& options, const Line& line, Made& made) {
  const std::string path = result_path(options.folder, line.number),
                    where = options.commands + ":" + std::to_string(line.number) + ": ";
  const Json now = made.of(line.words);
  if (std::filesystem::exists(path)) return static_cast<void>(rows_of(path, now));
  auto child = start(line.words, "", true);
  const std::string rows = read_to_end(child);
  if (const int code = wait_for(child); code != 0)
    throw Failure(kUnavailable, where + line.words.front() + " " + end_in_words(code));
  if (!are_rows(rows)) throw Failure(kBadData, where + line.words.front() + " printed no lines of JSON");
  if (const auto other = difference(now, Made().of(line.words)); !other.empty())
    throw Failure(kBadData, where + "its " + other + " changed while it ran; run it again");
  write_file(path, Json{{"made", now}}.dump() + "\n" + rows, true);
}

bool asked_for(const CampaignOptions& options, const Line& line) {
  if (options.task) return line.number % kTasks == *options.task % kTasks;
  return options.lines.empty() || std::ranges::count(options.lines, static_cast<int>(line.number)) > 0;
}

int run(const CampaignOptions& options) {
  const auto lines = read_commands(options.commands);
  std::filesystem::create_directories(options.folder);
  Made made;
  std::optional<Failure> first;
  std::size_t asked = 0;
  for (const auto& line : lines) {
    if (!asked_for(options, line)) continue;
    ++asked;
    progress("line " + std::to_string(line.number) + " of " + std::to_string(lines.back().number));
    try {
      do_line(options, line, made);
    } catch (const Failure& failure) {
      if (!first) first = failure;  // the others are tried
    }
  }
  if (first) throw Failure(*first);
  if (asked == 0) throw Failure(kUsage, options.commands + ":1: has no command in these lines");
  return kOk;
}

/// Rising numbers as Slurm writes them: `0-3,7`.
std::string ranges(const std::vector<std::size_t>& numbers) {
  std::string text;
  for (std::size_t k = 0, last = 0; k < numbers.size(); k = last + 1) {
    for (last = k; last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1;) ++last;
    text += (text.empty() ? "" : ",") + std::to_string(numbers[k]);
    if (last > k) text += "-" + std::to_string(numbers[last]);
  }
  return text;
}

std::vector<std::size_t> missing_of(const std::vector<Line>& lines, const std::string& folder) {
  std::vector<std::size_t> missing;
  for (const auto& line : lines)
    if (!std::filesystem::exists(result_path(folder, line.number))) missing.push_back(line.number);
  return missing;
}

int merge(const CampaignOptions& options) {
  const auto lines = read_commands(options.commands);
  if (const auto missing = missing_of(lines, options.folder); !missing.empty())
    throw Failure(kBadData, options.folder + ":1: lines " + ranges(missing) + " of " + options.commands +
                                " are missing; run them");
  progress("merging");
  Made made;
  std::string all;
  for (const auto& line : lines) all += rows_of(result_path(options.folder, line.number), made.of(line.words));
  const std::string path = options.folder + "/rows.jsonl";
  const auto before = files::read_file(path, kLargestResult, "merged rows");
  if (!before || *before != all) write_file(path, all, options.force);
  const auto rows = std::ranges::count(all, '\n');
  if (options.json)
    print({{"lines", lines.size()}, {"rows", rows}, {"sha256", sha256(all)}});
  else
    std::printf("%zu rows of %zu lines in %s\n", static_cast<std::size_t>(rows), lines.size(), path.c_str());
  return kOk;
}

/// Runs it here and returns the job that it prints. Throws Failure 69.
std::string job_of(const Words& command) {
  auto child = start(command, "", true);
  const std::string text = read_to_end(child);
  if (const int code = wait_for(child); code != 0)
    throw Failure(kUnavailable, command.front() + ":1: " + end_in_words(code) + "; is Slurm installed and up?");
  return text.substr(0, text.find_first_of(";\n"));  // sbatch --parsable: the job, perhaps ;cluster
}

int submit(const CampaignOptions& options) {
  const auto missing = missing_of(read_commands(options.commands), options.folder);
  if (missing.empty()) throw Failure(kUsage, options.folder + " misses no line; merge it with backwash campaign merge");
  std::filesystem::create_directories(options.folder);
  const std::string folder = std::filesystem::canonical(options.folder).string();
  std::vector<std::size_t> tasks;
  for (const auto number : missing) tasks.push_back(number % kTasks);
  std::ranges::sort(tasks);
  tasks.erase(std::ranges::unique(tasks).begin(), tasks.end());
  // Slurm's own file names take no spaces: the folder's name goes through the shell.
  const auto script = [&](const char* what, const std::string& settings, const std::string& more, const char* log) {
    return "#!/bin/sh\n#SBATCH --ntasks=1 --cpus-per-task=1 --output=/dev/null --job-name=backwash-" +
           std::string(what) + settings + "\nexec " +
           shell_line({own_program(), "campaign", what, std::filesystem::canonical(options.commands).string(), "--out",
                       folder}) +
           more + " >>" + shell_line({folder}) + "/" + log + ".log 2>&1\n";
  };
  Words first(1, "sbatch");
  first.push_back("--parsable");
  for (const auto& [name, value] :
       {std::pair{"--partition=", &options.partition}, {"--time=", &options.time}, {"--account=", &options.account}})
    if (!value->empty()) first.push_back(name + *value);
  Words second = first;
  first.push_back(folder + "/array.sh");
  const auto after = [&](const std::string& job) {
    second.insert(second.end(), {"--dependency=afterany:" + job, folder + "/merge.sh"});
    return second;
  };
  const std::string array = script("run", " --requeue --array=" + ranges(tasks), " --task \"$SLURM_ARRAY_TASK_ID\"",
                                   "task-$SLURM_ARRAY_TASK_ID"),
                    merging = script("merge", "", "", "merge");
  if (options.dry_run) {
    std::printf("%s\n%s\n%s\n%s\n", array.c_str(), merging.c_str(), shell_line(first).c_str(),
                shell_line(after("JOB")).c_str());
    return kOk;
  }
  write_file(folder + "/array.sh", array, true);
  write_file(folder + "/merge.sh", merging, true);
  const std::string job = job_of(first);
  std::printf("array %s of %zu lines, merge %s after it\n", job.c_str(), missing.size(), job_of(after(job)).c_str());
  return kOk;
}

}  // namespace

Verb campaign_verb(Command& app) {
  auto& group = app.add_subcommand("campaign", "Commands in a file, one a line: done here or by Slurm, and merged");
  group.require_subcommand();
  const auto options = std::make_shared<CampaignOptions>();
  const auto add = [&](const char* name, const char* what, const char* example) -> Command& {
    auto& command = group.add_subcommand(name, what);
    command.add_option("commands", options->commands, "file of commands that print lines of JSON").required();
    command.add_option("-o,--out", options->folder, "folder of the results").required();
    command.footer(std::string("Example:\n  backwash campaign ") + example);
    return command;
  };
  auto& running = add("run", "Does the lines whose results are not there", "run studies.txt -o studies");
  running.add_option("lines", options->lines, "of these lines alone, from 1");
  running.add_option("--task", options->task, "of the lines N, N + 1000, N + 2000 … alone: a task of Slurm's array");
  auto& submitting = add("submit", "Gives the missing lines to Slurm: an array, and a merge after it",
                         "submit studies.txt -o studies --partition day --time 20");
  submitting.add_option("--partition", options->partition, "as sbatch takes it");
  submitting.add_option("--time", options->time, "of a task and of the merge, as sbatch takes it");
  submitting.add_option("--account", options->account, "as sbatch takes it");
  submitting.add_flag("--dry-run", options->dry_run, "print what would run, and run nothing");
  auto& merging = add("merge", "All rows in the order of the lines", "merge studies.txt -o studies");
  merging.add_flag("--json", options->json, "one JSON object on stdout");
  merging.add_flag("--force", options->force, "replace other rows");
  return {&group, [options, &running, &submitting] {
            if (running.parsed()) return run(*options);
            return submitting.parsed() ? submit(*options) : merge(*options);
          }};
}

}  // namespace backwash::services
