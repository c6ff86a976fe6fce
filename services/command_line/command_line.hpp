// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// CLI11 behind one unit: a unit that sees its header compiles 100 kB of it.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace backwash::services {

/// The exit code of a program that would end with `code`: 74, told on stderr, where all was good but what it wrote to
/// standard output did not arrive.
int finished(int code, const std::string& program);

/// Thrown by an option's function: the text is no value for it. The message names the option.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What an option's value must be, and the words in which --help says so.
struct Check {
  std::function<std::string(const std::string&)> wrong;  ///< empty where the text is good
  std::string words;
};
Check positive();
Check not_negative();
Check within(double low, double high);
Check one_of(const std::vector<std::string>& names);
Check name_space();  ///< of DDS topics, as ROS 2 writes one
Check topic();       ///< by its whole name, as ROS 2 writes one: /goal_pose

/// An option of a command; a handle to copy. The names of its settings are CLI11's.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}
  Option required();
  Option check(const Check& check);
  Option capture_default_str();  ///< --help prints the value that the target has now
  Option default_str(const std::string& text);
  Option delimiter(char between);
  Option expected(int count);
  Option expected(int least, int most);
  Option excludes(Option other);
  Option type_name(const std::string& name);
  Option trigger_on_parse();  ///< its function runs where it stands in the line, not after the whole line

 private:
  CLI::Option* option_;
};

/// A program's command line, or one of its verbs. Numbers are finite, and those without a sign are not negative.
class Command {
 public:
  /// `name` as usage errors and --version give it.
  Command(const std::string& what, const std::string& name);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  Command& add_subcommand(const std::string& name, const std::string& what);
  /// T: std::string, double, int, std::uint64_t, std::uint32_t, a std::vector of the first three or a std::optional of
  /// a number.
  template <typename T>
  Option add_option(const std::string& name, T& target, const std::string& help = "");
  Option add_text(const std::string& name, const std::function<void(const std::string&)>& take,
                  const std::string& help);
  Option add_texts(const std::string& name, const std::function<void(const std::vector<std::string>&)>& take,
                   const std::string& help);
  void add_flag(const std::string& name, bool& target, const std::string& help);
  void version(const std::string& text);  ///< --version prints it
  void footer(const std::string& text);
  void require_subcommand();
  void fallthrough();                            ///< verbs take their program's options too
  void on_parsed(std::function<void()> then);    ///< once the whole line is read
  void on_complete(std::function<void()> then);  ///< once this verb's own options are read

  bool parsed() const;
  std::string name() const;
  std::string line() const;  ///< its name and those of the verbs that the line names below it
  /// Calls `with` for itself, or for each of the verbs below it that have none of their own.
  void each_verb(const std::function<void(Command&)>& with);
  /// Without a value the program goes on. Otherwise it ends with it: 0 after --help and --version, 64 after a usage
  /// error, told on stderr as `PROGRAM VERB: what; see PROGRAM VERB --help`.
  std::optional<int> parse(int argc, const char* const* argv);
  /// The same without a word on stderr. Throws UsageError, `what; see PROGRAM VERB --help`, also where the line asks
  /// for
  /// --help or --version.
  void read(int argc, const char* const* argv);

 private:
  explicit Command(CLI::App* app);
  [[noreturn]] void refuse(const std::string& what) const;
  void take(int argc, const char* const* argv);
  const Command* begun() const;  ///< the verb below it that the line names; null: none
  std::string no_verb() const;
  std::string not_taken() const;

  std::unique_ptr<CLI::App> owned_;
  CLI::App* app_;
  std::vector<std::unique_ptr<Command>> subcommands_;
  std::string begun_;
};

/// Adds an option that takes one of some names, each of which stands for a value; anything else is a usage error.
template <typename Target, typename Value>
Option add_choice(Command& command, const std::string& name, Target& target,
                  const std::vector<std::pair<std::string, Value>>& choices, const std::string& help) {
  std::vector<std::string> names;
  names.reserve(choices.size());
  for (const auto& choice : choices) names.push_back(choice.first);
  const auto take = [&target, choices](const std::string& said) {
    for (const auto& [known, value] : choices)
      if (known == said) target = value;
  };
  return command.add_text(name, take, help).check(one_of(names));
}

}  // namespace backwash::services
