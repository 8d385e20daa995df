#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/loop_closure/verifier.hpp"
#include "modules/place_recognition/place_database.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// The keyframes of a finished run. Their poses stay as they are.
struct FinishedMap {
  std::vector<Keyframe> keyframes;  ///< Ascending stamps.
  std::vector<SE3> T_map_kf;        ///< Poses of the bodies, index i for keyframes[i].

  /// Identity of the map, not 0: a hash of its poses. Equal on all robots with this map.
  [[nodiscard]] std::uint64_t id() const;
};

/// Result of one keyframe.
struct MapMatch {
  std::size_t candidates = 0;  ///< Number of keyframes of the map that look similar.
  double similarity = 0.0;     ///< Similarity of the most similar one, or of the one in `closure`.
  /// The most similar keyframe of the map that passed verification; nullopt: none.
  std::optional<Closure> closure = {};
  /// Verification of the most similar keyframe, or of the one in `closure`.
  Verification verification = {};
};

/// Finds the pose of a keyframe in a finished map.
///
/// The map is frozen, so one of its keyframes is enough to state a pose in it. A robot that
/// localises itself has the first keyframe of the map as its own keyframe 0, and every match is a
/// closure from keyframe 0. For a match with keyframe m of the map,
///     T_0_i = T_map_0^-1 T_map_m T_m_i,
/// and the covariance is that of T_m_i, because both are in the tangent space at the same pose. The
/// pose graph of the robot is therefore as large as without the map. Not thread-safe.
class MapMatcher {
 public:
  /// Throws ConfigError if a config is out of bounds, std::invalid_argument if `map` has no
  /// keyframe or not one pose for each.
  MapMatcher(const PlaceRecognitionConfig& places, const LoopClosureConfig& closures,
             std::shared_ptr<const Vocabulary> vocabulary, FinishedMap map);

  /// Compares a keyframe with the map. Call in the order of keyframes, because the keyframe before
  /// normalises the similarity.
  [[nodiscard]] MapMatch match(const Keyframe& keyframe);

 private:
  FinishedMap map_;
  std::shared_ptr<const Vocabulary> vocabulary_;
  PlaceDatabase places_;
  Verifier verifier_;
  BowVector previous_;  // words of the keyframe before; empty at first
};

}  // namespace km
