#include "apps/robot/team_keys_node.hpp"

#include <chrono>
#include <cstdint>
#include <utility>

#include "modules/security/key_folder.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::chrono::seconds kPeriod{10};

std::int64_t now_s() {
  return static_cast<std::int64_t>(wall_now_s());
}

}  // namespace

std::shared_ptr<SharedSeal> make_team_seal(const std::filesystem::path& folder,
                                           const RobotIdentity& own) {
  if (folder.empty()) return nullptr;
  const RobotKeys keys = load_robot_keys(folder);
  auto seal = std::make_shared<SharedSeal>(keys, own, now_s());
  log::info("keys") << folder.string() << ": robot " << keys.certificate.name << " of team "
                    << keys.certificate.team << "; only robots of this team are heard";
  return seal;
}

TeamKeysNode::TeamKeysNode(std::filesystem::path folder, SharedSeal& seal, Apply apply)
    : folder_(std::move(folder)),
      seal_(seal),
      apply_(std::move(apply)),
      periodic_(
          kPeriod, [this] { step(); }, "team_keys") {}

void TeamKeysNode::step() try {
  const Revocations list = load_revocations(folder_);
  const MembershipChange change =
      seal_.with([&](TeamSeal& seal) { return seal.update(list, now_s()); });
  for (const TeamPeer& peer : change.forgotten)
    log::warn("keys") << "robot " << peer.robot << " is a member no more: revoked or expired";
  apply_(change);
} catch (const std::exception& error) {
  // A list may be incomplete while it is copied; the old one stays in use.
  log::limited(log::Level::kWarn, "keys", "revocations") << error.what();
}

}  // namespace km
