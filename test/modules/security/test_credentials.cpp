#include "modules/security/admitted_peers.hpp"
#include "modules/security/authenticated_encryption.hpp"
#include "modules/security/credentials.hpp"
#include "modules/security/key_types.hpp"
#include "modules/security/signing.hpp"
#include "test/modules/security/toy_team.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Octets of hexadecimal digits, as published examples have them.
Octets octets_from_hex(std::string_view digits) {
  Octets octets;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    octets.push_back(
        static_cast<std::uint8_t>(std::stoul(std::string(digits.substr(i, 2)), nullptr, 16)));
  return octets;
}

template <std::size_t N>
std::array<std::uint8_t, N> array_from_hex(std::string_view digits) {
  std::array<std::uint8_t, N> octets{};
  std::ranges::copy(octets_from_hex(digits.substr(0, 2 * N)), octets.begin());
  return octets;
}

template <std::size_t N>
Secret<N> secret_from_hex(std::string_view digits) {
  Secret<N> secret;
  std::ranges::copy(octets_from_hex(digits.substr(0, 2 * N)), secret.data());
  return secret;
}

TEST_CASE("Certificates and credentials have the bytes of the test vectors in SECURITY") {
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
  CHECK_THAT(text, Contains(credentials));
}

TEST_CASE("Credentials are signed with every field of the identity") {
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

TEST_CASE("The longest announcement of a robot fits into its user data") {
  const std::string most =
      "robot=65535;name=" + std::string(64, 'n') + ";proto=65535;boot=ffffffffffffffff;auth=";
  CHECK(most.size() + kCredentialsLength <= 1024);
}

TEST_CASE("Texts that are no credentials are refused with the reason") {
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

TEST_CASE("The number of admitted processes is bounded") {
  AdmittedPeers peers;
  const TeamPeer live{0, 1};
  peers.add(live, {});
  peers.received(live);
  for (RobotId robot = 1; robot < 2 * kMaxAdmitted; ++robot) peers.add({robot, 1}, {});
  CHECK(peers.size() == kMaxAdmitted);
  CHECK(peers.find(live) != nullptr);
  CHECK(peers.find({2 * kMaxAdmitted - 1, 1}) != nullptr);
}

TEST_CASE("Encryption is the XChaCha20-Poly1305 of the standard's example") {
  // draft-irtf-cfrg-xchacha-03, appendix A.3.1.
  const auto key =
      secret_from_hex<32>("808182838485868788898a8b8c8d8e8f909192939495969798999a9b9c9d9e9f");
  const Nonce nonce = array_from_hex<24>("404142434445464748494a4b4c4d4e4f5051525354555657");
  const Octets associated = octets_from_hex("50515253c0c1c2c3c4c5c6c7");
  const std::string text =
      "Ladies and Gentlemen of the class of '99: If I could offer you only one tip for the future, "
      "sunscreen would be it.";
  const Octets content(text.begin(), text.end());
  const Octets expected = octets_from_hex(
      "404142434445464748494a4b4c4d4e4f5051525354555657"
      "bd6d179d3e83d43b9576579493c0e939572a1700252bfaccbed2902c21396cbb"
      "731c7f1b0b4aa6440bf3a82f4eda7e39ae64c6708c54c216cb96b72e1213b452"
      "2f8c9ba40db5d945b11b69b982c1bb9e3f3fac2bc369488f76b2383565d3fff9"
      "21f9664c97637da9768812f615c68b13b52e"
      "c0875924c1c7987947deafd8780acf49");
  Octets encrypted = {0xaa};  // existing bytes stay
  encrypt(key, nonce, associated, content, encrypted);
  CHECK(encrypted.front() == 0xaa);
  encrypted.erase(encrypted.begin());
  CHECK(encrypted == expected);
  CHECK(decrypt(key, associated, expected) == content);
}

}  // namespace
}  // namespace km
