// SPDX-License-Identifier: BSD-3-Clause
#include "services/security/credentials.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/security/authority.hpp"

namespace backwash::security {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kDay = 86400;

std::string text_of(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// A folder of credentials as `backwash keys` makes one, in which one thing at a time is changed.
class CredentialsTest : public testing::Test {
 protected:
  CredentialsTest() {
    make(folder_, authority_, "drone", {now_ - kDay, now_ + kDay});
    other_folder_ = folder_ + "-other";
    make(other_folder_, authority_, "other", {now_ - kDay, now_ + kDay});
  }
  ~CredentialsTest() override {
    fs::remove_all(folder_);
    fs::remove_all(other_folder_);
  }

  static Authority authority() {
    const std::int64_t now = std::time(nullptr);
    return Authority::of(Authority::make("test", {now - kDay, now + 2 * kDay})).value();
  }
  static void put(const std::string& folder, const char* name, const std::string& text) {
    const std::string path = folder + "/" + name;
    fs::remove(path);
    std::ofstream(path) << text;
    ::chmod(path.c_str(), 0600);
  }
  static void make(const std::string& folder, const Authority& by, const std::string& name, const Validity& validity,
                   Role role = Role::vehicle) {
    fs::create_directories(folder);
    const Pair pair = by.issue(name, role, validity);
    put(folder, kKey, pair.key);
    put(folder, kCertificate, pair.certificate);
    put(folder, kIdentityCa, by.certificate());
    put(folder, kPermissionsCa, by.certificate());
    put(folder, kPermissions, by.permissions(name, pair.certificate, {role, "backwash", {}}));
    put(folder, kGovernance, by.governance(Protection::encrypt));
    put(folder, kRevoked, by.revoke("", {}));
  }
  /// Why the folder is refused; empty if it is good.
  std::string refusal() const {
    const auto credentials = read_credentials(folder_);
    return credentials ? "" : credentials.error();
  }
  void expect_refused(const char* file, const std::string& why) const {
    const std::string said = refusal();
    EXPECT_TRUE(said.starts_with(folder_ + "/" + file + ": ")) << said;
    EXPECT_NE(said.find(why), said.npos) << said;
    EXPECT_EQ(said.find("PRIVATE KEY"), said.npos);
  }
  void take(const char* file) { put(folder_, file, text_of(other_folder_ + "/" + file)); }

  const std::int64_t now_ = std::time(nullptr);
  const Authority authority_ = authority();
  const std::string folder_ = testing::TempDir() + "credentials-" + std::to_string(::getpid());
  std::string other_folder_;
};

TEST_F(CredentialsTest, AreGoodAsTheyAreMadeForEveryRole) {
  for (const Role role : kRoles) {
    make(folder_, authority_, "drone", {now_ - kDay, now_ + kDay}, role);
    const auto credentials = read_credentials(folder_);
    ASSERT_TRUE(credentials) << credentials.error();
    EXPECT_EQ(credentials->subject, std::string("CN=drone,OU=") + name(role));
    EXPECT_EQ(credentials->ends, now_ + kDay);
  }
}

TEST_F(CredentialsTest, AreRefusedByTheNameOfTheFileThatIsMissingOrIsNone) {
  for (const char* file : {kKey, kCertificate, kIdentityCa, kPermissionsCa, kPermissions, kGovernance}) {
    const std::string good = text_of(folder_ + "/" + file);
    fs::remove(folder_ + "/" + file);
    expect_refused(file, "cannot be opened: No such file");
    put(folder_, file, "nothing of the kind\n");
    expect_refused(file, "");
    put(folder_, file, good);
    EXPECT_EQ(refusal(), "");
  }
  put(folder_, kRevoked, "nothing of the kind\n");
  expect_refused(kRevoked, "list of revoked certificates");
  fs::remove(folder_ + "/" + kRevoked);
  EXPECT_EQ(refusal(), "") << "without a list nobody is revoked";
}

TEST_F(CredentialsTest, NeedAKeyThatNobodyElseMayRead) {
  for (const mode_t mode : {0640, 0604, 0700, 0660}) {
    ::chmod((folder_ + "/" + kKey).c_str(), mode);
    expect_refused(kKey, "needs 0600");
  }
  ::chmod((folder_ + "/" + kKey).c_str(), 0400);
  EXPECT_EQ(refusal(), "");
}

TEST_F(CredentialsTest, NeedWhatBelongsTogether) {
  take(kKey);
  expect_refused(kCertificate, "is of another key");
  take(kCertificate);
  expect_refused(kPermissions, "grants nothing to CN=other,OU=vehicle");
  take(kPermissions);
  EXPECT_EQ(refusal(), "");
}

TEST_F(CredentialsTest, NeedTheSameAuthorityThroughout) {
  const Authority stranger = authority();
  make(other_folder_, stranger, "drone", {now_ - kDay, now_ + kDay});
  const std::string ours = text_of(folder_ + "/" + kPermissionsCa);
  take(kPermissionsCa);
  expect_refused(kGovernance, "is not signed by");
  put(folder_, kPermissionsCa, ours);
  take(kPermissions);
  expect_refused(kPermissions, "is not signed by");
  take(kIdentityCa);
  expect_refused(kRevoked, "is not signed by");
  take(kRevoked);
  expect_refused(kCertificate, "");
}

TEST_F(CredentialsTest, CountWhileTheyLastAndAreNotRevoked) {
  make(folder_, authority_, "drone", {now_ - 2 * kDay, now_ - 1});
  expect_refused(kCertificate, "certificate has expired");
  make(folder_, authority_, "drone", {now_ + 3600, now_ + kDay});
  expect_refused(kCertificate, "not yet valid");
  make(folder_, authority_, "drone", {now_ - kDay, now_ + kDay});
  const std::string certificates[] = {text_of(folder_ + "/" + kCertificate)};
  const std::string others[] = {text_of(other_folder_ + "/" + kCertificate)};
  const std::string revoked = authority_.revoke(text_of(folder_ + "/" + kRevoked), others);
  put(folder_, kRevoked, revoked);
  EXPECT_EQ(refusal(), "") << "another's certificate is revoked";
  put(folder_, kRevoked, authority_.revoke(revoked, certificates));
  expect_refused(kCertificate, "certificate revoked");
  put(folder_, kRevoked, authority_.revoke(authority_.revoke(revoked, certificates), others));
  expect_refused(kCertificate, "certificate revoked");
}

TEST_F(CredentialsTest, AreRefusedWhenALetterOfASignedDocumentIsAnother) {
  for (const char* file : {kPermissions, kGovernance}) {
    const std::string good = text_of(folder_ + "/" + file);
    const std::size_t first = good.find("<dds"), last = good.find("</dds>");
    for (std::size_t at = first; at < last; at += 37) {
      std::string changed = good;
      changed[at] = changed[at] == 'x' ? 'y' : 'x';
      put(folder_, file, changed);
      expect_refused(file, "is not signed by");
    }
    put(folder_, file, good);
  }
}

}  // namespace
}  // namespace backwash::security
