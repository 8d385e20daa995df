#include <catch2/catch.hpp>

#include <fstream>
#include <iterator>
#include <string>

#include "modules/security/credentials.hpp"
#include "modules/security/signing.hpp"
#include "test/modules/security/hex.hpp"
#include "test/modules/security/toy_team.hpp"

namespace km {
namespace {

TEST_CASE("Certificates and credentials have the bytes of the test vectors in SECURITY",
          "[security]") {
  Secret<32> authority_seed, robot_seed;
  std::fill_n(authority_seed.data(), 32, std::uint8_t{1});
  std::fill_n(robot_seed.data(), 32, std::uint8_t{2});
  const SigningKey authority = signing_key_from(authority_seed);
  const SigningKey robot = signing_key_from(robot_seed);
  Certificate certificate = {.team = "survey", .robot = 7, .name = "alice"};
  certificate.key = public_key_of(robot);
  certificate.valid_from_s = 1700000000;
  certificate.valid_until_s = 1800000000;
  sign(certificate, authority);
  CHECK(certificate.signature ==
        array_from_hex<64>("52d382e44c67c87f84a1ad7d68bc47dcb147327a0bd7ce0e3a47df1a912ab72e"
                           "290d720cd929212ad8045f6da1a1927f13e60d689f30cc9ffcacb8d921d8ca07"));

  ExchangeKey exchange;
  exchange.fill(3);
  RobotIdentity identity = toy_identity(7, "alice");
  identity.protocol = 1;
  identity.boot = 65536;
  const std::string credentials =
      to_text(make_credentials(certificate, public_key_of(authority), robot, identity, exchange));
  std::ifstream page(".github/SECURITY.md");
  std::string text(std::istreambuf_iterator<char>(page), {});
  std::erase_if(text, [](char c) { return c == ' ' || c == '\n'; });
  CHECK_THAT(text, Catch::Contains(credentials));
}

TEST_CASE("Credentials are signed with every field of the identity", "[security]") {
  const ToyTeam team;
  const RobotKeys keys = team.keys_of(3, "alpha");
  const RobotIdentity identity = toy_identity(3, "alpha");
  const Credentials shown =
      make_credentials(keys.certificate, keys.authority, keys.secret, identity, {});
  REQUIRE(is_signed_by_robot(shown, identity));
  for (const RobotIdentity& other : {RobotIdentity{4, "alpha", identity.protocol, identity.boot},
                                     RobotIdentity{3, "alpha2", identity.protocol, identity.boot},
                                     RobotIdentity{3, "alpha", 9999, identity.boot},
                                     RobotIdentity{3, "alpha", identity.protocol, 1}})
    CHECK_FALSE(is_signed_by_robot(shown, other));
}

TEST_CASE("The longest announcement of a robot fits into its user data", "[security]") {
  const std::string most =
      "robot=65535;name=" + std::string(64, 'n') + ";proto=65535;boot=ffffffffffffffff;auth=";
  CHECK(most.size() + kCredentialsLength <= 1024);
}

TEST_CASE("Texts that are no credentials are refused with the reason", "[security]") {
  const std::string zeros(kCredentialsLength, 'A');
  CHECK(reason_of(parse_credentials("").refusal) == "credentials of another length");
  CHECK(reason_of(parse_credentials(zeros + "A").refusal) == "credentials of another length");
  CHECK(reason_of(parse_credentials(zeros).refusal) == "credentials of another format");
  std::string text = zeros;
  text[17] = '+';
  CHECK(reason_of(parse_credentials(text).refusal) == "credentials are not base 64");
  text = zeros;
  text.back() = 'B';  // other text for the same bytes
  CHECK(reason_of(parse_credentials(text).refusal) == "credentials are not base 64");
}

}  // namespace
}  // namespace km
