#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

#include "modules/core/data/stamped_pose.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"

namespace km {

/// "robot0/optimized" for ".../robot0/optimized.tum", "team/robot0" for
/// ".../team.mcap:/robot0/path".
[[nodiscard]] std::string short_name(const std::filesystem::path& file);

/// Inputs with each MCAP file replaced by its trajectories: FILE:/NAME/path of every robot, or else
/// FILE:/NAME/odometry. Throws InputFileError for a record that cannot be read or has none.
[[nodiscard]] std::vector<std::filesystem::path> expand_records(
    const std::vector<std::filesystem::path>& inputs);

/// Poses in order of time, from a topic of a record, from the only trajectory of a record, or as
/// read_trajectory() reads them. The last nav_msgs/Path counts; nav_msgs/Odometry and
/// geometry_msgs/PoseStamped give one pose each. Throws InputFileError.
[[nodiscard]] std::vector<StampedPose> read_estimate(const std::filesystem::path& input);

/// The true poses in `files`: one file for all of `count` inputs, or one for each. `option` names
/// the inputs in the message of std::invalid_argument for another number of files.
[[nodiscard]] std::vector<std::vector<StampedPose>> read_truths(
    const std::vector<std::filesystem::path>& files, std::size_t count, const std::string& option);

/// Element i of a list with one element for all inputs, or one for each.
template <typename T>
[[nodiscard]] const T& of_each(const std::vector<T>& list, std::size_t i) {
  return list[list.size() == 1 ? 0 : i];
}

/// The transform from the frame of the estimated trajectories to that of the reference ones, by
/// align_surroundings(): it aligns the surroundings that robots saw. Reference i belongs to
/// trajectory i; there may be more trajectories than references. With `one_for_all` a single
/// reference belongs to every trajectory. Identity without references. Throws an exception with a
/// message of one line.
[[nodiscard]] SE3 placement_of(const std::vector<std::filesystem::path>& trajectories,
                               const std::vector<std::filesystem::path>& references,
                               bool one_for_all);

/// The mesh of a file by without_far_vertices(), whose note is printed.
[[nodiscard]] LabelledMesh read_shown_mesh(const std::filesystem::path& file);

/// All meshes of the files as one, each by read_shown_mesh().
[[nodiscard]] LabelledMesh read_meshes(const std::vector<std::filesystem::path>& files);

/// The palette in `file`, or else in label_palette.csv beside `mesh`, where the simulator and
/// robots write it; empty if there is neither. Throws an exception with one line that names the
/// file and its fault, or one of `meshes` and a label that the palette lacks.
[[nodiscard]] LabelPalette read_palette(std::filesystem::path file,
                                        const std::filesystem::path& mesh,
                                        std::span<const MeshInput> meshes);

void write_png(const std::filesystem::path& file, const cv::Mat& picture);

}  // namespace km
