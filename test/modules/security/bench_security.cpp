#include <catch2/catch.hpp>

#include "test/modules/security/toy_team.hpp"

namespace km {
namespace {

TEST_CASE("Sealing and opening", "[!benchmark]") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  introduce(a, b);
  for (const std::size_t size : {100U, 2000U, 30000U})
    for (const bool addressed : {true, false}) {
      const Octets content = toy_content(size);
      const SealContext context =
          toy_context(a, addressed ? std::optional(b.peer()) : std::nullopt);
      const Octets sealed = a.seal.seal(context, content).value();
      const std::string what = std::string(addressed ? "for one" : "to all") + ", " +
                               std::to_string(size) + " B, +" +
                               std::to_string(sealed.size() - size) + " B";
      BENCHMARK("seal " + what) {
        return a.seal.seal(context, content);
      };
      BENCHMARK("open " + what) {
        return b.seal.open(context, sealed);
      };
    }
}

TEST_CASE("Refusing the message of an unknown sender", "[!benchmark]") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  introduce(a, b);
  for (const std::size_t size : {100U, 2000U, 30000U}) {
    Octets sealed = a.seal.seal(toy_context(a), toy_content(size)).value();
    sealed[40] ^= 1U;
    BENCHMARK("refuse to all, " + std::to_string(size) + " B") {
      return b.seal.open(toy_context(a), sealed);
    };
  }
}

TEST_CASE("Admission and keys", "[!benchmark]") {
  const ToyTeam team;
  ToyMember a(team, 0, "alpha"), b(team, 1, "beta");
  introduce(a, b);
  const Octets key = a.seal.key_message_for(b.peer()).value();
  BENCHMARK("admit") {
    return a.admit(b);
  };
  BENCHMARK("make a key message, " + std::to_string(key.size()) + " B") {
    return a.seal.key_message_for(b.peer());
  };
  BENCHMARK("accept a key message") {
    return b.seal.accept_key_message(a.peer(), key);
  };
}

}  // namespace
}  // namespace km
