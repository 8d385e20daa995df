#include <sodium.h>

#include "modules/security/authenticated_encryption.hpp"
#include "modules/security/credentials.hpp"
#include "test/modules/security/toy_team.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Status = Opened::Status;

constexpr std::int64_t kDay_s = 86400;

// A misbehaving member of the team: it has all keys of a member and obeys no rule. It implements
// the format of TeamSeal independently.
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

  // Newest key for messages to all of `from`, taken from its key message to this member.
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

  // Message to all that states context.sender as its sender, encrypted under `key` and signed by
  // `signer`; the signature commits to `signed_key`.
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

std::string admission(ToyMember& to, const RobotKeys& keys, const RobotIdentity& identity,
                      std::int64_t now_s = kToyNow_s) {
  const Credentials shown =
      make_credentials(keys.certificate, keys.authority, keys.secret, identity, {9});
  // Forwarded credentials have the same result as directly received ones.
  const auto certified = to.seal.certified(identity, to_text(shown), now_s);
  const std::string refusal = reason_of(to.seal.admit(identity, to_text(shown), now_s));
  CHECK(reason_of(certified.refusal) == refusal);
  CHECK(certified.value.has_value() == refusal.empty());
  return refusal;
}

TEST_CASE("A robot is admitted only with a valid certificate of its team") {
  const ToyTeam team, others("survey");
  ToyMember a(team, 0, "alpha");
  const RobotKeys good = team.keys_of(1, "beta");
  const RobotIdentity identity = toy_identity(1, "beta");
  REQUIRE(admission(a, good, identity).empty());
  const auto with = [](auto value, const auto& change) {
    change(value);
    return value;
  };
  const std::string not_certified = "certificate is not the authority's for this id, name and key";
  CHECK(admission(a, others.keys_of(1, "beta"), identity) == "credentials of another team");
  CHECK(admission(a,
                  with(others.keys_of(1, "beta"),
                       [&](RobotKeys& keys) { keys.authority = team.authority(); }),
                  identity) == not_certified);
  CHECK(admission(a, good, with(identity, [](auto& its) { its.robot = 0; })) == not_certified);
  CHECK(admission(a, good, with(identity, [](auto& its) { its.name = "alpha"; })) == not_certified);
  CHECK(admission(a, with(good, [](RobotKeys& keys) { keys.certificate.valid_until_s += 1; }),
                  identity) == not_certified);
  CHECK(admission(a, with(good, [](RobotKeys& keys) { keys.secret = make_signing_key(); }),
                  identity) == "credentials are not signed by the robot that they name");
  CHECK(admission(a, good, identity, good.certificate.valid_from_s - 1) ==
        "certificate is not valid yet (are clocks right?)");
  CHECK(admission(a, good, identity, good.certificate.valid_from_s).empty());
  CHECK(admission(a, good, identity, good.certificate.valid_until_s).empty());
  CHECK(admission(a, good, identity, good.certificate.valid_until_s + 1) ==
        "certificate has expired (are clocks right?)");
  CHECK(reason_of(a.seal.admit(a.identity, a.seal.credentials(), kToyNow_s)) ==
        "these are this process's own credentials");
}

TEST_CASE("An exchange key of small order is refused") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha");
  const RobotKeys keys = team.keys_of(1, "beta");
  const RobotIdentity identity = toy_identity(1, "beta");
  const Credentials shown =
      make_credentials(keys.certificate, keys.authority, keys.secret, identity, ExchangeKey{});
  CHECK(reason_of(a.seal.admit(identity, to_text(shown), kToyNow_s)) ==
        "credentials have an exchange key of small order");
  CHECK_FALSE(a.seal.is_admitted({1, identity.boot}));
}

TEST_CASE("A process keeps the keys with which it was admitted") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  introduce(a, b);
  ToyMember twin(b, b.identity.boot);
  CHECK(reason_of(a.admit(twin)) == "credentials have another key for the same boot");
  const auto sealed = a.seal.seal(toy_context(a, b.peer()), toy_content());
  CHECK(b.seal.open(toy_context(a, b.peer()), *sealed).status == Status::kOpened);
}

TEST_CASE("A robot without keys of its own does not start") {
  ToyTeam team;
  const RobotKeys keys = team.keys_of(1, "beta");
  const RobotIdentity identity = toy_identity(1, "beta");
  REQUIRE_NOTHROW(TeamSeal(keys, identity, kToyNow_s));
  RobotKeys revoked = keys, changed = keys;
  revoked.revocations = team.revoking({keys.certificate});
  changed.revocations.number += 1;  // no longer signed
  CHECK_THROWS_AS(TeamSeal(keys, toy_identity(2, "beta"), kToyNow_s), std::invalid_argument);
  CHECK_THROWS_AS(TeamSeal(keys, toy_identity(1, "gamma"), kToyNow_s), std::invalid_argument);
  CHECK_THROWS_AS(TeamSeal(keys, identity, kToyNow_s + 100 * kDay_s), std::invalid_argument);
  CHECK_THROWS_AS(TeamSeal(revoked, identity, kToyNow_s), std::invalid_argument);
  CHECK_THROWS_AS(TeamSeal(changed, identity, kToyNow_s), std::invalid_argument);
}

TEST_CASE("A revoked robot is removed, refused, and cannot read later messages") {
  ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta"), c(team, 2, "gamma");
  introduce(a, b);
  introduce(a, c);
  introduce(b, c);
  const SealContext to_all = toy_context(a);
  const auto before = a.seal.seal(to_all, toy_content());

  const Revocations list = team.revoking({c.keys.certificate});
  const MembershipChange change = a.seal.update(list, kToyNow_s);
  CHECK(change.forgotten == std::vector<TeamPeer>{c.peer()});
  CHECK(change.new_key);
  CHECK(reason_of(a.admit(c)) == "certificate is revoked");
  CHECK_FALSE(a.seal.key_message_for(c.peer()));

  const auto after = a.seal.seal(to_all, toy_content());
  CHECK(c.seal.open(to_all, *after).status == Status::kNotYet);
  CHECK(b.seal.open(to_all, *after).status == Status::kNotYet);
  REQUIRE(b.seal.accept_key_message(a.peer(), *a.seal.key_message_for(b.peer())) == nullptr);
  CHECK(b.seal.open(to_all, *after).status == Status::kOpened);
  CHECK(b.seal.open(to_all, *before).status == Status::kOpened);
  CHECK_FALSE(a.seal.update(list, kToyNow_s).new_key);
}

TEST_CASE("A robot known only by its credentials is not admitted, and lapses") {
  ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  const auto known = a.seal.certified(b.identity, b.seal.credentials(), kToyNow_s);
  REQUIRE(known.value);
  CHECK(known.value->key == b.keys.certificate.key);
  CHECK_FALSE(a.seal.is_admitted(b.peer()));
  CHECK_FALSE(a.seal.credentials_of(b.peer()));
  REQUIRE(a.admit(b) == nullptr);
  CHECK(a.seal.credentials_of(b.peer()) == b.seal.credentials());
  CHECK(a.seal.why_lapsed(*known.value, kToyNow_s) == nullptr);
  CHECK(reason_of(a.seal.why_lapsed(*known.value, kToyNow_s + 20 * kDay_s)) ==
        "certificate has expired (are clocks right?)");
  (void)a.seal.update(team.revoking({b.keys.certificate}), kToyNow_s);
  CHECK(reason_of(a.seal.why_lapsed(*known.value, kToyNow_s)) == "certificate is revoked");
  CHECK_FALSE(a.seal.credentials_of(b.peer()));
}

TEST_CASE("A new member reads messages to all that were sealed before a revocation") {
  ToyTeam team;
  ToyMember a(team, 0, "alpha"), late(team, 3, "delta"), c(team, 2, "gamma");
  introduce(a, c);
  const SealContext to_all = toy_context(a);
  const auto before = a.seal.seal(to_all, toy_content());
  const Revocations list = team.revoking({c.keys.certificate});
  (void)a.seal.update(list, kToyNow_s);
  introduce(a, late);
  CHECK(late.seal.open(to_all, *before).status == Status::kOpened);
}

TEST_CASE("A member whose certificate expires reads no later messages") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  introduce(a, b);
  const std::int64_t end_s = b.keys.certificate.valid_until_s;
  CHECK_FALSE(a.seal.update(team.revocations(), end_s).new_key);
  const MembershipChange change = a.seal.update(team.revocations(), end_s + 1);
  CHECK(change.forgotten.size() == 1);
  CHECK(change.new_key);
  CHECK_FALSE(a.seal.is_admitted(b.peer()));
  const auto after = a.seal.seal(toy_context(a), toy_content());
  CHECK(b.seal.open(toy_context(a), *after).status == Status::kNotYet);
}

TEST_CASE("Old and forged lists of revocations change nothing") {
  ToyTeam team, others;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  introduce(a, b);
  const Revocations former = team.revoking({});
  Revocations list = team.revoking({});
  (void)a.seal.update(list, kToyNow_s);
  CHECK_THROWS_AS(a.seal.update(former, kToyNow_s), std::invalid_argument);
  CHECK_THROWS_AS(a.seal.update(others.revoking({b.keys.certificate}), kToyNow_s),
                  std::invalid_argument);
  list.revoked.push_back({b.keys.certificate.key, 1, "beta"});
  CHECK_THROWS_AS(a.seal.update(list, kToyNow_s), std::invalid_argument);
  CHECK(a.seal.is_admitted(b.peer()));
}

TEST_CASE("After more revocations than keys are kept, old messages are refused") {
  ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  const SealContext to_all = toy_context(a);
  const auto first = a.seal.seal(to_all, toy_content());
  for (RobotId lost = 10; lost < 20; ++lost)
    (void)a.seal.update(team.revoking({team.keys_of(lost, "lost").certificate}), kToyNow_s);
  introduce(a, b);
  CHECK(b.seal.open(to_all, *first).status == Status::kRefused);
  CHECK(b.seal.open(to_all, *a.seal.seal(to_all, toy_content())).status == Status::kOpened);
}

TEST_CASE("A replayed older key message does not remove newer keys") {
  ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  introduce(a, b);
  const auto old = a.seal.key_message_for(b.peer());
  (void)a.seal.update(team.revoking({team.keys_of(9, "lost").certificate}), kToyNow_s);
  REQUIRE(b.seal.accept_key_message(a.peer(), *a.seal.key_message_for(b.peer())) == nullptr);
  CHECK(b.seal.accept_key_message(a.peer(), *old) == nullptr);
  const auto sealed = a.seal.seal(toy_context(a), toy_content());
  CHECK(b.seal.open(toy_context(a), *sealed).status == Status::kOpened);
}

TEST_CASE(
    "A member cannot send to all in another member's name although it has that member's key") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  RogueMember c(team, 2, "gamma");
  introduce(a, b);
  for (ToyMember* one : {&a, &b})
    REQUIRE(one->seal.admit(c.identity(), c.credentials(), kToyNow_s) == nullptr);
  const TeamKey key = c.team_key_of(b, b.seal.key_message_for(c.peer()).value());
  const SealContext as_b = toy_context(b);
  const Octets lie = toy_content();

  const Octets genuine = RogueMember::message_to_all(as_b, key, key.key, b.keys.secret, lie);
  CHECK(a.seal.open(as_b, genuine).content == lie);
  const Octets forged = RogueMember::message_to_all(as_b, key, key.key, c.signing_key(), lie);
  CHECK(reason_of(a.seal.open(as_b, forged).reason) == "message is not signed by its sender");
}

TEST_CASE("The sender's signature commits to the key so that all members read the same content") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  RogueMember c(team, 2, "gamma");
  introduce(a, b);
  REQUIRE(b.seal.admit(c.identity(), c.credentials(), kToyNow_s) == nullptr);
  const TeamKey key = c.team_key_of(b, b.seal.key_message_for(c.peer()).value());
  const Octets other_key = RogueMember::message_to_all(toy_context(b), key, make_sealing_key(),
                                                       b.keys.secret, toy_content());
  CHECK(a.seal.open(toy_context(b), other_key).status == Status::kRefused);
}

TEST_CASE("Replayed credentials of a process do not displace the active one") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  std::vector<std::unique_ptr<ToyMember>> former;
  for (std::uint64_t boot = 1; boot <= 2 * kMaxAdmittedPerRobot; ++boot)
    former.push_back(std::make_unique<ToyMember>(b, boot));
  introduce(a, b);
  for (const auto& one : former) CHECK(a.admit(*one) == nullptr);
  const auto sealed = b.seal.seal(toy_context(b, a.peer()), toy_content());
  CHECK(a.seal.open(toy_context(b, a.peer()), *sealed).status == Status::kOpened);
}

}  // namespace
}  // namespace km
