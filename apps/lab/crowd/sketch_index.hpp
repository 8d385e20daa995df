#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/place_recognition/bow_database.hpp"

namespace km {

/// A keyframe that may show the same place as the one whose sketch was added.
struct SketchMatch {
  KeyframeId keyframe;
  double score = 0.0;  ///< See score().
};

/// Thresholds of SketchIndex.
struct SketchIndexBounds {
  /// Least score of two sketches. Sketches have equal numbers of words, so that the score of
  /// different places depends little on their texture, and is not normalised.
  double min_score = 0.1;
  std::size_t max_robots = 2;  ///< Largest number of robots named for one keyframe.
};

/// The store of an owner of words: sketches of keyframes of all robots. It finds robots that may
/// have seen the same place (see word_owners.hpp).
///
/// The index only names robots. The robot of the new keyframe sends its bag of words to the named
/// robots, which search as they do for any peer. A robot is named once for a keyframe, by its most
/// similar keyframe. Memory and time of a query are linear in the number of stored sketches. Const
/// members are thread-safe.
class SketchIndex {
 public:
  /// For vectors of a vocabulary of `words` words.
  SketchIndex(const SketchIndexBounds& bounds, std::size_t words)
      : bounds_(bounds), database_(words) {}

  /// Stores the weighed `sketch` of a keyframe, unless this keyframe is stored, and returns the
  /// most similar keyframe of each other robot, at most bounds.max_robots, by descending score.
  /// Throws as BowDatabase::add(); the state is then unchanged.
  std::vector<SketchMatch> add(const KeyframeId& keyframe, const BowVector& sketch);

  /// Ignores all stored keyframes of a robot, because its indices now mean other keyframes.
  void forget(RobotId robot);

  /// Number of stored sketches, those to be ignored included.
  [[nodiscard]] std::size_t size() const { return database_.size(); }

 private:
  [[nodiscard]] std::vector<SketchMatch> search(RobotId robot, const BowVector& sketch) const;

  struct Entry {
    KeyframeId keyframe;
    bool ignored = false;
  };
  SketchIndexBounds bounds_;
  BowDatabase database_;
  std::vector<Entry> entries_;  // in the order of database_
  std::set<KeyframeId> known_;
};

}  // namespace km
