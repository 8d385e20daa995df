#include <catch2/catch.hpp>

#include <algorithm>

#include "test/modules/security/toy_team.hpp"

namespace km {
namespace {

using Status = Opened::Status;

TEST_CASE("A message for one robot opens there and only there", "[security]") {
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

TEST_CASE("A message to all opens at every member", "[security]") {
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

TEST_CASE("A message waits for the keys it needs", "[security]") {
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

TEST_CASE("A key message opens at one process and is no ordinary message", "[security]") {
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

TEST_CASE("Messages in another robot's name, to itself, or to an unknown robot are not sealed",
          "[security]") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  CHECK_THROWS_AS(a.seal.seal(toy_context(b), toy_content()), std::invalid_argument);
  CHECK_THROWS_AS(a.seal.seal(toy_context(a, a.peer()), toy_content()), std::invalid_argument);
  CHECK_FALSE(a.seal.seal(toy_context(a, b.peer()), toy_content()));
  CHECK_FALSE(a.seal.key_message_for(b.peer()));
}

}  // namespace
}  // namespace km
