#pragma once

#include <cstddef>
#include <vector>

#include "apps/lab/crowd/crowd_meter.hpp"
#include "apps/lab/crowd/crowd_robot.hpp"
#include "apps/lab/crowd/crowd_world.hpp"
#include "apps/lab/crowd/recorded_place.hpp"
#include "apps/lab/crowd/sketch_index.hpp"

namespace km {

/// How bags of words reach the robots that may have seen the place.
struct SketchRouting {
  std::size_t owners = 6;    ///< Number of heaviest words whose owners get the sketch.
  std::size_t sketch = 100;  ///< Largest number of words of a sketch.
  SketchIndexBounds bounds = {};
  KeyframeIndex window = 10;  ///< See RepeatedNames.
};

/// Costs of place recognition, averaged over robots, and what the observed robots have found.
struct CrowdRun {
  CrowdTraffic sent;          ///< Bags, sketches and answers. A message to several robots counts
                              ///< once per reader.
  CrowdTraffic received;      ///< Bags, sketches and answers.
  std::size_t broadcast = 0;  ///< Bytes sent if a message to all robots counts once.
  std::size_t most_received = 0;  ///< Bytes of the robot that receives most.
  CrowdWork work;                 ///< Packing, sketches and searches.
  double sketches = 0.0;          ///< Stored by a robot for others.
  double named = 0.0;             ///< Robots named for one keyframe.
  std::vector<CrowdRobot> observed;
};

/// Robots that are simulated with all their searches.
struct CrowdObservers {
  std::vector<RobotId> robots;
  double verified_share = 0.5;  ///< Share of the candidates at the same place.
};

/// Every keyframe's bag goes to all robots, as robots do by default.
[[nodiscard]] CrowdRun send_to_everyone(const CrowdWorld& world, const Vocabulary& vocabulary,
                                        const PlaceDisguise& disguise,
                                        const CrowdObservers& observers, const CrowdMeter& meter);

/// Every keyframe's sketch goes to owners of its words. They name robots with similar keyframes,
/// and the bag goes to these robots, after the bag of the keyframe before it if they do not have
/// it: its normaliser. All owners are simulated.
[[nodiscard]] CrowdRun send_by_owners(const CrowdWorld& world, const Vocabulary& vocabulary,
                                      const PlaceDisguise& disguise,
                                      const CrowdObservers& observers, const SketchRouting& routing,
                                      const CrowdMeter& meter);

/// Traffic of a robot if each bag is divided among the owners of its words, each of which answers
/// with a robot, and the bag goes to one of these (Cieslewski and Scaramuzza, RA-L 2017). Sizes
/// only: of the first `keyframes` keyframes of each robot, as averages of sent messages.
[[nodiscard]] CrowdTraffic divided_bags(const CrowdWorld& world, const PlaceDisguise& disguise,
                                        std::size_t keyframes);

}  // namespace km
