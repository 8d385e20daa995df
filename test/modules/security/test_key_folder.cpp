#include "modules/security/key_file.hpp"
#include "modules/security/key_folder.hpp"
#include "modules/security/team_folder.hpp"
#include "test/modules/security/toy_team.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// A team of two on disk.
struct TeamOnDisk {
  TeamOnDisk() {
    TeamFolder::make(folder.path() / "survey", {{3, "alpha"}, {65535, "beta"}}, kToyNow_s,
                     kToyNow_s + 86400);
  }

  [[nodiscard]] fs::path alpha() const { return folder.path() / "survey" / "alpha"; }

  // Replaces a part of a file of alpha's, keeping its mode.
  void replace(const std::string& file, const std::string& part, const std::string& by) const {
    std::string text = folder.read("survey/alpha/" + file);
    const std::size_t at = text.find(part);
    REQUIRE(at != std::string::npos);
    folder.write("survey/alpha/" + file, text.replace(at, part.size(), by));
  }

  [[nodiscard]] std::string refusal() const {
    try {
      (void)load_robot_keys(alpha());
      return {};
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  TemporaryFolder folder;
};

TEST_CASE("A secret that other users may read is refused") {
  const TeamOnDisk team;
  const auto secret = team.alpha() / "secret_key.txt";
  CHECK(fs::status(secret).permissions() == (fs::perms::owner_read | fs::perms::owner_write));
  CHECK(fs::status(team.alpha()).permissions() == fs::perms::owner_all);
  const fs::perms others = GENERATE(fs::perms::group_read, fs::perms::others_read,
                                    fs::perms::group_write, fs::perms::others_write);
  fs::permissions(secret, others, fs::perm_options::add);
  CHECK_THAT(team.refusal(), Contains(secret.string()) && Contains("other users can read") &&
                                 Contains("chmod 600"));
  fs::permissions(secret, others, fs::perm_options::remove);
  CHECK(team.refusal().empty());
}

TEST_CASE("A changed file is refused with its name and line") {
  struct Change {
    const char *file, *part, *by, *refusal;
  };
  const auto [file, part, by, refusal] = GENERATE(values<Change>({
      {"certificate.txt", "robot: 3", "robot: 4",
       "certificate.txt: is not signed by the authority"},
      {"certificate.txt", "robot: 3", "robot: 65536",
       "certificate.txt, line 4: robot \"65536\" is not a number"},
      {"certificate.txt", "valid_from: 2027-01-", "valid_from: 2027-13-",
       "certificate.txt, line 7: valid_from \"2027-13-"},
      {"certificate.txt", "name: alpha\n", "", "line 5: has \"public_key\" instead of \"name\""},
      {"authority.txt", "team:", "public: 1\nteam:", "line 3: has \"public\" instead of \"team\""},
      {"certificate.txt", "certificate 1", "certificate 2",
       "line 2: format \"kimera_multi certificate 2\""},
      {"revocations.txt", "number: 0", "number 0",
       "revocations.txt, line 3: has no \"name: value\""},
      {"revocations.txt", "number: 0", "number: 1", "revocations.txt: is not signed"},
  }));
  CAPTURE(file, part, by);
  const TeamOnDisk team;
  REQUIRE(team.refusal().empty());
  team.replace(file, part, by);
  CHECK_THAT(team.refusal(), Contains(refusal));
}

TEST_CASE("The last line of a file of keys may lack its end") {
  const TeamOnDisk team;
  const std::string text = team.folder.read("survey/alpha/authority.txt");
  team.folder.write("survey/alpha/authority.txt", text.substr(0, text.size() - 1));
  CHECK(team.refusal().empty());
}

TEST_CASE("A wrong or incomplete file of keys is refused") {
  const TeamOnDisk team;
  SECTION("something behind its end") {
    team.folder.write("survey/alpha/authority.txt",
                      team.folder.read("survey/alpha/authority.txt") + "more: 1\n");
    CHECK_THAT(team.refusal(), Contains("line 5: \"more\" is not expected"));
  }
  SECTION("another robot's secret") {
    fs::copy_file(team.folder.path() / "survey/beta/secret_key.txt",
                  team.alpha() / "secret_key.txt", fs::copy_options::overwrite_existing);
    CHECK_THAT(team.refusal(), Contains("is not the secret of certificate.txt"));
  }
  SECTION("half a secret, which is not printed") {
    const std::string text = team.folder.read("survey/alpha/secret_key.txt");
    const std::string half = text.substr(text.find("secret_key: ") + 12, 32);
    team.folder.write("survey/alpha/secret_key.txt", text.substr(0, text.size() - 33) + "\n");
    CHECK_THAT(team.refusal(), Contains("64 hexadecimal digits") && !Contains(half));
  }
  SECTION("no file") {
    fs::remove(team.alpha() / "revocations.txt");
    CHECK_THAT(team.refusal(),
               Contains("revocations.txt: no such file") && Contains("kimera_multi_keys"));
  }
}

constexpr std::int64_t kEnd_s = kToyNow_s + 86400;

TEST_CASE("The authority's secret is in no robot's folder") {
  const TemporaryFolder folder;
  TeamFolder::make(folder.path() / "survey", {{0, "alpha"}}, kToyNow_s, kEnd_s);
  const std::string text = folder.read("survey/authority/secret_key.txt");
  const std::string secret = text.substr(text.find("secret_key: ") + 12, 64);
  for (const auto& entry : fs::directory_iterator(folder.path() / "survey" / "alpha"))
    CHECK(folder.read("survey/alpha/" + entry.path().filename().string()).find(secret) ==
          std::string::npos);
}

TEST_CASE("Conflicting names and ids are refused before anything is written") {
  const TemporaryFolder folder;
  const fs::path survey = folder.path() / "survey";
  using Robots = std::vector<RobotName>;
  const Robots robots =
      GENERATE(Robots{{0, "alpha"}, {0, "beta"}}, Robots{{0, "alpha"}, {1, "alpha"}},
               Robots{{0, "authority"}}, Robots{{0, "../alpha"}}, Robots{{0, ""}});
  CHECK_THROWS_AS(TeamFolder::make(survey, robots, kToyNow_s, kEnd_s), std::runtime_error);
  CHECK_FALSE(fs::exists(survey));
}

TEST_CASE("A robot gets new keys after the former have lapsed") {
  const TemporaryFolder folder;
  const fs::path survey = folder.path() / "survey";
  TeamFolder team = TeamFolder::make(survey, {{0, "alpha"}}, kToyNow_s, kEnd_s);
  const PublicKey former = team.issued()[0].key;
  CHECK_THROWS_WITH(team.issue({{0, "alpha"}}, kToyNow_s, kEnd_s), Contains("revoke it first"));
  CHECK_THROWS_WITH(team.issue({{0, "other"}}, kToyNow_s, kEnd_s), Contains("revoke it first"));
  CHECK_THROWS_WITH(team.issue({{5, "alpha"}}, kToyNow_s, kEnd_s), Contains("revoke it first"));
  std::int64_t now_s = kToyNow_s;
  SECTION("revoked") {
    team.revoke("alpha");
  }
  SECTION("expired") {
    now_s = kEnd_s + 1;
  }
  REQUIRE_NOTHROW(team.issue({{0, "alpha"}}, now_s, now_s + 86400));
  const RobotKeys keys = load_robot_keys(survey / "alpha");
  CHECK(keys.certificate.key != former);
  CHECK(why_refused(keys.certificate, keys.authority, keys.revocations, now_s) == nullptr);
  CHECK(TeamFolder(survey).issued().size() == 2);
}

TEST_CASE("A revocation reaches the existing folders and increases the number of the list") {
  const TemporaryFolder folder;
  const fs::path survey = folder.path() / "survey";
  TeamFolder team =
      TeamFolder::make(survey, {{0, "alpha"}, {1, "beta"}, {2, "gamma"}}, kToyNow_s, kEnd_s);
  fs::remove_all(survey / "beta");  // the folder is on the robot
  const auto revoked = team.revoke("1");
  REQUIRE(revoked.size() == 1);
  CHECK(revoked[0].name == "beta");
  CHECK(load_revocations(survey / "alpha").number == 1);
  CHECK(load_revocations(survey / "alpha").revoked == revoked);
  CHECK_FALSE(fs::exists(survey / "beta"));
  CHECK_THROWS_WITH(team.revoke("beta"), Contains("is revoked already"));
  CHECK_THROWS_WITH(team.revoke("delta"), Contains("never had"));
  TeamFolder(survey).revoke("gamma");
  CHECK(TeamFolder(survey).revocations().number == 2);
  CHECK(load_revocations(survey / "alpha").revoked.size() == 2);
}

TEST_CASE("A robot to revoke is looked up by name before id") {
  const TemporaryFolder folder;
  TeamFolder team =
      TeamFolder::make(folder.path() / "survey", {{0, "7"}, {7, "alpha"}}, kToyNow_s, kEnd_s);
  const auto revoked = team.revoke("7");
  REQUIRE(revoked.size() == 1);
  CHECK(revoked[0].robot == 0);
}

}  // namespace
}  // namespace km
