#include <catch2/catch.hpp>

#include "modules/security/signing.hpp"
#include "test/modules/security/hex.hpp"

namespace km {
namespace {

TEST_CASE("Signatures are the Ed25519 of the standard's first example", "[security]") {
  // RFC 8032, section 7.1, test 1: of the empty message.
  const SigningKey key = signing_key_from(
      secret_from_hex<32>("9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60"));
  const auto public_key =
      array_from_hex<32>("d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a");
  const auto signature = array_from_hex<64>(
      "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e06522490155"
      "5fb8821590a33bacc61e39701cf9b46bd25bf5f0595bbe24655141438e7a100b");
  CHECK(public_key_of(key) == public_key);
  CHECK(sign(OctetView(), key) == signature);
  CHECK(verify({}, signature, public_key));
}

}  // namespace
}  // namespace km
