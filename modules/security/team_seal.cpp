#include "modules/security/team_seal.hpp"

#include <sodium.h>

#include <algorithm>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "modules/security/authenticated_encryption.hpp"
#include "modules/security/signing.hpp"

namespace km {
namespace {

static_assert(kAddressedSealBytes == kEncryptionBytes);
static_assert(kTeamSealBytes == sizeof(std::uint32_t) + kEncryptionBytes + Signature().size());
static_assert(ExchangeKey().size() == crypto_kx_PUBLICKEYBYTES);
static_assert(SealingKey::size() == crypto_kx_SESSIONKEYBYTES);

// Keys for messages to all that a process tells and remembers of another: what its older ones
// sealed can still be read by those who come late.
constexpr std::size_t kTeamKeysKept = 8;

struct ExchangePair {
  ExchangeKey open{};
  Secret<crypto_kx_SECRETKEYBYTES> secret;
};

ExchangePair make_exchange_pair() {
  start_sodium();
  ExchangePair pair;
  crypto_kx_keypair(pair.open.data(), pair.secret.data());
  return pair;
}

// The keys in both directions, by X25519 and BLAKE2b over the shared secret and both public keys.
// False for a public key of small order, which has no secret to share.
bool agree(const TeamPeer& own, const ExchangePair& pair, const TeamPeer& peer,
           AdmittedPeer& admitted) {
  const auto derive = own < peer ? crypto_kx_client_session_keys : crypto_kx_server_session_keys;
  return derive(admitted.from_peer.data(), admitted.to_peer.data(), pair.open.data(),
                pair.secret.data(), admitted.exchange.data()) == 0;
}

void put_peer(ByteWriter& writer, const TeamPeer& peer) {
  writer.u16(peer.robot);
  writer.u64(peer.boot);
}

// What the tag of a message covers beside its content.
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

// What the sender of a message to all signs. The hash is keyed with the team key: without that, a
// sender could find one ciphertext that opens to different contents under different keys, which it
// hands to different members.
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

// Empty for octets that to_octets() does not write.
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

struct TeamSeal::State {
  // As it was made; read without the lock.
  SigningKey secret;
  std::string team;
  PublicKey authority{};
  TeamPeer self;
  ExchangePair exchange;
  std::string credentials;

  std::mutex mutex;  // guards what follows; no key is used under it, only copied
  Revocations revocations;
  AdmittedPeers peers;
  std::vector<TeamKey> team_keys;  // own, by number; the last seals
  // [s since 1970-01-01 UTC] when the first of those who have the newest team key is no longer a
  // member: it may be gone from `peers` by then.
  std::int64_t holder_lapses_s = std::numeric_limits<std::int64_t>::max();

  void draw_team_key() {
    const std::uint32_t number = team_keys.empty() ? 1 : team_keys.back().number + 1;
    team_keys.push_back({number, make_sealing_key()});
    if (team_keys.size() > kTeamKeysKept) team_keys.erase(team_keys.begin());
    holder_lapses_s = std::numeric_limits<std::int64_t>::max();
  }

  Octets seal_to_all(Octets associated, OctetView content);
  Opened open_for_self(const SealContext& context, OctetView sealed);
  Opened open_to_all(const SealContext& context, OctetView sealed);
};

TeamSeal::TeamSeal(RobotKeys keys, const RobotIdentity& own, std::int64_t now_s)
    : state_(std::make_unique<State>()) {
  const Certificate& certificate = keys.certificate;
  if (certificate.robot != own.robot || certificate.name != own.name)
    throw std::invalid_argument("the keys are those of " + certificate.name + " (id " +
                                std::to_string(certificate.robot) + "), this robot is " + own.name +
                                " (id " + std::to_string(own.robot) +
                                "): use its own folder of keys, or its name and id");
  if (!is_signed_by(keys.authority, keys.revocations))
    throw std::invalid_argument("the list of revocations is not the authority's");
  if (const char* why = refusal_of(certificate, keys.authority, keys.revocations, now_s))
    throw std::invalid_argument("the keys of " + own.name + " are of no use: " + why +
                                "; `kimera_multi_keys add` makes new ones");
  state_->secret = keys.secret;
  state_->team = certificate.team;
  state_->authority = keys.authority;
  state_->self = {own.robot, own.boot};
  state_->exchange = make_exchange_pair();
  state_->credentials = to_text(
      make_credentials(certificate, keys.authority, keys.secret, own, state_->exchange.open));
  state_->revocations = std::move(keys.revocations);
  state_->draw_team_key();
}

TeamSeal::~TeamSeal() = default;

const std::string& TeamSeal::credentials() const {
  return state_->credentials;
}

const char* TeamSeal::admit(const RobotIdentity& identity, std::string_view text,
                            std::int64_t now_s) {
  State& state = *state_;
  const TeamPeer peer{identity.robot, identity.boot};
  if (peer == state.self) return "these are this process's own credentials";
  const Decoded<Credentials> parsed = parse_credentials(text);
  if (!parsed.value) return parsed.refusal;
  const Credentials& shown = *parsed.value;
  if (!std::ranges::equal(shown.authority,
                          OctetView(state.authority).first(shown.authority.size())))
    return "credentials of another team";
  AdmittedPeer admitted;
  admitted.certificate = claimed_certificate(shown, identity, state.team);
  admitted.exchange = shown.exchange;
  if (!is_signed_by_robot(shown, identity))
    return "credentials are not signed by the robot that they name";
  const Revocations revocations = [&] {
    const std::lock_guard lock(state.mutex);
    return state.revocations;
  }();
  if (const char* why = refusal_of(admitted.certificate, state.authority, revocations, now_s))
    return why;
  if (!agree(state.self, state.exchange, peer, admitted))
    return "credentials have an exchange key of small order";

  const std::lock_guard lock(state.mutex);
  if (revocations.number != state.revocations.number)
    return "the list of revocations changed meanwhile: admit again";
  if (const AdmittedPeer* known = state.peers.find(peer))
    return known->exchange == admitted.exchange ? nullptr
                                                : "credentials have another key for the same boot";
  state.peers.add(peer, std::move(admitted));
  return nullptr;
}

bool TeamSeal::is_admitted(const TeamPeer& peer) const {
  const std::lock_guard lock(state_->mutex);
  return state_->peers.find(peer) != nullptr;
}

void TeamSeal::forget(const TeamPeer& peer) {
  const std::lock_guard lock(state_->mutex);
  state_->peers.erase(peer);
}

MembershipChange TeamSeal::update(const Revocations& revocations, std::int64_t now_s) {
  State& state = *state_;
  if (!is_signed_by(state.authority, revocations))
    throw std::invalid_argument("the list of revocations is not the authority's");
  const std::lock_guard lock(state.mutex);
  if (revocations.number < state.revocations.number)
    throw std::invalid_argument("the list of revocations has number " +
                                std::to_string(revocations.number) + ", older than number " +
                                std::to_string(state.revocations.number) + " that is in use");
  const bool differs = revocations.revoked != state.revocations.revoked;
  state.revocations = revocations;
  MembershipChange change;
  change.forgotten = state.peers.erase_if([&](const Certificate& certificate) {
    return lapse_of(certificate, revocations, now_s) != nullptr;
  });
  change.new_key = differs || !change.forgotten.empty() || now_s > state.holder_lapses_s;
  if (change.new_key) state.draw_team_key();
  return change;
}

std::optional<Octets> TeamSeal::key_message_for(const TeamPeer& peer) {
  State& state = *state_;
  SealingKey key;
  Octets keys;
  {
    const std::lock_guard lock(state.mutex);
    const AdmittedPeer* to = state.peers.find(peer);
    if (to == nullptr) return std::nullopt;
    key = to->to_peer;
    keys = to_octets(state.team_keys);
    state.holder_lapses_s = std::min(state.holder_lapses_s, to->certificate.valid_until_s);
  }
  Octets message;
  encrypt(key, random_nonce(), key_message_data(state.self, peer), keys, message);
  sodium_memzero(keys.data(), keys.size());
  return message;
}

const char* TeamSeal::accept_key_message(const TeamPeer& from, OctetView message) {
  State& state = *state_;
  SealingKey key;
  {
    const std::lock_guard lock(state.mutex);
    const AdmittedPeer* sender = state.peers.find(from);
    if (sender == nullptr) return "key message of a process that is not admitted";
    key = sender->from_peer;
  }
  auto content = decrypt(key, key_message_data(from, state.self), message);
  if (!content) return "key message is not its sender's to this process";
  std::vector<TeamKey> keys = team_keys_from(*content);
  sodium_memzero(content->data(), content->size());
  if (keys.empty()) return "key message does not hold keys";

  const std::lock_guard lock(state.mutex);
  state.peers.heard(from);
  AdmittedPeer* sender = state.peers.find(from);
  if (sender == nullptr) return "key message of a process that is not admitted";
  // A recording of an older message must not take the newer keys away.
  if (sender->team_keys.empty() || sender->team_keys.back().number < keys.back().number)
    sender->team_keys = std::move(keys);
  return nullptr;
}

std::optional<Octets> TeamSeal::seal(const SealContext& context, OctetView content) const {
  State& state = *state_;
  if (context.sender != state.self)
    throw std::invalid_argument("a message is sealed in the name of its own sender only");
  if (context.addressee == state.self)
    throw std::invalid_argument("a message is not sealed for its own sender");
  if (!context.addressee) return state.seal_to_all(associated_data(context), content);
  SealingKey key;
  {
    const std::lock_guard lock(state.mutex);
    const AdmittedPeer* peer = state.peers.find(*context.addressee);
    if (peer == nullptr) return std::nullopt;
    key = peer->to_peer;
  }
  Octets sealed;
  sealed.reserve(content.size() + kAddressedSealBytes);
  encrypt(key, random_nonce(), associated_data(context), content, sealed);
  return sealed;
}

Opened TeamSeal::open(const SealContext& context, OctetView sealed) {
  State& state = *state_;
  if (context.sender == state.self) return refused("message of this process itself");
  if (!context.addressee) return state.open_to_all(context, sealed);
  if (*context.addressee != state.self) return refused("message for another process");
  return state.open_for_self(context, sealed);
}

// Number of the key, nonce, ciphertext, tag, signature.
Octets TeamSeal::State::seal_to_all(Octets associated, OctetView content) {
  const TeamKey key = [this] {
    const std::lock_guard lock(mutex);
    return team_keys.back();
  }();
  ByteWriter number;
  number.u32(key.number);
  Octets sealed = number.release();
  associated.insert(associated.end(), sealed.begin(), sealed.end());
  sealed.reserve(content.size() + kTeamSealBytes);
  encrypt(key.key, random_nonce(), associated, content, sealed);
  const OctetView encrypted = OctetView(sealed).subspan(sizeof(std::uint32_t));
  const Signature signature = sign(signed_statement(key.key, associated, encrypted), secret);
  sealed.insert(sealed.end(), signature.begin(), signature.end());
  return sealed;
}

Opened TeamSeal::State::open_for_self(const SealContext& context, OctetView sealed) {
  if (sealed.size() < kAddressedSealBytes) return refused("message shorter than its seal");
  SealingKey key;
  {
    const std::lock_guard lock(mutex);
    const AdmittedPeer* sender = peers.find(context.sender);
    if (sender == nullptr) return not_yet("its sender is not admitted");
    key = sender->from_peer;
  }
  auto content = decrypt(key, associated_data(context), sealed);
  if (!content) return refused("message is not its sender's, or was changed on its way");
  const std::lock_guard lock(mutex);
  peers.heard(context.sender);
  return opened(std::move(*content));
}

Opened TeamSeal::State::open_to_all(const SealContext& context, OctetView sealed) {
  if (sealed.size() < kTeamSealBytes) return refused("message shorter than its seal");
  const OctetView number_octets = sealed.first(sizeof(std::uint32_t));
  const OctetView encrypted = sealed.subspan(
      number_octets.size(), sealed.size() - number_octets.size() - Signature().size());
  const std::uint32_t number = ByteReader(number_octets).u32();
  Signature signature;
  std::ranges::copy(sealed.last(signature.size()), signature.begin());

  SealingKey key;
  PublicKey signer;
  {
    const std::lock_guard lock(mutex);
    const AdmittedPeer* sender = peers.find(context.sender);
    if (sender == nullptr) return not_yet("its sender is not admitted");
    const std::vector<TeamKey>& keys = sender->team_keys;
    if (keys.empty() || number > keys.back().number)
      return not_yet("its sender's key for messages to all is not here");
    const auto found = std::ranges::find(keys, number, &TeamKey::number);
    if (found == keys.end()) return refused("message under a key that its sender gave up");
    key = found->key;
    signer = sender->certificate.key;
  }
  Octets associated = associated_data(context);
  associated.insert(associated.end(), number_octets.begin(), number_octets.end());
  // The tag first: it is much cheaper to check than a signature, and stops all strangers.
  auto content = decrypt(key, associated, encrypted);
  if (!content) return refused("message is not its sender's, or was changed on its way");
  if (!verify(signed_statement(key, associated, encrypted), signature, signer))
    return refused("message is not signed by its sender");
  const std::lock_guard lock(mutex);
  peers.heard(context.sender);
  return opened(std::move(*content));
}

}  // namespace km
