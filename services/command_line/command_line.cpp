// SPDX-License-Identifier: BSD-3-Clause
#include "services/command_line/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <type_traits>

#include "services/command_line/exit_code.hpp"
#include "services/command_line/words.hpp"

namespace backwash::services {
namespace {

template <typename T>
struct NumberOf {
  using type = T;
};
template <typename T>
struct NumberOf<std::optional<T>> {
  using type = T;
};
template <typename T>
struct NumberOf<std::vector<T>> {
  using type = T;
};

std::string not_finite(const std::string& text) {
  double value = 0;
  if (text.empty() || !CLI::detail::lexical_cast(text, value)) return "'" + text + "' is no number; it takes one";
  return std::isfinite(value) ? "" : text + " is not finite; it takes a finite number";
}

std::string not_integer(const std::string& text) {
  int value = 0;
  const bool good = !text.empty() && CLI::detail::lexical_cast(text, value);
  return good ? "" : "'" + text + "' is no whole number; it takes one";
}

/// A file, a folder or a name: an empty one is a variable that was not set.
std::string empty_text(const std::string& text) {
  return text.empty() ? "is empty; give it a value or leave it out" : "";
}

/// A check of a number, by what holds of a good one.
template <typename Holds>
Check number_that(Holds holds, const std::string& takes, const std::string& words) {
  return {[=](const std::string& text) {
            double value = 0;
            const bool good = CLI::detail::lexical_cast(text, value) && holds(value);
            return good ? "" : "'" + text + "' is not right; it takes " + takes;
          },
          words};
}

std::string shown(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string not_unsigned(const std::string& text) {
  if (text.starts_with('-')) return "'" + text + "' is below 0; it takes 0 or more";
  std::uint64_t value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec == std::errc::result_out_of_range) return "'" + text + "' is too large; it takes at most 2^64 - 1";
  const bool good = !text.empty() && CLI::detail::lexical_cast(text, value);
  return good ? "" : "'" + text + "' is no whole number of 0 or more; it takes one";
}

/// Whether ROS 2 takes it as a name, without a / before or behind.
bool named(const std::string& text) {
  const auto fits = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '/'; };
  return !text.empty() && !std::isdigit(static_cast<unsigned char>(text[0])) && text[0] != '/' && text.back() != '/' &&
         std::ranges::all_of(text, fits);
}

}  // namespace

Check positive() {
  return number_that([](double x) { return x > 0; }, "a number above 0", "POSITIVE");
}
Check not_negative() {
  return number_that([](double x) { return x >= 0; }, "a number of 0 or more", "NONNEGATIVE");
}
Check within(double low, double high) {
  const std::string range = shown(low) + " to " + shown(high);
  return number_that([=](double x) { return x >= low && x <= high; }, "a number from " + range, range);
}
Check one_of(const std::vector<std::string>& names) {
  std::string all;
  for (const auto& name : names) all += (all.empty() ? "" : ", ") + name;
  const auto wrong = [names, all](const std::string& text) {
    return std::ranges::find(names, text) != names.end() ? "" : "'" + text + "' is not one of " + all;
  };
  return {wrong, "{" + all + "}"};
}

Check name_space() {
  const auto wrong = [](const std::string& text) {
    return named(text) ? "" : "'" + text + "' is no namespace; it takes letters, digits, _ and / between them";
  };
  return {wrong, "NAMESPACE"};
}
Check topic() {
  const auto wrong = [](const std::string& text) {
    return text.starts_with('/') && named(text.substr(1))
               ? ""
               : "'" + text + "' is no topic; it takes a / first, then letters, digits, _ and / between them";
  };
  return {wrong, "TOPIC"};
}

Option Option::required() {
  option_->required();
  return *this;
}
Option Option::check(const Check& check) {
  option_->check(check.wrong, check.words);
  return *this;
}
Option Option::capture_default_str() {
  option_->capture_default_str();
  return *this;
}
Option Option::default_str(const std::string& text) {
  option_->default_str(text);
  return *this;
}
Option Option::delimiter(char between) {
  option_->delimiter(between);
  return *this;
}
Option Option::expected(int count) {
  option_->expected(count);
  return *this;
}
Option Option::expected(int least, int most) {
  option_->expected(least, most);
  return *this;
}
Option Option::excludes(Option other) {
  option_->excludes(other.option_);
  return *this;
}
Option Option::type_name(const std::string& name) {
  option_->type_name(name);
  return *this;
}
Option Option::trigger_on_parse() {
  option_->trigger_on_parse();
  return *this;
}

Command::Command(const std::string& what, const std::string& name)
    : owned_(std::make_unique<CLI::App>(what, name)), app_(owned_.get()) {}
Command::Command(CLI::App* app) : app_(app) {}
Command::~Command() = default;

Command& Command::add_subcommand(const std::string& name, const std::string& what) {
  CLI::App* const verb = app_->add_subcommand(name, what);
  verb->preparse_callback([this, name](std::size_t) { begun_ = name; });
  subcommands_.push_back(std::unique_ptr<Command>(new Command(verb)));
  return *subcommands_.back();
}

template <typename T>
Option Command::add_option(const std::string& name, T& target, const std::string& help) {
  CLI::Option* const option = app_->add_option(name, target, help);
  using Number = typename NumberOf<T>::type;
  if constexpr (std::is_floating_point_v<Number>) option->check(not_finite, "");
  if constexpr (std::is_unsigned_v<Number>) option->check(not_unsigned, "");
  if constexpr (std::is_same_v<Number, int>) option->check(not_integer, "");
  if constexpr (std::is_same_v<Number, std::string>) option->check(empty_text, "");
  return Option(option);
}
template Option Command::add_option(const std::string&, std::string&, const std::string&);
template Option Command::add_option(const std::string&, double&, const std::string&);
template Option Command::add_option(const std::string&, int&, const std::string&);
template Option Command::add_option(const std::string&, std::uint64_t&, const std::string&);
template Option Command::add_option(const std::string&, std::uint32_t&, const std::string&);
template Option Command::add_option(const std::string&, std::optional<double>&, const std::string&);
template Option Command::add_option(const std::string&, std::optional<std::uint64_t>&, const std::string&);
template Option Command::add_option(const std::string&, std::vector<std::string>&, const std::string&);
template Option Command::add_option(const std::string&, std::vector<double>&, const std::string&);
template Option Command::add_option(const std::string&, std::vector<int>&, const std::string&);

Option Command::add_text(const std::string& name, const std::function<void(const std::string&)>& take,
                         const std::string& help) {
  return Option(app_->add_option_function<std::string>(name, take, help));
}

Option Command::add_texts(const std::string& name, const std::function<void(const std::vector<std::string>&)>& take,
                          const std::string& help) {
  return Option(app_->add_option_function<std::vector<std::string>>(name, take, help));
}

void Command::add_flag(const std::string& name, bool& target, const std::string& help) {
  app_->add_flag(name, target, help)->disable_flag_override();
}
void Command::version(const std::string& text) { app_->set_version_flag("--version", app_->get_name() + " " + text); }
void Command::footer(const std::string& text) { app_->footer(text); }
void Command::require_subcommand() { app_->require_subcommand(1); }
void Command::fallthrough() { app_->fallthrough(); }
void Command::on_parsed(std::function<void()> then) { app_->callback(std::move(then)); }
void Command::on_complete(std::function<void()> then) { app_->parse_complete_callback(std::move(then)); }
bool Command::parsed() const { return app_->parsed(); }
std::string Command::name() const { return app_->get_name(); }
void Command::each_verb(const std::function<void(Command&)>& with) {
  if (subcommands_.empty()) with(*this);
  for (const auto& verb : subcommands_) verb->each_verb(with);
}

const Command* Command::begun() const {
  for (const auto& verb : subcommands_)
    if (verb->name() == begun_) return verb.get();
  return nullptr;
}

std::string Command::line() const { return name() + (begun() ? " " + begun()->line() : ""); }

void Command::refuse(const std::string& what) const { throw UsageError(what + "; see " + line() + " --help"); }

/// What to say where none of the verbs was begun.
std::string Command::no_verb() const {
  if (begun()) return begun()->no_verb();
  const std::vector<std::string> rest = app_->remaining();
  std::vector<std::string> names;
  for (const auto& verb : subcommands_) names.push_back(verb->name());
  std::string said = "a verb is needed";
  if (!rest.empty() && rest.front().starts_with('-')) said += " before '" + rest.front() + "'";
  if (!rest.empty() && !rest.front().starts_with('-')) {
    const std::string meant = nearest(rest.front(), names);
    said = "no verb '" + rest.front() + "'" + (meant.empty() ? "" : ", did you mean '" + meant + "'?");
  }
  for (std::size_t i = 0; i < names.size(); ++i) said += (i == 0 ? ": one of " : ", ") + names[i];
  return said;
}

/// What to say of the first argument that neither this command nor the verb in the line takes; empty: each is taken.
std::string Command::not_taken() const {
  const std::vector<std::string> rest = app_->remaining(true);
  if (rest.empty()) return "";
  const std::string& first = rest.front();
  if (!first.starts_with('-') || first.find_first_not_of("-.0123456789") == first.npos)
    return "'" + first + "' is not expected here";
  const std::string said = first.substr(0, first.find('='));
  std::vector<std::string> names;
  for (const Command* at = this; at; at = at->begun())
    for (const auto* option : at->app_->get_options())
      for (const auto& name : option->get_lnames()) names.push_back("--" + name);
  const std::string meant = nearest(said, names);
  return "there is no option '" + said + "'" + (meant.empty() ? "" : ", did you mean " + meant + "?");
}

void Command::take(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::Success& help_or_version) {
    throw;
  } catch (const CLI::ParseError& wrong) {
    if (std::string_view(wrong.what()) == "A subcommand is required") refuse(no_verb());
    // An argument that nobody takes is told before what is missing: it may be that, misspelt.
    const bool misspelt = dynamic_cast<const CLI::RequiredError*>(&wrong) ||
                          dynamic_cast<const CLI::ExtrasError*>(&wrong) ||
                          dynamic_cast<const CLI::ArgumentMismatch*>(&wrong);
    const std::string unknown = misspelt ? not_taken() : "";
    refuse(unknown.empty() ? in_plain_words(wrong.what()) : unknown);
  } catch (const UsageError& wrong) {
    refuse(wrong.what());
  }
}

std::optional<int> Command::parse(int argc, const char* const* argv) {
  try {
    take(argc, argv);
    return std::nullopt;
  } catch (const CLI::Success& help_or_version) {
    return finished(app_->exit(help_or_version), name());
  } catch (const UsageError& wrong) {
    say_error(line(), wrong.what());
    return kUsage;
  }
}

void Command::read(int argc, const char* const* argv) {
  try {
    take(argc, argv);
  } catch (const CLI::Success& help_or_version) {
    refuse("--help and --version are no question");
  }
}

int finished(int code, const std::string& program) {
  std::cout.flush();
  if (std::cout.good() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  say_error(program, "standard output cannot be written to its end; free some space");
  return code == 0 ? kInputOutput : code;
}

}  // namespace backwash::services
