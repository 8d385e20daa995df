#pragma once

#include <cstdint>
#include <memory>

#include "apps/robot/assemblies/robot_core.hpp"
#include "apps/robot/journal_node.hpp"
#include "modules/absolute_fixes/node/fixes_node.hpp"
#include "modules/localization/node/localization_node.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// From keyframes to closures: with this robot's past, with other robots, with a finished map, and
/// with absolute fixes.
class Places {
 public:
  /// Takes the map and the fixes from `input`. Fixes are kept in `journal`, and keyframes are read
  /// from it.
  Places(RobotCore& core, const RobotConfig& config, RobotInput& input, JournalNode& journal);

  /// Null without --localize.
  [[nodiscard]] const LocalizationNode* localization() const { return localization_; }
  /// The map of --localize, see TeamAgent::begin_in_map(); 0 without.
  [[nodiscard]] std::uint64_t map_id() const { return map_id_; }
  /// Null without absolute fixes.
  [[nodiscard]] const FixesNode* fixes() const { return fixes_; }
  /// The node whose frame the poses are to get; null if that is the robot's own.
  [[nodiscard]] const Node* locator() const {
    return fixes_ != nullptr ? static_cast<const Node*>(fixes_) : localization_;
  }

 private:
  void add_localization(const RobotConfig& config, FinishedMap map);
  void add_fixes(FixInput input, JournalNode& journal);
  void add_loop_closure(const RobotConfig& config, JournalNode& journal);

  RobotCore& core_;
  std::shared_ptr<const Vocabulary> vocabulary_;  // null if the robot has no images
  LocalizationNode* localization_ = nullptr;
  std::uint64_t map_id_ = 0;
  FixesNode* fixes_ = nullptr;
};

}  // namespace km
