#include "modules/security/team_seal.hpp"

#include <sodium.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "modules/security/authenticated_encryption.hpp"

namespace km {
namespace {

static_assert(kAddressedSealBytes == kEncryptionBytes);
static_assert(kTeamSealBytes == sizeof(std::uint32_t) + kEncryptionBytes + Signature().size());
static_assert(ExchangeKey().size() == crypto_kx_PUBLICKEYBYTES);
static_assert(Secret<32>::size() == crypto_kx_SECRETKEYBYTES);
static_assert(SealingKey::size() == crypto_kx_SESSIONKEYBYTES);

// Maximum number of team keys in a key message. A process seals with its newest key only. It also
// sends its former keys, so that a robot that joins late can open messages sealed with them.
constexpr std::size_t kTeamKeysKept = 8;

void put_peer(ByteWriter& writer, const TeamPeer& peer) {
  writer.u16(peer.robot);
  writer.u64(peer.boot);
}

// Data that the tag of a message covers in addition to its content.
Octets associated_data(const SealContext& context) {
  ByteWriter writer = statement(context.addressee ? "kimera_multi message for one 1"
                                                  : "kimera_multi message to all 1");
  put_text(writer, context.topic);
  put_peer(writer, context.sender);
  writer.u64(context.number);
  writer.bytes(context.key);
  if (context.addressee) put_peer(writer, *context.addressee);
  return writer.release();
}

Octets key_message_data(const TeamPeer& from, const TeamPeer& to) {
  ByteWriter writer = statement("kimera_multi key message 1");
  put_peer(writer, from);
  put_peer(writer, to);
  return writer.release();
}

// Statement that the sender of a message to all signs. The hash is keyed with the team key.
// Otherwise a sender could find one ciphertext that opens to different contents under different
// keys, and send these keys to different members.
Octets signed_statement(const SealingKey& key, OctetView associated, OctetView encrypted) {
  ByteWriter length;
  length.u64(associated.size());
  crypto_generichash_state state;
  std::array<std::uint8_t, crypto_generichash_BYTES_MAX> hash;
  crypto_generichash_init(&state, key.data(), key.size(), hash.size());
  crypto_generichash_update(&state, length.release().data(), sizeof(std::uint64_t));
  crypto_generichash_update(&state, associated.data(), associated.size());
  crypto_generichash_update(&state, encrypted.data(), encrypted.size());
  crypto_generichash_final(&state, hash.data(), hash.size());
  ByteWriter writer = statement("kimera_multi sender of a message to all 1");
  writer.bytes(hash);
  return writer.release();
}

Octets to_octets(const std::vector<TeamKey>& keys) {
  ByteWriter writer;
  writer.u8(static_cast<std::uint8_t>(keys.size()));
  for (const TeamKey& key : keys) {
    writer.u32(key.number);
    writer.bytes({key.key.data(), key.key.size()});
  }
  return writer.release();
}

// Empty for bytes that to_octets() does not write.
std::vector<TeamKey> team_keys_from(OctetView octets) {
  ByteReader reader(octets);
  std::vector<TeamKey> keys(std::min<std::size_t>(reader.u8(), kTeamKeysKept));
  for (TeamKey& key : keys) {
    key.number = reader.u32();
    std::ranges::copy(reader.bytes(SealingKey::size()), key.key.data());
  }
  const bool ascending = std::ranges::adjacent_find(keys, std::ranges::greater_equal(),
                                                    &TeamKey::number) == keys.end();
  if (!reader.done() || !ascending) keys.clear();
  return keys;
}

Opened opened(Octets content) {
  return {Opened::Status::kOpened, std::move(content), nullptr};
}
Opened not_yet(const char* reason) {
  return {Opened::Status::kNotYet, {}, reason};
}
Opened refused(const char* reason) {
  return {Opened::Status::kRefused, {}, reason};
}

}  // namespace

TeamSeal::TeamSeal(RobotKeys keys, const RobotIdentity& own, std::int64_t now_s)
    : secret_(keys.secret),
      team_(keys.certificate.team),
      authority_(keys.authority),
      self_{own.robot, own.boot},
      revocations_(std::move(keys.revocations)) {
  const Certificate& certificate = keys.certificate;
  if (certificate.robot != own.robot || certificate.name != own.name)
    throw std::invalid_argument("the keys are those of " + certificate.name + " (id " +
                                std::to_string(certificate.robot) + "), this robot is " + own.name +
                                " (id " + std::to_string(own.robot) +
                                "): use its own folder of keys, or its name and id");
  if (!is_signed_by(authority_, revocations_))
    throw std::invalid_argument("the list of revocations is not the authority's");
  if (const char* why = why_refused(certificate, authority_, revocations_, now_s))
    throw std::invalid_argument("the keys of " + own.name + " cannot be used: " + why +
                                "; `kimera_multi_keys add` makes new ones");
  start_sodium();
  crypto_kx_keypair(exchange_.data(), exchange_secret_.data());
  credentials_ = to_text(make_credentials(certificate, authority_, secret_, own, exchange_));
  draw_team_key();
}

const char* TeamSeal::admit(const RobotIdentity& identity, std::string_view text,
                            std::int64_t now_s) {
  const TeamPeer peer{identity.robot, identity.boot};
  if (peer == self_) return "these are this process's own credentials";
  const Decoded<Credentials> parsed = parse_credentials(text);
  if (!parsed.value) return parsed.refusal;
  const Decoded<Certificate> certificate = certified(*parsed.value, identity, now_s);
  if (!certificate.value) return certificate.refusal;
  AdmittedPeer admitted;
  admitted.certificate = *certificate.value;
  admitted.credentials = text;
  admitted.exchange = parsed.value->exchange;
  if (!agree(peer, admitted)) return "credentials have an exchange key of small order";
  if (const AdmittedPeer* known = peers_.find(peer))
    return known->exchange == admitted.exchange ? nullptr
                                                : "credentials have another key for the same boot";
  peers_.add(peer, std::move(admitted));
  return nullptr;
}

Decoded<Certificate> TeamSeal::certified(const RobotIdentity& identity, std::string_view text,
                                         std::int64_t now_s) const {
  const Decoded<Credentials> parsed = parse_credentials(text);
  if (!parsed.value) return Decoded<Certificate>::refuse(parsed.refusal);
  return certified(*parsed.value, identity, now_s);
}

Decoded<Certificate> TeamSeal::certified(const Credentials& shown, const RobotIdentity& identity,
                                         std::int64_t now_s) const {
  using Result = Decoded<Certificate>;
  if (!std::ranges::equal(shown.authority, OctetView(authority_).first(shown.authority.size())))
    return Result::refuse("credentials of another team");
  if (!is_signed_by_robot(shown, identity))
    return Result::refuse("credentials are not signed by the robot that they name");
  Certificate certificate = claimed_certificate(shown, identity, team_);
  if (const char* why = why_refused(certificate, authority_, revocations_, now_s))
    return Result::refuse(why);
  return Result::accept(std::move(certificate));
}

std::optional<std::string> TeamSeal::credentials_of(const TeamPeer& peer) const {
  const AdmittedPeer* admitted = peers_.find(peer);
  return admitted == nullptr ? std::nullopt : std::optional(admitted->credentials);
}

// Derives the keys in both directions by X25519 and BLAKE2b over the shared secret and both public
// keys. False for a public key of small order, which yields no shared secret.
bool TeamSeal::agree(const TeamPeer& peer, AdmittedPeer& admitted) const {
  const auto derive = self_ < peer ? crypto_kx_client_session_keys : crypto_kx_server_session_keys;
  return derive(admitted.from_peer.data(), admitted.to_peer.data(), exchange_.data(),
                exchange_secret_.data(), admitted.exchange.data()) == 0;
}

MembershipChange TeamSeal::update(const Revocations& revocations, std::int64_t now_s) {
  if (!is_signed_by(authority_, revocations))
    throw std::invalid_argument("the list of revocations is not the authority's");
  if (revocations.number < revocations_.number)
    throw std::invalid_argument("the list of revocations has number " +
                                std::to_string(revocations.number) + ", older than number " +
                                std::to_string(revocations_.number) + " that is in use");
  const bool differs = revocations.revoked != revocations_.revoked;
  revocations_ = revocations;
  MembershipChange change;
  change.forgotten = peers_.erase_if([&](const Certificate& certificate) {
    return why_invalid(certificate, revocations, now_s) != nullptr;
  });
  change.new_key = differs || !change.forgotten.empty() || now_s > newest_key_expires_s_;
  if (change.new_key) draw_team_key();
  return change;
}

void TeamSeal::draw_team_key() {
  const std::uint32_t number = team_keys_.empty() ? 1 : team_keys_.back().number + 1;
  team_keys_.push_back({number, make_sealing_key()});
  if (team_keys_.size() > kTeamKeysKept) team_keys_.erase(team_keys_.begin());
  newest_key_expires_s_ = std::numeric_limits<std::int64_t>::max();
}

std::optional<Octets> TeamSeal::key_message_for(const TeamPeer& peer) {
  const AdmittedPeer* to = peers_.find(peer);
  if (to == nullptr) return std::nullopt;
  newest_key_expires_s_ = std::min(newest_key_expires_s_, to->certificate.valid_until_s);
  Octets keys = to_octets(team_keys_);
  Octets message;
  encrypt(to->to_peer, random_nonce(), key_message_data(self_, peer), keys, message);
  sodium_memzero(keys.data(), keys.size());
  return message;
}

const char* TeamSeal::accept_key_message(const TeamPeer& from, OctetView message) {
  AdmittedPeer* sender = peers_.find(from);
  if (sender == nullptr) return "key message of a process that is not admitted";
  auto content = decrypt(sender->from_peer, key_message_data(from, self_), message);
  if (!content) return "key message is not from its sender, or not for this process";
  std::vector<TeamKey> keys = team_keys_from(*content);
  sodium_memzero(content->data(), content->size());
  if (keys.empty()) return "key message does not hold keys";
  peers_.received(from);
  // A replayed older key message must not remove the newer keys.
  if (sender->team_keys.empty() || sender->team_keys.back().number < keys.back().number)
    sender->team_keys = std::move(keys);
  return nullptr;
}

std::optional<Octets> TeamSeal::seal(const SealContext& context, OctetView content) const {
  if (context.sender != self_)
    throw std::invalid_argument("a message is sealed in the name of its own sender only");
  if (context.addressee == self_)
    throw std::invalid_argument("a message is not sealed for its own sender");
  if (!context.addressee) return seal_to_all(associated_data(context), content);
  const AdmittedPeer* peer = peers_.find(*context.addressee);
  if (peer == nullptr) return std::nullopt;
  Octets sealed;
  sealed.reserve(content.size() + kAddressedSealBytes);
  encrypt(peer->to_peer, random_nonce(), associated_data(context), content, sealed);
  return sealed;
}

Opened TeamSeal::open(const SealContext& context, OctetView sealed) {
  if (context.sender == self_) return refused("message of this process itself");
  if (!context.addressee) return open_to_all(context, sealed);
  if (*context.addressee != self_) return refused("message for another process");
  return open_for_self(context, sealed);
}

// Format: number of the key, nonce, ciphertext, tag, signature.
Octets TeamSeal::seal_to_all(Octets associated, OctetView content) const {
  const TeamKey& key = team_keys_.back();
  ByteWriter number;
  number.u32(key.number);
  Octets sealed = number.release();
  associated.insert(associated.end(), sealed.begin(), sealed.end());
  sealed.reserve(content.size() + kTeamSealBytes);
  encrypt(key.key, random_nonce(), associated, content, sealed);
  const OctetView encrypted = OctetView(sealed).subspan(sizeof(std::uint32_t));
  const Signature signature = sign(signed_statement(key.key, associated, encrypted), secret_);
  sealed.insert(sealed.end(), signature.begin(), signature.end());
  return sealed;
}

Opened TeamSeal::open_for_self(const SealContext& context, OctetView sealed) {
  if (sealed.size() < kAddressedSealBytes) return refused("message shorter than its seal");
  const AdmittedPeer* sender = peers_.find(context.sender);
  if (sender == nullptr) return not_yet("its sender is not admitted");
  auto content = decrypt(sender->from_peer, associated_data(context), sealed);
  if (!content) return refused("message is not from its sender, or was changed");
  peers_.received(context.sender);
  return opened(std::move(*content));
}

Opened TeamSeal::open_to_all(const SealContext& context, OctetView sealed) {
  if (sealed.size() < kTeamSealBytes) return refused("message shorter than its seal");
  const OctetView number_octets = sealed.first(sizeof(std::uint32_t));
  const OctetView encrypted = sealed.subspan(
      number_octets.size(), sealed.size() - number_octets.size() - Signature().size());
  const std::uint32_t number = ByteReader(number_octets).u32();
  Signature signature;
  std::ranges::copy(sealed.last(signature.size()), signature.begin());

  const AdmittedPeer* sender = peers_.find(context.sender);
  if (sender == nullptr) return not_yet("its sender is not admitted");
  const std::vector<TeamKey>& keys = sender->team_keys;
  if (keys.empty() || number > keys.back().number)
    return not_yet("the key of its sender for messages to all is unknown");
  const auto key = std::ranges::find(keys, number, &TeamKey::number);
  if (key == keys.end()) return refused("message under a former key of its sender");
  Octets associated = associated_data(context);
  associated.insert(associated.end(), number_octets.begin(), number_octets.end());
  // The tag comes first: it is much cheaper to check than a signature, and refuses all senders
  // outside the team.
  auto content = decrypt(key->key, associated, encrypted);
  if (!content) return refused("message is not from its sender, or was changed");
  if (!verify(signed_statement(key->key, associated, encrypted), signature,
              sender->certificate.key))
    return refused("message is not signed by its sender");
  peers_.received(context.sender);
  return opened(std::move(*content));
}

}  // namespace km
