#include <catch2/catch.hpp>

#include <filesystem>

#include "modules/security/key_folder.hpp"
#include "modules/security/team_folder.hpp"
#include "test/modules/security/toy_team.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kEnd_s = kToyNow_s + 86400;

TEST_CASE("The authority's secret is in no robot's folder", "[security]") {
  const TemporaryFolder folder;
  TeamFolder::make(folder.path() / "survey", {{0, "alpha"}}, kToyNow_s, kEnd_s);
  const std::string text = folder.read("survey/authority/secret_key.txt");
  const std::string secret = text.substr(text.find("secret_key: ") + 12, 64);
  for (const auto& entry : fs::directory_iterator(folder.path() / "survey" / "alpha"))
    CHECK(folder.read("survey/alpha/" + entry.path().filename().string()).find(secret) ==
          std::string::npos);
}

TEST_CASE("Conflicting names and ids are refused before anything is written", "[security]") {
  const TemporaryFolder folder;
  const fs::path survey = folder.path() / "survey";
  using Robots = std::vector<RobotName>;
  const Robots robots =
      GENERATE(Robots{{0, "alpha"}, {0, "beta"}}, Robots{{0, "alpha"}, {1, "alpha"}},
               Robots{{0, "authority"}}, Robots{{0, "../alpha"}}, Robots{{0, ""}});
  CHECK_THROWS_AS(TeamFolder::make(survey, robots, kToyNow_s, kEnd_s), std::runtime_error);
  CHECK_FALSE(fs::exists(survey));
}

TEST_CASE("A robot gets new keys after the former have lapsed", "[security]") {
  const TemporaryFolder folder;
  const fs::path survey = folder.path() / "survey";
  TeamFolder team = TeamFolder::make(survey, {{0, "alpha"}}, kToyNow_s, kEnd_s);
  const PublicKey former = team.issued()[0].key;
  CHECK_THROWS_WITH(team.issue({{0, "alpha"}}, kToyNow_s, kEnd_s),
                    Catch::Contains("revoke it first"));
  CHECK_THROWS_WITH(team.issue({{0, "other"}}, kToyNow_s, kEnd_s),
                    Catch::Contains("revoke it first"));
  CHECK_THROWS_WITH(team.issue({{5, "alpha"}}, kToyNow_s, kEnd_s),
                    Catch::Contains("revoke it first"));
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

TEST_CASE("A revocation reaches the existing folders and increases the number of the list",
          "[security]") {
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
  CHECK_THROWS_WITH(team.revoke("beta"), Catch::Contains("is revoked already"));
  CHECK_THROWS_WITH(team.revoke("delta"), Catch::Contains("never had"));
  TeamFolder(survey).revoke("gamma");
  CHECK(TeamFolder(survey).revocations().number == 2);
  CHECK(load_revocations(survey / "alpha").revoked.size() == 2);
}

TEST_CASE("A robot to revoke is looked up by name before id", "[security]") {
  const TemporaryFolder folder;
  TeamFolder team =
      TeamFolder::make(folder.path() / "survey", {{0, "7"}, {7, "alpha"}}, kToyNow_s, kEnd_s);
  const auto revoked = team.revoke("7");
  REQUIRE(revoked.size() == 1);
  CHECK(revoked[0].robot == 0);
}

}  // namespace
}  // namespace km
