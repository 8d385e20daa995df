#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/lab/crowd/recorded_place.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// A team whose overlap does not depend on its size.
struct CrowdOptions {
  std::size_t robots = 10;
  std::size_t keyframes = 1200;  ///< Least number of keyframes of each robot.
  std::size_t partners = 4;      ///< Number of robots that each robot meets: its neighbours on a
                                 ///< ring, even and below `robots`.
  std::size_t meetings = 3;      ///< Number of places that two such robots have in common.
  std::uint32_t seed = 1;
};

/// Keyframes of one place in the run of a robot.
struct Stretch {
  std::uint32_t place = 0;    ///< Unique; the same for the two robots of a meeting.
  std::size_t recording = 0;  ///< Index of the recorded place that it disguises.
  bool second = false;        ///< It shows the second visit of the recording.
};

/// The runs of all robots: sequences of stretches. Every place is seen by one robot or, at a
/// meeting, by two, in whatever order. Deterministic.
class CrowdWorld {
 public:
  /// Throws std::invalid_argument if there are no recordings, or if `options` are out of bounds.
  CrowdWorld(const std::vector<RecordedPlace>& recordings, const CrowdOptions& options);

  [[nodiscard]] std::size_t robots() const { return runs_.size(); }
  [[nodiscard]] const std::vector<Stretch>& run(std::size_t robot) const { return runs_[robot]; }
  [[nodiscard]] const std::vector<BagOfWords>& visit(const Stretch& stretch) const {
    const RecordedPlace& place = recordings_[stretch.recording];
    return stretch.second ? place.second : place.first;
  }
  /// By keyframe of a robot: its place.
  [[nodiscard]] const std::vector<std::uint32_t>& places(std::size_t robot) const {
    return places_[robot];
  }

 private:
  const std::vector<RecordedPlace>& recordings_;
  std::vector<std::vector<Stretch>> runs_;
  std::vector<std::vector<std::uint32_t>> places_;
};

/// Plays the run of one robot.
class CrowdReplay {
 public:
  CrowdReplay(const CrowdWorld& world, const PlaceDisguise& disguise, std::size_t robot)
      : world_(world), disguise_(disguise), robot_(robot) {}

  /// The bag of the next keyframe; nullopt at the end of the run.
  std::optional<BagOfWords> next();

 private:
  const CrowdWorld& world_;
  const PlaceDisguise& disguise_;
  std::size_t robot_;
  std::size_t stretch_ = 0;
  std::size_t keyframe_ = 0;  // in the stretch
  std::vector<std::uint32_t> words_;
};

}  // namespace km
