#include <catch2/catch.hpp>

#include "modules/security/admitted_peers.hpp"

namespace km {
namespace {

TEST_CASE("The number of admitted processes is bounded", "[security]") {
  AdmittedPeers peers;
  const TeamPeer live{0, 1};
  peers.add(live, {});
  peers.received(live);
  for (RobotId robot = 1; robot < 2 * kMaxAdmitted; ++robot) peers.add({robot, 1}, {});
  CHECK(peers.size() == kMaxAdmitted);
  CHECK(peers.find(live) != nullptr);
  CHECK(peers.find({2 * kMaxAdmitted - 1, 1}) != nullptr);
}

}  // namespace
}  // namespace km
