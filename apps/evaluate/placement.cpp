#include "apps/evaluate/placement.hpp"

#include <deque>

#include "apps/evaluate/named_files.hpp"
#include "modules/evaluation/surroundings_alignment.hpp"
#include "modules/evaluation/trajectory_file.hpp"

namespace km {

SE3 placement_of(const std::vector<std::filesystem::path>& trajectories,
                 const std::vector<std::filesystem::path>& references, bool one_for_all) {
  if (references.empty()) return SE3::Identity();
  const bool shared = one_for_all && references.size() == 1;
  const std::size_t count = shared ? trajectories.size() : references.size();
  std::deque<std::vector<StampedPose>> poses;  // inputs refer to them
  std::vector<TrajectoryInput> inputs;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& reference = poses.emplace_back(read_trajectory(references[shared ? 0 : i]));
    const auto& estimate = poses.emplace_back(read_trajectory(trajectories.at(i)));
    inputs.push_back({short_name(trajectories[i]), reference, estimate, std::nullopt});
  }
  return align_surroundings(inputs);
}

}  // namespace km
