// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/files/read_file.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/private_file.hpp"
#include "services/backwash/verb.hpp"
#include "services/security/authority.hpp"

namespace backwash::services {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAuthority = "authority";  // its key and certificate, in a folder that no vehicle gets
constexpr std::int64_t kDay_s = 86400, kYear_s = 365 * kDay_s;
constexpr const char* kDate = "%Y-%m-%dT%H:%M:%SZ";

struct KeysOptions {
  std::string folder, name;
  security::Protection protection = security::Protection::encrypt;
  security::Grant grant;
  std::optional<std::int64_t> until;
  bool force = false, json = false;
};

std::string path(const KeysOptions& o, const std::string& folder, const char* file) {
  return o.folder + "/" + (folder.empty() ? "" : folder + "/") + file;
}

std::string read(const std::string& file) {
  const auto text = files::read_file(file, files::kLargestConfiguration, "a file of backwash keys");
  if (!text) throw Failure(kNoInput, file + ":1: " + text.error().message + "; backwash keys init makes the folder");
  return *text;
}

std::string date_of(std::int64_t s) {
  const std::time_t time = s;
  std::tm parts{};
  ::gmtime_r(&time, &parts);
  std::array<char, 32> text;
  return {text.data(), std::strftime(text.data(), text.size(), kDate, &parts)};
}

std::int64_t time_of(const std::string& text) {
  const std::string whole = text.size() == 10 ? text + "T00:00:00Z" : text;
  std::tm parts{};
  const char* end = ::strptime(whole.c_str(), kDate, &parts);
  const std::int64_t s = end && *end == 0 ? std::int64_t{::timegm(&parts)} : 0;
  if (s == 0 || date_of(s) != whole)  // a 30th of February is none
    throw UsageError("--until: '" + text + "' is no time of UTC as 2027-01-31 or 2027-01-31T18:00:00Z");
  return s;
}

/// From a day ago, for computers whose clocks differ, to the end that is asked for.
security::Validity validity(const KeysOptions& o, std::int64_t usual) {
  const std::int64_t now = std::time(nullptr), until = o.until.value_or(usual);
  if (until <= now) throw Failure(kUsage, "--until " + date_of(until) + " has passed; it is " + date_of(now));
  return {now - kDay_s, until};
}

/// The name of a folder and of its holder, in documents that are signed.
void check_name(const std::string& name) {
  constexpr std::size_t kLongest = 64;  // of a common name (X.520)
  const bool letters =
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-") == name.npos;
  if (name.empty() || !letters || name.size() > kLongest || name[0] == '.' || name[0] == '-' || name == kAuthority)
    throw Failure(kUsage, "'" + name + "' is no name; it takes up to 64 letters, digits, . _ and -, not 'authority'");
}

security::Authority authority_of(const KeysOptions& o) {
  const std::string key = path(o, kAuthority, security::kKey);
  auto authority = security::Authority::of({read(key), read(path(o, kAuthority, security::kCertificate))});
  if (!authority) throw Failure(kBadData, key + ":1: is not the key of cert.pem next to it; restore both");
  return *authority;
}

/// One that is there stays as it is.
void make_folder(const std::string& folder) {
  std::error_code wrong;
  if (fs::create_directories(folder, wrong)) fs::permissions(folder, fs::perms::owner_all, wrong);
  if (wrong) throw Failure(kCannotCreate, folder + ":1: cannot be made: " + wrong.message());
}

int init(const KeysOptions& o) {
  const std::int64_t now = std::time(nullptr);
  const auto pair = security::Authority::make("backwash", validity(o, now + 10 * kYear_s));
  const auto authority = security::Authority::of(pair).value();
  make_folder(o.folder);
  make_folder(o.folder + "/" + kAuthority);
  check_output(path(o, kAuthority, security::kKey), o.force);
  write_private(path(o, kAuthority, security::kKey), pair.key, o.force);
  write_file(path(o, kAuthority, security::kCertificate), pair.certificate, true);
  write_file(path(o, "", security::kGovernance), authority.governance(o.protection), true);
  write_file(path(o, "", security::kRevoked), authority.revoke("", {}), true);
  std::printf("%s: an authority until %s; keep %s/%s away from every network\n", o.folder.c_str(),
              date_of(authority.ends()).c_str(), o.folder.c_str(), kAuthority);
  return kOk;
}

int add(const KeysOptions& o) {
  check_name(o.name);
  const auto authority = authority_of(o);
  const std::int64_t now = std::time(nullptr);
  const auto valid = validity(o, std::min(now + kYear_s, authority.ends()));
  if (valid.until > authority.ends())
    throw Failure(kUsage, "--until is after the authority's own end, " + date_of(authority.ends()));
  const std::string key = path(o, o.name, security::kKey);
  make_folder(o.folder + "/" + o.name);
  check_output(key, o.force);
  const auto pair = authority.issue(o.name, o.grant.role, valid);
  write_private(key, pair.key, o.force);
  const std::pair<const char*, std::string> others[] = {
      {security::kCertificate, pair.certificate},
      {security::kIdentityCa, authority.certificate()},
      {security::kPermissionsCa, authority.certificate()},
      {security::kPermissions, authority.permissions(o.name, pair.certificate, o.grant)},
      {security::kGovernance, read(path(o, "", security::kGovernance))},
      {security::kRevoked, read(path(o, "", security::kRevoked))}};
  for (const auto& [file, text] : others) write_file(path(o, o.name, file), text, true);
  std::printf("%s/%s: %s until %s\n", o.folder.c_str(), o.name.c_str(), security::name(o.grant.role),
              date_of(valid.until).c_str());
  return kOk;
}

/// Folders of holders, by name.
std::vector<std::string> holders(const KeysOptions& o) {
  std::vector<std::string> names;
  std::error_code wrong;
  for (const auto& entry : fs::directory_iterator(o.folder, wrong)) {
    const std::string name = entry.path().filename().string();
    if (name != kAuthority && fs::is_regular_file(entry.path() / security::kCertificate, wrong)) names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

int revoke(const KeysOptions& o) {
  check_name(o.name);
  const std::string certificate = read(path(o, o.name, security::kCertificate));
  const std::string list = path(o, "", security::kRevoked);
  const std::string revoked = authority_of(o).revoke(read(list), {&certificate, 1});
  write_file(list, revoked, true);
  for (const auto& name : holders(o)) write_file(path(o, name, security::kRevoked), revoked, true);
  std::printf("%s is revoked: copy %s to every vehicle and station, and restart what runs there\n", o.name.c_str(),
              list.c_str());
  return kOk;
}

int list(const KeysOptions& o) {
  const std::string revoked = read(path(o, "", security::kRevoked));
  Json holders_json = Json::array();
  for (const auto& name : holders(o)) {
    const auto holder = security::issued(read(path(o, name, security::kCertificate)), revoked);
    if (!holder) throw Failure(kBadData, path(o, name, security::kCertificate) + ":1: is no certificate in PEM");
    const bool expired = holder->ends <= std::time(nullptr);
    holders_json.push_back({{"name", name},
                            {"role", holder->role},
                            {"ends", date_of(holder->ends)},
                            {"revoked", holder->revoked},
                            {"expired", expired}});
    if (!o.json)
      std::printf("%-20s %-10s until %s%s\n", name.c_str(), holder->role.c_str(), date_of(holder->ends).c_str(),
                  holder->revoked ? " revoked"
                  : expired       ? " expired"
                                  : "");
  }
  if (o.json) print(Json{{"holders", holders_json}});
  return kOk;
}

Command& add_way(Command& group, const std::shared_ptr<KeysOptions>& o, const char* name, const char* what) {
  auto& command = group.add_subcommand(name, what);
  command.add_option("folder", o->folder, "of the authority and of all that it signed").required();
  return command;
}

void add_making(Command& command, const std::shared_ptr<KeysOptions>& o, const char* until) {
  command
      .add_text(
          "--until", [o](const std::string& text) { o->until = time_of(text); }, until)
      .type_name("TIME");
  command.add_flag("--force", o->force, "replace a key that is there");
}

Command& add_adding(Command& group, const std::shared_ptr<KeysOptions>& o) {
  auto& command = add_way(group, o, "add", "A key, a certificate and permissions for one process");
  command.add_option("name", o->name, "of the holder: the folder to make").required();
  std::vector<std::pair<std::string, security::Role>> roles;
  for (const auto role : security::kRoles) roles.emplace_back(security::name(role), role);
  add_choice(command, "--role", o->grant.role, roles, "what it may write: an observer nothing").required();
  o->grant.name_space = "backwash";
  command.add_option("--namespace", o->grant.name_space, "of the vehicle that it is about")
      .capture_default_str()
      .check(name_space());
  command
      .add_text(
          "--topic", [o](const std::string& topic) { o->grant.topics.push_back(topic); },
          "another topic that it may write, whole name on the wire; may be given again")
      .check(name_space())
      .type_name("TOPIC")
      .trigger_on_parse();
  add_making(command, o, "end of its certificate, UTC; default a year from now");
  command.footer("Example:\n  backwash keys add keys drone --role vehicle");
  return command;
}

}  // namespace

Verb keys_verb(Command& app) {
  auto& group = app.add_subcommand("keys", "Who may speak: keys and permissions of DDS Security");
  group.require_subcommand();
  const auto o = std::make_shared<KeysOptions>();
  auto& init_command = add_way(group, o, "init", "An authority in a new folder");
  add_choice(init_command, "--protect", o->protection,
             std::vector<std::pair<std::string, security::Protection>>{{"encrypt", security::Protection::encrypt},
                                                                       {"sign", security::Protection::sign}},
             "encrypt and sign what is sent, or sign alone")
      .default_str("encrypt");
  add_making(init_command, o, "end of the authority, UTC; default ten years from now");
  init_command.footer("Example:\n  backwash keys init keys");
  auto& add_command = add_adding(group, o);
  auto& revoke_command = add_way(group, o, "revoke", "Whom nobody listens to any more");
  revoke_command.add_option("name", o->name, "of the holder").required();
  auto& list_command = add_way(group, o, "list", "Holders, roles, ends");
  list_command.add_flag("--json", o->json, "one JSON object on stdout");
  const std::vector<std::pair<Command*, int (*)(const KeysOptions&)>> ways = {
      {&init_command, init}, {&add_command, add}, {&revoke_command, revoke}, {&list_command, list}};
  return {&group, [o, ways] {
            for (const auto& [command, run] : ways)
              if (command->parsed()) return run(*o);
            return static_cast<int>(kUsage);
          }};
}

}  // namespace backwash::services
