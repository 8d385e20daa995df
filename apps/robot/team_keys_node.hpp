#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>

#include "modules/core/robot_identity.hpp"
#include "runtime/dds/shared_seal.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"

namespace km {

/// Seal of this process, from the robot's folder of keys; null without a folder. Throws
/// std::runtime_error and std::invalid_argument that name the fault of the keys and a remedy.
[[nodiscard]] std::shared_ptr<SharedSeal> make_team_seal(const std::filesystem::path& folder,
                                                         const RobotIdentity& own);

/// Checks periodically whether certificates of members have expired or the folder's list of
/// revocations has changed.
class TeamKeysNode final : public Node {
 public:
  using Apply = std::function<void(const MembershipChange& change)>;

  /// `apply` removes the former members and sends new keys. `seal` outlives this.
  TeamKeysNode(std::filesystem::path folder, SharedSeal& seal, Apply apply);

  void step();

  std::string_view name() const override { return "team_keys"; }
  void start() override { periodic_.start(); }
  void stop() noexcept override { periodic_.stop(); }
  std::exception_ptr error() const override { return periodic_.error(); }

 private:
  const std::filesystem::path folder_;
  SharedSeal& seal_;
  const Apply apply_;
  Periodic periodic_;  // last member: stops first
};

}  // namespace km
