#include "apps/evaluate/inputs.hpp"

#include <deque>
#include <stdexcept>

#include "apps/evaluate/recorded_poses.hpp"
#include "modules/core/input_file.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"

namespace km {

std::string short_name(const std::filesystem::path& file) {
  if (const auto recorded = split_record(file))
    return (recorded->file.stem() / recorded->robot()).string();
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path().filename();
  return (folder / file.stem()).string();
}

SE3 placement_of(const std::vector<std::filesystem::path>& trajectories,
                 const std::vector<std::filesystem::path>& references, bool one_for_all) {
  if (references.empty()) return SE3::Identity();
  const bool shared = one_for_all && references.size() == 1;
  const std::size_t count = shared ? trajectories.size() : references.size();
  std::deque<std::vector<StampedPose>> poses;  // inputs refer to them
  std::vector<TrajectoryInput> inputs;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& reference = poses.emplace_back(read_trajectory(references[shared ? 0 : i]));
    const auto& estimate = poses.emplace_back(read_estimate(trajectories.at(i)));
    inputs.push_back({short_name(trajectories[i]), reference, estimate, std::nullopt});
  }
  return align_surroundings(inputs);
}

LabelPalette read_palette(std::filesystem::path file, const std::filesystem::path& mesh,
                          std::span<const MeshInput> meshes) {
  if (file.empty()) {
    file = mesh.parent_path() / "label_palette.csv";
    if (is_absent(file)) return {};
  }
  LabelPalette palette = parse_label_palette(read_input_file(file), file.string());
  for (const MeshInput& input : meshes)
    check_labels(input.mesh, input.name, palette, file.string());
  return palette;
}

}  // namespace km
