#include "test/modules/security/toy_team.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Status = Opened::Status;

TEST_CASE("A message for one robot opens there and only there") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta"), c(team, 2, "gamma");
  introduce(a, b);
  introduce(a, c);
  introduce(b, c);
  const std::size_t size = GENERATE(as<std::size_t>(), 0, 1, 40, 2000, 30000);
  CAPTURE(size);
  const Octets content = toy_content(size);
  const SealContext context = toy_context(a, b.peer());
  const auto sealed = a.seal.seal(context, content);
  REQUIRE(sealed);
  CHECK(sealed->size() == content.size() + kAddressedSealBytes);

  CHECK(*a.seal.seal(context, content) != *sealed);

  const Opened opened = b.seal.open(context, *sealed);
  CHECK(opened.status == Status::kOpened);
  CHECK(opened.reason == nullptr);
  CHECK(opened.content == content);
  CHECK(reason_of(c.seal.open(context, *sealed).reason) == "message for another process");
  const SealContext for_c = toy_context(a, c.peer());
  CHECK(c.seal.open(for_c, *sealed).status == Status::kRefused);
}

TEST_CASE("A message to all opens at every member") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta"), c(team, 2, "gamma");
  introduce(a, b);
  introduce(a, c);
  const std::size_t size = GENERATE(as<std::size_t>(), 0, 1, 40, 2000, 30000);
  CAPTURE(size);
  const Octets content = toy_content(size);
  const SealContext context = toy_context(a);
  const auto sealed = a.seal.seal(context, content);
  REQUIRE(sealed);
  CHECK(sealed->size() == content.size() + kTeamSealBytes);
  CHECK(*a.seal.seal(context, content) != *sealed);
  CHECK(b.seal.open(context, *sealed).content == content);
  CHECK(c.seal.open(context, *sealed).content == content);
}

TEST_CASE("A message waits for the keys it needs") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  REQUIRE(a.admit(b) == nullptr);
  const SealContext for_b = toy_context(a, b.peer());
  const SealContext to_all = toy_context(a);
  const auto sealed_for_b = a.seal.seal(for_b, toy_content());
  const auto sealed_to_all = a.seal.seal(to_all, toy_content());
  REQUIRE(sealed_for_b);
  REQUIRE(sealed_to_all);
  CHECK(b.seal.open(for_b, *sealed_for_b).status == Status::kNotYet);
  CHECK(b.seal.open(to_all, *sealed_to_all).status == Status::kNotYet);

  REQUIRE(b.admit(a) == nullptr);
  CHECK(b.seal.open(for_b, *sealed_for_b).status == Status::kOpened);
  CHECK(b.seal.open(to_all, *sealed_to_all).status == Status::kNotYet);

  const auto key = a.seal.key_message_for(b.peer());
  REQUIRE(key);
  CHECK(b.seal.accept_key_message(a.peer(), *key) == nullptr);
  CHECK(b.seal.open(to_all, *sealed_to_all).status == Status::kOpened);
}

TEST_CASE("A key message opens at one process and is no ordinary message") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta"), c(team, 2, "gamma");
  introduce(a, b);
  introduce(a, c);
  introduce(b, c);
  const auto key = a.seal.key_message_for(b.peer());
  REQUIRE(key);
  CHECK(c.seal.accept_key_message(a.peer(), *key) != nullptr);
  CHECK(b.seal.accept_key_message(c.peer(), *key) != nullptr);
  CHECK(b.seal.accept_key_message({9, 9}, *key) != nullptr);
  const auto message = a.seal.seal(toy_context(a, b.peer()), toy_content());
  CHECK(b.seal.accept_key_message(a.peer(), *message) != nullptr);
  CHECK(b.seal.open(toy_context(a, b.peer()), *key).status == Status::kRefused);
  CHECK(b.seal.accept_key_message(a.peer(), *key) == nullptr);
  CHECK(b.seal.accept_key_message(a.peer(), *key) == nullptr);  // repeating it is harmless
}

TEST_CASE("Messages in another robot's name, to itself, or to an unknown robot are not sealed") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  CHECK_THROWS_AS(a.seal.seal(toy_context(b), toy_content()), std::invalid_argument);
  CHECK_THROWS_AS(a.seal.seal(toy_context(a, a.peer()), toy_content()), std::invalid_argument);
  CHECK_FALSE(a.seal.seal(toy_context(a, b.peer()), toy_content()));
  CHECK_FALSE(a.seal.key_message_for(b.peer()));
}

// Changes that an attacker can make to network traffic: flipping any bit, or random changes.

using Status = Opened::Status;

struct Pair {
  Pair() { introduce(a, b); }
  ToyTeam team;
  ToyMember a{team, 0, "alpha"}, b{team, 1, "beta"};
};

TEST_CASE("A sealed message with any bit flipped is refused") {
  Pair pair;
  const bool addressed = GENERATE(true, false);
  CAPTURE(addressed);
  const SealContext context =
      toy_context(pair.a, addressed ? std::optional(pair.b.peer()) : std::nullopt);
  Octets sealed = pair.a.seal.seal(context, toy_content()).value();
  for (std::size_t bit = 0; bit < 8 * sealed.size(); ++bit) {
    CAPTURE(bit);
    sealed[bit / 8] = static_cast<std::uint8_t>(sealed[bit / 8] ^ (1U << (bit % 8)));
    const Opened opened = pair.b.seal.open(context, sealed);
    CHECK(opened.content.empty());
    // With another key number the message waits, because a new key may still arrive.
    const bool in_key_number = !addressed && bit < 32;
    CHECK(opened.status != Status::kOpened);
    CHECK((opened.status == Status::kRefused || in_key_number));
    sealed[bit / 8] = static_cast<std::uint8_t>(sealed[bit / 8] ^ (1U << (bit % 8)));
  }
  CHECK(pair.b.seal.open(context, sealed).status == Status::kOpened);
}

TEST_CASE("A message with any bit of its context flipped does not open") {
  Pair pair;
  const bool addressed = GENERATE(true, false);
  CAPTURE(addressed);
  const SealContext context =
      toy_context(pair.a, addressed ? std::optional(pair.b.peer()) : std::nullopt);
  const Octets sealed = pair.a.seal.seal(context, toy_content()).value();
  std::vector<std::pair<std::string, std::function<void(SealContext&, unsigned)>>> fields = {
      {"sender",
       [](auto& c, unsigned bit) { c.sender.robot ^= static_cast<RobotId>(1U << (bit % 16)); }},
      {"boot", [](auto& c, unsigned bit) { c.sender.boot ^= std::uint64_t{1} << bit; }},
      {"number", [](auto& c, unsigned bit) { c.number ^= std::uint64_t{1} << bit; }},
      {"key, first half",
       [](auto& c, unsigned bit) { c.key[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8)); }},
      {"key, second half", [](auto& c, unsigned bit) {
         c.key[8 + bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
       }}};
  if (addressed) {
    fields.emplace_back("addressee", [](auto& c, unsigned bit) {
      c.addressee->robot ^= static_cast<RobotId>(1U << (bit % 16));
    });
    fields.emplace_back("addressee's boot", [](auto& c, unsigned bit) {
      c.addressee->boot ^= std::uint64_t{1} << bit;
    });
  }
  for (const auto& [name, flip] : fields)
    for (unsigned bit = 0; bit < 64; ++bit) {
      CAPTURE(name, bit);
      SealContext changed = context;
      flip(changed, bit);
      CHECK(pair.b.seal.open(changed, sealed).status != Status::kOpened);
    }
  for (unsigned bit = 0; bit < 8 * context.topic.size(); ++bit) {
    CAPTURE(bit);
    std::string topic(context.topic);
    topic[bit / 8] = static_cast<char>(topic[bit / 8] ^ (1 << (bit % 8)));
    SealContext changed = context;
    changed.topic = topic;
    CHECK(pair.b.seal.open(changed, sealed).status == Status::kRefused);
  }
  CHECK(pair.b.seal.open(context, sealed).status == Status::kOpened);
}

TEST_CASE("A message of an admitted peer is refused in another context") {
  // All these peers are known, so the context is the reason for the refusal, not a missing key.
  Pair pair;
  ToyMember restarted(pair.a, 5000);
  ToyMember c(pair.team, 2, "gamma");
  introduce(pair.b, restarted);
  introduce(pair.b, c);
  const SealContext context = toy_context(pair.a, pair.b.peer());
  const auto sealed = pair.a.seal.seal(context, toy_content());
  const auto to_all = pair.a.seal.seal(toy_context(pair.a), toy_content());
  REQUIRE(sealed);
  REQUIRE(to_all);
  for (const TeamPeer& other : {restarted.peer(), c.peer()}) {
    SealContext changed = context;
    changed.sender = other;
    CHECK(pair.b.seal.open(changed, *sealed).status == Status::kRefused);
    changed.addressee.reset();
    CHECK(pair.b.seal.open(changed, *to_all).status == Status::kRefused);
  }
  SealContext changed = context;
  changed.addressee.reset();
  CHECK(pair.b.seal.open(changed, *sealed).status != Status::kOpened);
  CHECK(pair.b.seal.open(context, *to_all).status == Status::kRefused);
}

TEST_CASE("Messages changed at random never open") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  InputCorrupter corrupter(seed);
  Pair pair;
  const SealContext for_b = toy_context(pair.a, pair.b.peer());
  const SealContext to_all = toy_context(pair.a);
  const Octets sealed_for_b = pair.a.seal.seal(for_b, toy_content()).value();
  const Octets sealed_to_all = pair.a.seal.seal(to_all, toy_content()).value();
  const Octets key = pair.a.seal.key_message_for(pair.b.peer()).value();
  int accepted = 0;
  for (int i = 0; i < 3000; ++i) {
    const Octets one = corrupter(std::vector<Octets>{sealed_for_b});
    const Octets all = corrupter(std::vector<Octets>{sealed_to_all});
    const Octets keys = corrupter(std::vector<Octets>{key});
    accepted += one != sealed_for_b && pair.b.seal.open(for_b, one).status == Status::kOpened;
    accepted += all != sealed_to_all && pair.b.seal.open(to_all, all).status == Status::kOpened;
    accepted += keys != key && pair.b.seal.accept_key_message(pair.a.peer(), keys) == nullptr;
  }
  CHECK(accepted == 0);
  CHECK(pair.b.seal.open(to_all, sealed_to_all).status == Status::kOpened);
}

TEST_CASE("Credentials with any bit flipped are refused") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  const std::string genuine = b.seal.credentials();
  const auto is_admitted = [&](const std::string& shown) {
    return a.seal.admit(b.identity, shown, kToyNow_s) == nullptr;
  };
  for (std::size_t bit = 0; bit < 8 * genuine.size(); ++bit) {
    CAPTURE(bit);
    std::string shown = genuine;
    shown[bit / 8] = static_cast<char>(shown[bit / 8] ^ (1 << (bit % 8)));
    CHECK_FALSE(is_admitted(shown));
  }
  CHECK_FALSE(a.seal.is_admitted(b.peer()));
  CHECK(is_admitted(genuine));
}

}  // namespace
}  // namespace km
