#include <catch2/catch.hpp>
#include <functional>
#include <thread>
#include <vector>

#include "runtime/dds/shared_seal.hpp"
#include "test/modules/security/toy_team.hpp"

namespace km {
namespace {

struct Member {
  Member(const ToyTeam& team, RobotId robot, const std::string& name)
      : identity(toy_identity(robot, name)), seal(team.keys_of(robot, name), identity, kToyNow_s) {}

  [[nodiscard]] TeamPeer peer() const { return {identity.robot, identity.boot}; }
  [[nodiscard]] bool admits(const Member& other) {
    return seal.with([&](TeamSeal& own) {
      return own.admit(other.identity, other.seal.credentials(), kToyNow_s);
    }) == nullptr;
  }
  [[nodiscard]] bool takes_key_of(Member& other) {
    const auto key = other.seal.with([&](TeamSeal& its) { return its.key_message_for(peer()); });
    return key && seal.with([&](TeamSeal& own) {
      return own.accept_key_message(other.peer(), *key);
    }) == nullptr;
  }

  RobotIdentity identity;
  SharedSeal seal;
};

// True if a message that `from` seals opens at `to`.
bool passes(Member& from, Member& to, std::optional<TeamPeer> addressee) {
  const SealContext context{.topic = "pings", .sender = from.peer(), .addressee = addressee};
  const auto sealed =
      from.seal.with([&](const TeamSeal& seal) { return seal.seal(context, toy_content()); });
  return sealed && to.seal.with([&](TeamSeal& seal) {
    return seal.open(context, *sealed).content == toy_content();
  });
}

TEST_CASE("Threads may seal, open, admit, remove and update at the same time", "[sealed]") {
  const ToyTeam team;
  Member a(team, 0, "alpha"), b(team, 1, "beta"), c(team, 2, "gamma");
  REQUIRE((a.admits(b) && b.admits(a) && a.takes_key_of(b) && b.takes_key_of(a)));
  const std::vector<std::function<bool()>> uses{
      [&] { return passes(a, b, b.peer()); },
      [&] { return passes(b, a, a.peer()); },
      [&] { return passes(a, b, std::nullopt); },
      [&] {
        const bool admitted = a.admits(c);
        a.seal.with([&](TeamSeal& seal) { seal.forget(c.peer()); });
        return admitted;
      },
      [&] {
        return !a.seal.with(
            [&](TeamSeal& seal) { return seal.update(team.revocations(), kToyNow_s).new_key; });
      },
  };
  constexpr int kTimes = 100;
  std::vector<int> worked(uses.size());
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < uses.size(); ++i)
    threads.emplace_back([&, i] {
      for (int k = 0; k < kTimes; ++k) worked[i] += uses[i]() ? 1 : 0;
    });
  for (std::thread& thread : threads) thread.join();
  CHECK(worked == std::vector<int>(uses.size(), kTimes));
}

}  // namespace
}  // namespace km
