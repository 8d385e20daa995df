#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace km {

/// Options that all commands share.
struct VocabularyCommand {
  std::string vocabulary;  ///< The file to write or to read.
  std::string json;        ///< Results for programs; none if empty.
  int features = 1000;     ///< ORB features per image.
  int every = 1;           ///< Use every n-th image.
};

struct TrainCommand : VocabularyCommand {
  std::vector<std::string> images;
  int branching = 10;
  int depth = 5;
  std::uint32_t seed = 1;
};

struct InspectCommand : VocabularyCommand {
  std::vector<std::string> images;  ///< To count words in.
  std::vector<std::string> pair;    ///< Two images to compare, or none.
};

struct EvaluateCommand : VocabularyCommand {
  std::vector<std::string> known;    ///< Images of the robot that is asked.
  std::vector<std::string> queries;  ///< Images of the robot that asks.
  std::string truth;                 ///< Poses: TUM or EuRoC.
  double max_distance_m = 2.0;
  double max_angle_deg = 45.0;
  double min_normalizer = 0.05;
  std::size_t max_candidates = 1000000;  ///< Per query, the best ones.
};

/// Each prints to stdout and returns the exit code. Throw std::exception for unusable input.
int train(const TrainCommand& command);
int inspect(const InspectCommand& command);
int evaluate(const EvaluateCommand& command);

}  // namespace km
