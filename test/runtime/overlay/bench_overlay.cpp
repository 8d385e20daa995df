#include <catch2/catch.hpp>

#include "test/runtime/overlay/overlay_network.hpp"

namespace km {
namespace {

TEST_CASE("Overlay with and without keys", "[!benchmark]") {
  const ToyTeam team;
  const ToyMember a(team, kA, "alpha"), b(team, kB, "beta");
  const OverlayKeys keys = overlay_keys(a.seal);
  for (const std::size_t size : {600U, 24000U}) {
    OverlayMessage message{
        .stream = OverlayStream::kBag, .origin = a.peer(), .content = octets(size)};
    const std::string what = ", " + std::to_string(size) + " B";
    BENCHMARK("sign" + what) {
      return endorsement_of(message, keys);
    };
    OverlayMessage endorsed = message;
    endorse(endorsed, keys);
    BENCHMARK("check" + what) {
      return is_endorsed(endorsed, a.keys.certificate.key);
    };
  }
  BENCHMARK("check an introduction") {
    return b.seal.certified(a.identity, a.seal.credentials(), kToyNow_s).value.has_value();
  };
}

}  // namespace
}  // namespace km
