#pragma once

#include <sodium.h>

#include "modules/security/authenticated_encryption.hpp"
#include "modules/security/credentials.hpp"
#include "test/modules/security/toy_team.hpp"
#include "test/support/test.hpp"

namespace km {

/// A misbehaving member of the team: it has all keys of a member and obeys no rule. It implements
/// the format of TeamSeal independently.
class RogueMember {
 public:
  RogueMember(const ToyTeam& team, RobotId robot, const std::string& name)
      : keys_(team.keys_of(robot, name)), identity_(toy_identity(robot, name)) {
    crypto_kx_keypair(open_.data(), secret_.data());
  }

  [[nodiscard]] TeamPeer peer() const { return {identity_.robot, identity_.boot}; }
  [[nodiscard]] const RobotIdentity& identity() const { return identity_; }
  [[nodiscard]] const SigningKey& signing_key() const { return keys_.secret; }
  [[nodiscard]] std::string credentials() const {
    return to_text(
        make_credentials(keys_.certificate, keys_.authority, keys_.secret, identity_, open_));
  }

  /// Newest key for messages to all of `from`, taken from its key message to this member.
  [[nodiscard]] TeamKey team_key_of(const ToyMember& from, const Octets& message) const {
    const auto shown = parse_credentials(from.seal.credentials());
    SealingKey receive, send;
    const auto derive =
        peer() < from.peer() ? crypto_kx_client_session_keys : crypto_kx_server_session_keys;
    REQUIRE(derive(receive.data(), send.data(), open_.data(), secret_.data(),
                   shown.value->exchange.data()) == 0);
    ByteWriter data = statement("kimera_multi key message 1");
    for (const TeamPeer& one : {from.peer(), peer()}) {
      data.u16(one.robot);
      data.u64(one.boot);
    }
    const auto content = decrypt(receive, data.release(), message);
    REQUIRE(content);
    ByteReader reader(*content);
    TeamKey key;
    for (int left = reader.u8(); left > 0; --left) {
      key.number = reader.u32();
      std::ranges::copy(reader.bytes(32), key.key.data());
    }
    REQUIRE(reader.done());
    return key;
  }

  /// Message to all that states context.sender as its sender, encrypted under `key` and signed by
  /// `signer`; the signature commits to `signed_key`.
  [[nodiscard]] static Octets message_to_all(const SealContext& context, const TeamKey& key,
                                             const SealingKey& signed_key, const SigningKey& signer,
                                             const Octets& content) {
    ByteWriter number;
    number.u32(key.number);
    Octets sealed = number.release();
    ByteWriter data = statement("kimera_multi message to all 1");
    put_text(data, context.topic);
    data.u16(context.sender.robot);
    data.u64(context.sender.boot);
    data.u64(context.number);
    data.bytes(context.key);
    data.bytes(sealed);
    const Octets associated = data.release();
    encrypt(key.key, random_nonce(), associated, content, sealed);

    ByteWriter hashed;
    hashed.u64(associated.size());
    hashed.bytes(associated);
    hashed.bytes(OctetView(sealed).subspan(4));
    const Octets text = hashed.release();
    std::array<std::uint8_t, 64> hash;
    crypto_generichash(hash.data(), hash.size(), text.data(), text.size(), signed_key.data(),
                       signed_key.size());
    ByteWriter statement_of_hash = statement("kimera_multi sender of a message to all 1");
    statement_of_hash.bytes(hash);
    const Signature signature = sign(statement_of_hash.release(), signer);
    sealed.insert(sealed.end(), signature.begin(), signature.end());
    return sealed;
  }

 private:
  RobotKeys keys_;
  RobotIdentity identity_;
  ExchangeKey open_{};
  Secret<32> secret_;
};

}  // namespace km
